// Compiled once per instruction set (mirrorbake_add_isa_sources): MIRRORBAKE_ISA names the level.
#include "block_weights.hpp"

#include "mirrorbake/core/vector_bytes.hpp"

// How vectors are passed differs between instruction sets, but none is passed beyond this file.
#pragma GCC diagnostic ignored "-Wpsabi"

// Several quadrilaterals at once, one in each lane of a vector, over grids of equally many cells. By Green's
// theorem the integral of f over the part of a quadrilateral in a cell is that of F dy around it, F(x, y) the
// integral of f from the cell's left side to x, or to its right side if x is beyond it. Neighbours share
// their edges, so that what one gets less, the other gets more: nothing is lost or counted twice. The sign of
// all integrals depends on the order of the corners; it goes when weights are made to add up to 1.

namespace mirrorbake::MIRRORBAKE_ISA {
namespace {

// Boxes are small, so that floats hold positions in them to 1e-6 of a texel.
typedef float Floats __attribute__((vector_size(kVectorBytes)));
constexpr std::size_t kLanes = sizeof(Floats) / sizeof(float);

inline Floats all(float v) { return Floats{} + v; }
inline Floats smaller(Floats a, Floats b) { return a < b ? a : b; }
inline Floats larger(Floats a, Floats b) { return a > b ? a : b; }
inline Floats within(Floats v, Floats low, Floats high) { return smaller(larger(v, low), high); }
inline Floats magnitude(Floats v) { return v < 0.0F ? -v : v; }

struct Points {
  Floats x;
  Floats y;
};

// The part of an edge in a row of cells, y from its upper side.
struct Piece {
  Points from;
  Points to;
  Floats x_per_y;
  Floats per_length;  // 1 / (to.x − from.x), or 0 if that is a rounding error
};

constexpr float kUpright = 1e-6F;

struct Edges {
  explicit Edges(const Points (&corners)[4]) {
    for (int e = 0; e < 4; ++e) {
      from[e] = corners[e];
      to[e] = corners[(e + 1) % 4];
      const Floats height = to[e].y - from[e].y;
      const Floats flat = all(0.0F);
      slope[e] = magnitude(height) > 1e-12F ? (to[e].x - from[e].x) / height : flat;
    }
  }

  // Rows are 1 high.
  Piece in_row(int e, float row) const {
    Piece piece;
    const Floats y = from[e].y - row;
    piece.from.y = within(y, all(0.0F), all(1.0F));
    piece.to.y = within(to[e].y - row, all(0.0F), all(1.0F));
    piece.from.x = from[e].x + (piece.from.y - y) * slope[e];
    piece.to.x = from[e].x + (piece.to.y - y) * slope[e];
    const Floats length = piece.to.x - piece.from.x;
    piece.per_length = magnitude(length) > kUpright ? 1.0F / length : all(0.0F);
    return piece;
  }

  Points from[4];
  Points to[4];
  Floats slope[4];
};

// How much of each cell is covered.
void find_coverage(const Points (&corners)[4], std::uint32_t rows, std::uint32_t columns, Floats* areas) {
  const Edges edges(corners);
  for (std::uint32_t row = 0; row < rows; ++row) {
    Piece pieces[4];
    for (int e = 0; e < 4; ++e) pieces[e] = edges.in_row(e, static_cast<float>(row));
    for (std::uint32_t column = 0; column < columns; ++column) {
      const Floats left = all(static_cast<float>(column));
      Floats area = all(0.0F);
      for (const Piece& piece : pieces) {
        // Before u and after v the piece is beyond the cell's sides.
        const Floats a = piece.from.x - left;
        const Floats b = piece.to.x - left;
        const Floats u = within(a, all(0.0F), all(1.0F));
        const Floats v = within(b, all(0.0F), all(1.0F));
        const Floats middle = 0.5F * (u + v);
        const Floats mean = ((u - a) * u + (v - u) * middle + (b - v) * v) * piece.per_length;
        area += (piece.per_length != 0.0F ? mean : middle) * (piece.to.y - piece.from.y);
      }
      *areas++ = area;
    }
  }
}

struct Moments {
  Floats area;  // ∫ 1, ∫ x, ∫ y and ∫ xy, x and y from the cell's corner above left
  Floats x;
  Floats y;
  Floats xy;
};

// Integrals over the part of a cell of the row that is on the left of a piece.
inline void add_moments(const Piece& piece, float column, Moments& sum) {
  const Floats zero = all(0.0F);
  const Floats one = all(1.0F);
  const Floats ax = piece.from.x - column;
  const Floats ay = piece.from.y;
  const Floats bx = piece.to.x - column;
  const Floats by = piece.to.y;
  // Before (ux, uy) and after (vx, vy) the piece is beyond the cell's sides.
  const Floats ux = within(ax, zero, one);
  const Floats vx = within(bx, zero, one);
  const Floats y_per_x = (by - ay) * piece.per_length;
  const Floats low = smaller(ay, by);
  const Floats high = larger(ay, by);
  const Floats uy = within(ay + (ux - ax) * y_per_x, low, high);
  const Floats vy = within(by + (vx - bx) * y_per_x, low, high);
  // There x is 0 or 1, so that x² is x.
  const Floats outer = ux * (uy - ay) + vx * (by - vy);
  const Floats outer_y = 0.5F * (ux * (uy * uy - ay * ay) + vx * (by * by - vy * vy));
  const Floats dx = vx - ux;
  const Floats dy = vy - uy;
  const Floats x = 0.5F * (ux + vx);
  const Floats y = 0.5F * (uy + vy);
  const Floats x2 = x * x + dx * dx * (1.0F / 12.0F);
  sum.area += outer + x * dy;
  sum.x += 0.5F * (outer + x2 * dy);
  sum.y += outer_y + (x * y + dx * dy * (1.0F / 12.0F)) * dy;
  sum.xy += 0.5F * (outer_y + (y * x2 + x * dx * dy * (1.0F / 6.0F)) * dy);
}

// Integrals of the bilinear interpolation between the corners of cells: weights of the corners. In a cell
// they are products of x, y, 1 − x and 1 − y, x and y from its corner above left.
template <typename RowWeight>
void find_interpolation(const Points (&corners)[4], std::uint32_t rows, std::uint32_t columns,
                        const RowWeight& row_weight, Floats* weights) {
  const Edges edges(corners);
  for (std::uint32_t i = 0; i < rows * columns; ++i) weights[i] = all(0.0F);
  for (std::uint32_t row = 0; row + 1 < rows; ++row) {
    Piece pieces[4];
    for (int e = 0; e < 4; ++e) pieces[e] = edges.in_row(e, static_cast<float>(row));
    // Of a cell, where the rows have different solid angles.
    const Floats weight = 0.5F * (row_weight(row) + row_weight(row + 1));
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      Moments sum = {};
      for (const Piece& piece : pieces) add_moments(piece, static_cast<float>(column), sum);
      Floats* w = weights + row * columns + column;
      w[0] += weight * (sum.area - sum.x - sum.y + sum.xy);
      w[1] += weight * (sum.x - sum.xy);
      w[columns] += weight * (sum.y - sum.xy);
      w[columns + 1] += weight * sum.xy;
    }
  }
}

Floats sum_of(const Floats* values, std::size_t count) {
  Floats sum = all(0.0F);
  for (std::size_t i = 0; i < count; ++i) sum += values[i];
  return sum;
}

// Σ (−z)^k / (2k + 1)! is sin(√z)/√z, and z ≤ 2π² on an angular map's square: what is left out is below
// 1e-11.
inline Floats sine_quotient(Floats z) {
  Floats p = all(1.0F);
  for (int k = 13; k > 0; --k) p = 1.0F - z * p * (1.0F / static_cast<float>(2 * k * (2 * k + 1)));
  return magnitude(p);
}

inline Floats root(Floats v) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) v[lane] = __builtin_sqrtf(v[lane]);
  return v;
}

// Of texels at their distance from the centre of the face, squared.
Floats density_at(const TexelDensity& density, Floats radius2) {
  switch (density.kind) {
    case TexelDensity::equal: break;
    case TexelDensity::cube: {
      const Floats q = 1.0F + radius2;
      return 1.0F / (q * root(q));
    }
    case TexelDensity::paraboloid: {
      const Floats q = 1.0F + radius2;
      return 1.0F / (q * q);
    }
    case TexelDensity::fisheye: {
      const float angle = static_cast<float>(density.half_angle);
      return sine_quotient(angle * angle * radius2);
    }
  }
  return all(1.0F);
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
      share_[lane] = tile.shares[i];
      const std::size_t numbers[4] = {i, i + 1, i + tile.pitch + 1, i + tile.pitch};
      for (int corner = 0; corner < 4; ++corner) {
        corners_[corner].x[lane] = static_cast<float>(tile.corners.x[numbers[corner]] - boxes.left[i]);
        corners_[corner].y[lane] = static_cast<float>(tile.corners.y[numbers[corner]] - boxes.top[i]);
      }
    }
  }

  void find(const BoxShape& shape, Floats* weights) const {
    const auto [rows, columns, face, kind] = shape;
    const std::size_t count = static_cast<std::size_t>(rows) * columns;
    if (kind == kArea) {
      find_area(rows, columns, weights);
      return scale(weights, count, all(1.0F));
    }
    Points from_centers[4];
    for (int corner = 0; corner < 4; ++corner) {
      from_centers[corner] = {corners_[corner].x - 0.5F, corners_[corner].y - 0.5F};
    }
    find_interpolation(
        from_centers, rows, columns, [&](std::uint32_t row) { return row_weight(row); }, weights);
    if (kind == kInterpolate) return scale(weights, count, all(1.0F));
    Floats areas[kMostBlockTaps];
    find_area(rows, columns, areas);
    scale(areas, count, 1.0F - share_);
    scale(weights, count, share_);
    for (std::size_t i = 0; i < count; ++i) weights[i] += areas[i];
  }

 private:
  static void scale(Floats* weights, std::size_t count, Floats sum) {
    constexpr float kRounding = 1e-8F;  // is nothing, also where a light is
    const Floats factor = sum / sum_of(weights, count);
    for (std::size_t i = 0; i < count; ++i) {
      const Floats weight = factor * weights[i];
      weights[i] = weight > kRounding ? weight : all(0.0F);
    }
  }

  Floats row_weight(std::uint32_t row) const {
    Floats weight = all(1.0F);
    if (source_.by_row == nullptr) return weight;
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      weight[lane] = static_cast<float>(source_.by_row[top_[lane] + static_cast<std::int32_t>(row)]);
    return weight;
  }

  void find_area(std::uint32_t rows, std::uint32_t columns, Floats* weights) const {
    find_coverage(corners_, rows, columns, weights);
    if (source_.by_row != nullptr) {
      for (std::uint32_t row = 0; row < rows; ++row) {
        const Floats weight = row_weight(row);
        for (std::uint32_t column = 0; column < columns; ++column) *weights++ *= weight;
      }
    } else if (source_.by_texel != nullptr) {
      for (std::uint32_t row = 0; row < rows; ++row) {
        for (std::uint32_t column = 0; column < columns; ++column, ++weights) {
          for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const std::ptrdiff_t texel =
                (top_[lane] + row) * static_cast<std::ptrdiff_t>(source_.density.width) + left_[lane] +
                column;
            (*weights)[lane] *= static_cast<float>(source_.by_texel[texel]);
          }
        }
      }
    } else if (source_.density.kind != TexelDensity::equal) {
      const float per_row = 2.0F / static_cast<float>(source_.density.height);
      const float per_column = 2.0F / static_cast<float>(source_.density.width);
      const Floats left = __builtin_convertvector(left_, Floats) + 0.5F;
      const Floats top = __builtin_convertvector(top_, Floats) + 0.5F;
      for (std::uint32_t row = 0; row < rows; ++row) {
        const Floats y = (top + static_cast<float>(row)) * per_row - 1.0F;
        for (std::uint32_t column = 0; column < columns; ++column) {
          const Floats x = (left + static_cast<float>(column)) * per_column - 1.0F;
          *weights++ *= density_at(source_.density, x * x + y * y);
        }
      }
    }
  }

  typedef std::int32_t Indices __attribute__((vector_size(kVectorBytes)));

  const TexelWeights& source_;
  Points corners_[4];  // from the corner of the box above left
  Indices left_;
  Indices top_;
  Floats share_;
};

}  // namespace

void find_weights(const TileImages& tile, const BoxArrays& boxes, const TexelWeights& source,
                  const BoxShape& shape, const std::uint32_t* texels, std::size_t count, float* weights) {
  const std::size_t size = static_cast<std::size_t>(shape.rows) * shape.columns;
  Floats found[kMostBlockTaps];
  for (std::size_t first = 0; first < count; first += kLanes) {
    const std::size_t lanes = count - first < kLanes ? count - first : kLanes;
    Batch(tile, boxes, source, texels + first, lanes).find(shape, found);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      for (std::size_t i = 0; i < size; ++i) *weights++ = found[i][lane];
    }
  }
}

}  // namespace mirrorbake::MIRRORBAKE_ISA
