// Compiled once per instruction set (mirrorbake_add_isa_sources): MIRRORBAKE_ISA names the level.
#include "block_weights.hpp"

// How vectors are passed differs between instruction sets, but none is passed beyond this file.
#pragma GCC diagnostic ignored "-Wpsabi"

// Several quadrilaterals at once, one in each lane of a vector, over grids of equally many cells. By Green's theorem
// the integral of f over the part of a quadrilateral in a cell is that of F dy around it, F(x, y) the integral of f
// from the cell's left side to x, or to its right side if x is beyond it. Neighbours share their edges, so that what
// one gets less, the other gets more: nothing is lost or counted twice. The sign of all integrals depends on the
// order of the corners; it goes when weights are made to add up to 1.

namespace mirrorbake::MIRRORBAKE_ISA {
namespace {

#if defined(__AVX512F__)
constexpr std::size_t kLanes = 8;
#elif defined(__AVX__)
constexpr std::size_t kLanes = 4;
#else
constexpr std::size_t kLanes = 2;
#endif

typedef double Doubles __attribute__((vector_size(8 * kLanes)));

inline Doubles all(double v) { return Doubles{} + v; }
inline Doubles smaller(Doubles a, Doubles b) { return a < b ? a : b; }
inline Doubles larger(Doubles a, Doubles b) { return a > b ? a : b; }
inline Doubles within(Doubles v, Doubles low, Doubles high) { return smaller(larger(v, low), high); }
inline Doubles magnitude(Doubles v) { return v < 0.0 ? -v : v; }

struct Points {
  Doubles x;
  Doubles y;
};

// The part of an edge in a row of cells, from its upper side.
struct Piece {
  Points from;
  Points to;
  Doubles x_per_y;
  Doubles per_length;  // 1 / (to.x − from.x), or 0 if that is a rounding error
};

constexpr double kUpright = 1e-9;

struct Edges {
  explicit Edges(const Points (&corners)[4]) {
    for (int e = 0; e < 4; ++e) {
      from[e] = corners[e];
      to[e] = corners[(e + 1) % 4];
      const Doubles height = to[e].y - from[e].y;
      const Doubles flat = all(0.0);
      slope[e] = magnitude(height) > 1e-12 ? (to[e].x - from[e].x) / height : flat;
    }
  }

  // Rows and columns are 1 high and wide.
  Piece in_row(int e, double row) const {
    Piece piece;
    piece.from.y = within(from[e].y, all(row), all(row + 1.0));
    piece.to.y = within(to[e].y, all(row), all(row + 1.0));
    piece.from.x = from[e].x + (piece.from.y - from[e].y) * slope[e];
    piece.to.x = from[e].x + (piece.to.y - from[e].y) * slope[e];
    const Doubles length = piece.to.x - piece.from.x;
    piece.per_length = magnitude(length) > kUpright ? 1.0 / length : all(0.0);
    return piece;
  }

  Points from[4];
  Points to[4];
  Doubles slope[4];
};

// How much of each cell is covered.
void find_coverage(const Points (&corners)[4], std::uint32_t rows, std::uint32_t columns, Doubles* areas) {
  const Edges edges(corners);
  for (std::uint32_t row = 0; row < rows; ++row) {
    Piece pieces[4];
    for (int e = 0; e < 4; ++e) pieces[e] = edges.in_row(e, row);
    for (std::uint32_t column = 0; column < columns; ++column) {
      const Doubles left = all(column);
      const auto inside = [](Doubles x) { return within(x, all(0.0), all(1.0)); };
      Doubles area = all(0.0);
      for (const Piece& piece : pieces) {
        // The mean of inside(x) along the piece is the difference of its integrals, u (x − u/2), over their distance.
        const Doubles a = piece.from.x - left;
        const Doubles b = piece.to.x - left;
        const Doubles u = inside(a);
        const Doubles v = inside(b);
        const Doubles mean = piece.per_length != 0.0
                                 ? (v * (b - 0.5 * v) - u * (a - 0.5 * u)) * piece.per_length
                                 : 0.5 * (u + v);
        area += mean * (piece.to.y - piece.from.y);
      }
      *areas++ = area;
    }
  }
}

struct Moments {
  Doubles area;  // ∫ 1, ∫ x, ∫ y and ∫ xy, x and y from the cell's corner above left
  Doubles x;
  Doubles y;
  Doubles xy;
};

// Integrals over the part of the cell (row, column) that is on the left of a piece.
inline void add_moments(const Piece& piece, double row, double column, Moments& sum) {
  const Doubles zero = all(0.0);
  const Doubles one = all(1.0);
  const Doubles ax = piece.from.x - column;
  const Doubles ay = piece.from.y - row;
  const Doubles bx = piece.to.x - column;
  const Doubles by = piece.to.y - row;
  // Before (ux, uy) and after (vx, vy) the piece is beyond the cell's sides.
  const Doubles ux = within(ax, zero, one);
  const Doubles vx = within(bx, zero, one);
  const Doubles y_per_x = (by - ay) * piece.per_length;
  const Doubles low = smaller(ay, by);
  const Doubles high = larger(ay, by);
  const Doubles uy = within(ay + (ux - ax) * y_per_x, low, high);
  const Doubles vy = within(by + (vx - bx) * y_per_x, low, high);
  // There x is 0 or 1, so that x² is x.
  const Doubles outer = ux * (uy - ay) + vx * (by - vy);
  const Doubles outer_y = 0.5 * (ux * (uy * uy - ay * ay) + vx * (by * by - vy * vy));
  const Doubles dx = vx - ux;
  const Doubles dy = vy - uy;
  const Doubles x = 0.5 * (ux + vx);
  const Doubles y = 0.5 * (uy + vy);
  const Doubles x2 = x * x + dx * dx * (1.0 / 12.0);
  sum.area += outer + x * dy;
  sum.x += 0.5 * (outer + x2 * dy);
  sum.y += outer_y + (x * y + dx * dy * (1.0 / 12.0)) * dy;
  sum.xy += 0.5 * (outer_y + (y * x2 + x * dx * dy * (1.0 / 6.0)) * dy);
}

// Integrals of the bilinear interpolation between the corners of cells: weights of the corners. In a cell they are
// products of x, y, 1 − x and 1 − y, x and y from its corner above left.
template <typename RowWeight>
void find_interpolation(const Points (&corners)[4], std::uint32_t rows, std::uint32_t columns,
                        const RowWeight& row_weight, Doubles* weights) {
  const Edges edges(corners);
  for (std::uint32_t i = 0; i < rows * columns; ++i) weights[i] = all(0.0);
  for (std::uint32_t row = 0; row + 1 < rows; ++row) {
    Piece pieces[4];
    for (int e = 0; e < 4; ++e) pieces[e] = edges.in_row(e, row);
    // Of a cell, where the rows have different solid angles.
    const Doubles weight = 0.5 * (row_weight(row) + row_weight(row + 1));
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      Moments sum = {};
      for (const Piece& piece : pieces) add_moments(piece, row, column, sum);
      Doubles* w = weights + row * columns + column;
      w[0] += weight * (sum.area - sum.x - sum.y + sum.xy);
      w[1] += weight * (sum.x - sum.xy);
      w[columns] += weight * (sum.y - sum.xy);
      w[columns + 1] += weight * sum.xy;
    }
  }
}

Doubles sum_of(const Doubles* values, std::size_t count) {
  Doubles sum = all(0.0);
  for (std::size_t i = 0; i < count; ++i) sum += values[i];
  return sum;
}

// Σ (−z)^k / (2k + 1)! is sin(√z)/√z, and z ≤ 2π² on an angular map's square: what is left out is below 1e-11.
inline Doubles sine_quotient(Doubles z) {
  Doubles p = all(1.0);
  for (int k = 13; k > 0; --k) p = 1.0 - z * p * (1.0 / (2.0 * k * (2.0 * k + 1.0)));
  return magnitude(p);
}

inline Doubles root(Doubles v) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) v[lane] = __builtin_sqrt(v[lane]);
  return v;
}

// Of texels at their distance from the centre of the face, squared.
Doubles density_at(const TexelDensity& density, Doubles radius2) {
  switch (density.kind) {
    case TexelDensity::equal: break;
    case TexelDensity::cube: {
      const Doubles q = 1.0 + radius2;
      return 1.0 / (q * root(q));
    }
    case TexelDensity::paraboloid: {
      const Doubles q = 1.0 + radius2;
      return 1.0 / (q * q);
    }
    case TexelDensity::fisheye: return sine_quotient(density.half_angle * density.half_angle * radius2);
  }
  return all(1.0);
}

// As many texels as there are lanes; the last ones may be the same.
class Batch {
 public:
  Batch(const TileImages& tile, const BoxArrays& boxes, const TexelWeights& source,
        const std::uint32_t* texels, std::size_t count)
      : source_(source) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t i = texels[lane < count ? lane : count - 1];
      left_[lane] = boxes.left[i];
      top_[lane] = boxes.top[i];
      share_[lane] = static_cast<double>(tile.shares[i]);
      const std::size_t numbers[4] = {i, i + 1, i + tile.pitch + 1, i + tile.pitch};
      for (int corner = 0; corner < 4; ++corner) {
        corners_[corner].x[lane] = tile.corners.x[numbers[corner]] - boxes.left[i];
        corners_[corner].y[lane] = tile.corners.y[numbers[corner]] - boxes.top[i];
      }
    }
  }

  void find(std::uint8_t kind, std::uint32_t rows, std::uint32_t columns, Doubles* weights) const {
    const std::size_t count = static_cast<std::size_t>(rows) * columns;
    if (kind == kArea) {
      find_area(rows, columns, weights);
      return scale(weights, count, all(1.0));
    }
    Points from_centers[4];
    for (int corner = 0; corner < 4; ++corner) {
      from_centers[corner] = {corners_[corner].x - 0.5, corners_[corner].y - 0.5};
    }
    find_interpolation(
        from_centers, rows, columns, [&](std::uint32_t row) { return row_weight(row); }, weights);
    if (kind == kInterpolate) return scale(weights, count, all(1.0));
    Doubles areas[kMostBlockTaps];
    find_area(rows, columns, areas);
    scale(areas, count, 1.0 - share_);
    scale(weights, count, share_);
    for (std::size_t i = 0; i < count; ++i) weights[i] += areas[i];
  }

 private:
  // Down to rounding errors: these are nothing.
  static void scale(Doubles* weights, std::size_t count, Doubles sum) {
    const Doubles factor = sum / sum_of(weights, count);
    for (std::size_t i = 0; i < count; ++i) {
      const Doubles weight = factor * weights[i];
      weights[i] = weight > 1e-9 ? weight : all(0.0);
    }
  }

  Doubles row_weight(std::uint32_t row) const {
    Doubles weight = all(1.0);
    if (source_.by_row == nullptr) return weight;
    for (std::size_t lane = 0; lane < kLanes; ++lane) weight[lane] = source_.by_row[top_[lane] + row];
    return weight;
  }

  void find_area(std::uint32_t rows, std::uint32_t columns, Doubles* weights) const {
    find_coverage(corners_, rows, columns, weights);
    if (source_.by_row != nullptr) {
      for (std::uint32_t row = 0; row < rows; ++row) {
        const Doubles weight = row_weight(row);
        for (std::uint32_t column = 0; column < columns; ++column) *weights++ *= weight;
      }
    } else if (source_.by_texel != nullptr) {
      for (std::uint32_t row = 0; row < rows; ++row) {
        for (std::uint32_t column = 0; column < columns; ++column, ++weights) {
          for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const std::ptrdiff_t texel =
                (top_[lane] + row) * static_cast<std::ptrdiff_t>(source_.density.width) + left_[lane] +
                column;
            (*weights)[lane] *= source_.by_texel[texel];
          }
        }
      }
    } else if (source_.density.kind != TexelDensity::equal) {
      const Doubles left = __builtin_convertvector(left_, Doubles) + 0.5;
      const Doubles top = __builtin_convertvector(top_, Doubles) + 0.5;
      for (std::uint32_t row = 0; row < rows; ++row) {
        const Doubles y = (top + static_cast<double>(row)) * (2.0 / source_.density.height) - 1.0;
        for (std::uint32_t column = 0; column < columns; ++column) {
          const Doubles x = (left + static_cast<double>(column)) * (2.0 / source_.density.width) - 1.0;
          *weights++ *= density_at(source_.density, x * x + y * y);
        }
      }
    }
  }

  typedef std::int64_t Indices __attribute__((vector_size(8 * kLanes)));

  const TexelWeights& source_;
  Points corners_[4];  // from the corner of the box above left
  Indices left_;
  Indices top_;
  Doubles share_;
};

}  // namespace

void find_weights(const TileImages& tile, const BoxArrays& boxes, const TexelWeights& source,
                  std::uint8_t kind, const std::uint32_t* texels, std::size_t count, std::uint32_t rows,
                  std::uint32_t columns, float* weights) {
  const std::size_t size = static_cast<std::size_t>(rows) * columns;
  Doubles found[kMostBlockTaps];
  for (std::size_t first = 0; first < count; first += kLanes) {
    const std::size_t lanes = count - first < kLanes ? count - first : kLanes;
    Batch(tile, boxes, source, texels + first, lanes).find(kind, rows, columns, found);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      for (std::size_t i = 0; i < size; ++i) *weights++ = static_cast<float>(found[i][lane]);
    }
  }
}

}  // namespace mirrorbake::MIRRORBAKE_ISA
