#include "mirrorbake/envmap/resample.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "irregular_texels.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/envmap/texel_lookup.hpp"
#include "resample_kernels.hpp"

// The mean over a texel's image in the source is exact by Green's theorem. With G(x, y) the running sum of
// value times solid angle from the left end of row y of the source to x, the flux through a texel is ∮ G dy
// around its image, and ∮ of the running solid angle is its solid angle. An edge belongs to two texels and is
// walked once; the walk takes as many steps as the edge meets rows and columns of the source. What one texel
// loses by an edge taken for straight its neighbour gets, so that the flux is kept. The target is worked off
// in square tiles; of the part of the source that a tile needs, the running sums fit into the cache.

namespace mirrorbake {

const ResampleKernels& resample_kernels() {
#ifdef MIRRORBAKE_HAS_X86_LEVELS
  switch (active_isa()) {
    case Isa::avx512: return avx512::kResampleKernels;
    case Isa::avx2: return avx2::kResampleKernels;
    case Isa::sse42: return sse42::kResampleKernels;
    case Isa::baseline: break;
  }
#endif
  return baseline::kResampleKernels;
}

namespace {

/// Positions of many points of the target in the source; face −1 where the source has no such direction.
struct Positions {
  std::vector<double> x;
  std::vector<double> y;
  std::vector<std::int32_t> face;

  void resize(std::size_t count) {
    x.resize(count);
    y.resize(count);
    face.resize(count);
  }
};

/// Directions of points along lines of the target, and where they lie in the source. On cubes, panoramas and
/// paraboloids a line of constant y is p + u(x) q + v(x) r, with tables of u and v.
class LineLookup {
 public:
  /// At the given x of the target.
  LineLookup(const ResampleJob& job, std::vector<double> x)
      : job_(job), kernels_(resample_kernels()), x_(std::move(x)) {
    const ProjectionKind kind = job.target.projection.kind;
    for (const double at : x_) {
      if (kind == ProjectionKind::cube) u_.push_back(at);
      if (kind == ProjectionKind::dual_paraboloid) u_.push_back(at), v_.push_back(at * at);
      if (kind == ProjectionKind::latlong) {
        u_.push_back(std::sin(std::numbers::pi * at));
        v_.push_back(std::cos(std::numbers::pi * at));
      }
    }
    v_.resize(x_.size());
  }

  double x(int i) const { return x_[static_cast<std::size_t>(i)]; }

  /// Positions of the points from number `first` on at height y of a face, from result[offset] on.
  void find(int face, double y, int first, std::size_t count, Positions& result, std::size_t offset) {
    for (std::vector<double>* d : {&dx_, &dy_, &dz_}) d->resize(count);
    set_directions(face, y, static_cast<std::size_t>(first), count);
    const PositionArrays to{result.x.data() + offset, result.y.data() + offset, result.face.data() + offset};
    switch (job_.projection().kind) {
      case ProjectionKind::latlong:
        kernels_.latlong_positions(dx_.data(), dy_.data(), dz_.data(), count, job_.width(), job_.height(),
                                   to);
        return;
      case ProjectionKind::cube:
        kernels_.cube_positions(dx_.data(), dy_.data(), dz_.data(), count, job_.width(), job_.height(), to);
        return;
      case ProjectionKind::dual_paraboloid:
        kernels_.dual_paraboloid_positions(dx_.data(), dy_.data(), dz_.data(), count, job_.width(),
                                           job_.height(), to);
        return;
      default: break;
    }
    for (std::size_t i = 0; i < count; ++i) {
      const MapPoint point = point_from_direction(job_.projection(), {dx_[i], dy_[i], dz_[i]});
      const glm::dvec2 position = job_.position(point.x, point.y);
      to.x[i] = std::clamp(position.x, 0.0, static_cast<double>(job_.width()));
      to.y[i] = std::clamp(position.y, 0.0, static_cast<double>(job_.height()));
      to.face[i] = point.covered ? point.face : -1;
    }
  }

 private:
  void set_directions(int face, double y, std::size_t first, std::size_t count) {
    const Projection& target = job_.target.projection;
    const auto at = [&](double x) { return direction_from_point(target, face, x, y); };
    glm::dvec3 p(0.0);
    glm::dvec3 q(0.0);
    glm::dvec3 r(0.0);
    switch (target.kind) {
      case ProjectionKind::cube: {
        const glm::dvec3 left = at(-1.0);
        const glm::dvec3 right = at(1.0);
        // Both ends are equally far from the centre of the cube, so that their unit directions span the line.
        p = 0.5 * (left + right);
        q = 0.5 * (right - left);
        break;
      }
      case ProjectionKind::latlong: {
        const double latitude = 0.5 * std::numbers::pi * y;
        p = glm::dvec3(0.0, std::sin(latitude), 0.0);
        q = glm::dvec3(std::cos(latitude), 0.0, 0.0);
        r = glm::dvec3(0.0, 0.0, -std::cos(latitude));
        break;
      }
      case ProjectionKind::dual_paraboloid: {
        const double front = face == 0 ? 1.0 : -1.0;
        p = glm::dvec3(0.0, 2.0 * y, front * (1.0 - y * y));
        q = glm::dvec3(2.0, 0.0, 0.0);
        r = glm::dvec3(0.0, 0.0, -front);
        break;
      }
      default:
        for (std::size_t i = 0; i < count; ++i) {
          const glm::dvec3 d = job_.source_from_target * at(x_[first + i]);
          dx_[i] = d.x;
          dy_[i] = d.y;
          dz_[i] = d.z;
        }
        return;
    }
    p = job_.source_from_target * p;
    q = job_.source_from_target * q;
    r = job_.source_from_target * r;
    for (std::size_t i = 0; i < count; ++i) {
      dx_[i] = p.x + u_[first + i] * q.x + v_[first + i] * r.x;
      dy_[i] = p.y + u_[first + i] * q.y + v_[first + i] * r.y;
      dz_[i] = p.z + u_[first + i] * q.z + v_[first + i] * r.z;
    }
  }

  const ResampleJob& job_;
  const ResampleKernels& kernels_;
  std::vector<double> x_, u_, v_;
  std::vector<double> dx_, dy_, dz_;
};

/// The sides of the target's texels (one more than texels) or their centres, from −1 to 1.
std::vector<double> side_coordinates(int texels) {
  std::vector<double> x;
  for (int i = 0; i <= texels; ++i) x.push_back(2.0 * i / texels - 1.0);
  return x;
}
std::vector<double> center_coordinates(int texels) {
  std::vector<double> x;
  for (int i = 0; i < texels; ++i) x.push_back(column_center(i, texels));
  return x;
}

FaceTexels face_texels(const ResampleJob& job) {
  const EnvMapLayout& layout = job.source.layout;
  return {job.source.values.data(), layout.width, layout.height, layout.channels,
          layout.projection.kind == ProjectionKind::latlong};
}

/// Interpolates where the kernel could not, because a neighbour lies on another face.
class SeamInterpolation {
 public:
  explicit SeamInterpolation(const ResampleJob& job)
      : job_(job), point_(static_cast<std::size_t>(job.source.layout.channels)) {}

  void mix(int face, double x, double y, float share, float* result) {
    if (job_.projection().kind == ProjectionKind::latlong) {
      const double width = job_.width();
      x -= width * std::floor(x / width);
    }
    interpolate(job_.source, 0, face, x, y, point_);
    for (std::size_t c = 0; c < point_.size(); ++c) {
      const double before = share < 1.0F ? static_cast<double>((1.0F - share) * result[c]) : 0.0;
      result[c] = static_cast<float>(before + static_cast<double>(share) * point_[c]);
    }
  }

 private:
  const ResampleJob& job_;
  std::vector<double> point_;
};

struct Tile {
  int face = 0;
  int row = 0;
  int column = 0;
  int rows = 0;
  int columns = 0;
};

/// Resamples tiles with the filters `area` and `automatic`.
class TileResampler {
 public:
  TileResampler(const ResampleJob& job, EnvMap& result)
      : job_(job),
        kernels_(resample_kernels()),
        result_(result),
        lookup_(job, side_coordinates(result.layout.width)),
        irregular_(job),
        limits_(straight_limits(job.source.layout)),
        seam_(job) {}

  void write(const Tile& tile) {
    tile_ = tile;
    find_corners();
    classify();
    for (int face = 0; (all_kinds_ & kArea) && face < face_count(job_.projection()); ++face) {
      if (!select(face)) continue;
      const int channels = job_.source.layout.channels;
      const int group = channels <= 3 ? 3 : 7;
      for (int first = 0; first < channels; first += group) {
        if (!fill_window(face, first, std::min(group, channels - first))) break;
        add_areas(first, std::min(group, channels - first));
      }
    }
    if (all_kinds_ & kInterpolate) add_interpolated();
    if (all_kinds_ & kIrregular) add_irregular();
  }

 private:
  std::size_t corner(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(tile_.columns + 1) +
           static_cast<std::size_t>(column);
  }
  std::size_t texel(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(tile_.columns) +
           static_cast<std::size_t>(column);
  }
  float* result(int row, int column) const {
    return result_.values.data() +
           result_.layout.index(0, tile_.face, tile_.row + row, tile_.column + column);
  }
  glm::dvec2 target_corner(int row, int column) const {
    return {2.0 * (tile_.column + column) / result_.layout.width - 1.0,
            1.0 - 2.0 * (tile_.row + row) / result_.layout.height};
  }

  void find_corners() {
    corners_.resize(corner(tile_.rows + 1, 0));
    for (int row = 0; row <= tile_.rows; ++row) {
      lookup_.find(tile_.face, target_corner(row, 0).y, tile_.column,
                   static_cast<std::size_t>(tile_.columns) + 1, corners_, corner(row, 0));
    }
    if (job_.projection().kind != ProjectionKind::latlong) return;
    // A panorama's columns go on across its seam, so that neighbours are never half a turn apart.
    const double width = job_.width();
    const auto follow = [&](std::size_t i, std::size_t before) {
      const double step = corners_.x[i] - corners_.x[before];
      if (step > 0.5 * width || step < -0.5 * width) corners_.x[i] -= width * std::round(step / width);
    };
    for (int row = 0; row <= tile_.rows; ++row) {
      if (row > 0) follow(corner(row, 0), corner(row - 1, 0));
      for (int column = 1; column <= tile_.columns; ++column) {
        follow(corner(row, column), corner(row, column - 1));
      }
    }
  }

  PositionArrays corner_row(int row) {
    const std::size_t i = corner(row, 0);
    return {corners_.x.data() + i, corners_.y.data() + i, corners_.face.data() + i};
  }

  void classify() {
    const std::size_t columns = static_cast<std::size_t>(tile_.columns);
    kinds_.resize(texel(tile_.rows, 0));
    shares_.resize(kinds_.size());
    const ProjectionKind kind = result_.layout.projection.kind;
    const bool round = kind != ProjectionKind::cube && kind != ProjectionKind::latlong;
    all_kinds_ = 0;
    for (int row = 0; row < tile_.rows; ++row) {
      std::uint8_t* kinds = kinds_.data() + texel(row, 0);
      all_kinds_ |=
          kernels_.classify(corner_row(row), corner_row(row + 1), columns, limits_,
                            job_.filter == ResampleFilter::automatic, kinds, shares_.data() + texel(row, 0));
      for (int column = 0; round && column < tile_.columns; ++column) {
        if (disc_extent(kind, target_corner(row, column), target_corner(row + 1, column + 1)) ==
            DiscExtent::crosses_rim) {
          kinds[column] = kIrregular;
          all_kinds_ |= kIrregular;
        }
      }
    }
  }

  // The texels of a row that take area on the present face, with a texel that does not on either side, and a
  // row of such above and below the tile.
  std::uint8_t* takes(int row) {
    return takes_.data() + static_cast<std::size_t>(row + 1) * (static_cast<std::size_t>(tile_.columns) + 2) +
           1;
  }

  /// Finds those texels, and the window of the source around them. False if there are none.
  bool select(int face) {
    const std::size_t columns = static_cast<std::size_t>(tile_.columns);
    takes_.assign((static_cast<std::size_t>(tile_.rows) + 2) * (columns + 2), 0);
    flags_.resize(columns + 2);
    needed_.resize(columns + 1);
    for (int row = 0; row < tile_.rows; ++row) {
      kernels_.takes_area(kinds_.data() + texel(row, 0), corner_row(row).face, face, columns, takes(row));
    }
    constexpr double kMost = std::numeric_limits<double>::max();
    double low[2] = {kMost, kMost};
    double high[2] = {-kMost, -kMost};
    for (int line = 0; line <= tile_.rows; ++line) {
      if (!kernels_.either(takes(line - 1) - 1, takes(line) - 1, columns + 2, flags_.data())) continue;
      kernels_.either(flags_.data(), flags_.data() + 1, columns + 1, needed_.data());
      kernels_.bounds(corner_row(line).x, corner_row(line).y, needed_.data(), columns + 1, low, high);
    }
    if (low[0] > high[0]) return false;
    const int bottom = job_.height();
    window_.column = static_cast<int>(std::floor(low[0]));
    window_.columns = std::max(1, static_cast<int>(std::ceil(high[0])) - window_.column);
    window_.row = std::clamp(static_cast<int>(std::floor(low[1])), 0, bottom - 1);
    window_.rows = std::clamp(static_cast<int>(std::ceil(high[1])) - window_.row, 1, bottom - window_.row);
    return true;
  }

  /// Running sums of some channels. False if they are not finite: then the texels are left to a method in
  /// which what is NaN or infinite does not spread along its row.
  bool fill_window(int face, int first, int channels) {
    const EnvMapLayout& layout = job_.source.layout;
    window_.blocks = channels <= 3 ? 1 : 2;
    const std::size_t line =
        (static_cast<std::size_t>(window_.columns) + 2) * 4 * static_cast<std::size_t>(window_.blocks);
    running_.resize(static_cast<std::size_t>(window_.rows) * line);
    window_.running = running_.data();
    bool finite = true;
    for (int row = 0; row < window_.rows; ++row) {
      const int from = window_.row + row;
      finite &= kernels_.running_sums(job_.source.values.data() + layout.index(0, face, from, 0),
                                      &job_.weight(from, 0), job_.weights_by_row ? 0 : 1, layout.width,
                                      window_, first, channels, layout.channels,
                                      running_.data() + static_cast<std::size_t>(row) * line);
    }
    if (finite) return true;
    for (int row = 0; row < tile_.rows; ++row) {
      for (int column = 0; column < tile_.columns; ++column) {
        if (takes(row)[column]) kinds_[texel(row, column)] = kIrregular;
      }
    }
    all_kinds_ |= kIrregular;
    return false;
  }

  void add_areas(int first, int channels) {
    const std::size_t columns = static_cast<std::size_t>(tile_.columns);
    const std::size_t sums = 4 * static_cast<std::size_t>(window_.blocks);
    for (std::vector<double>* edges : {&above_, &below_}) edges->resize(columns * sums);
    verticals_.resize((columns + 1) * sums);
    for (int line = 0; line <= tile_.rows; ++line) {
      std::swap(above_, below_);
      if (kernels_.either(takes(line - 1), takes(line), columns, needed_.data())) {
        integrate_edges(corner(line, 0), corner(line, 1), columns, below_);
      }
      const int row = line - 1;
      if (!kernels_.either(takes(row) - 1, takes(row), columns + 1, needed_.data())) continue;
      integrate_edges(corner(row, 0), corner(row + 1, 0), columns + 1, verticals_);
      kernels_.means_from_edges(above_.data(), below_.data(), verticals_.data(), takes(row), columns,
                                window_.blocks, channels, job_.source.layout.channels,
                                result(row, 0) + first);
    }
  }

  void integrate_edges(std::size_t from, std::size_t to, std::size_t count, std::vector<double>& integrals) {
    kernels_.edge_integrals(window_, corners_.x.data() + from, corners_.y.data() + from,
                            corners_.x.data() + to, corners_.y.data() + to, needed_.data(), count,
                            integrals.data());
  }

  /// At the mean of a texel's corners, which deviates from its centre by a fraction of how it bends.
  void add_interpolated() {
    const std::size_t columns = static_cast<std::size_t>(tile_.columns);
    centers_.resize(columns);
    for (int row = 0; row < tile_.rows; ++row) {
      const std::uint8_t* kinds = kinds_.data() + texel(row, 0);
      if (std::none_of(kinds, kinds + columns, [](std::uint8_t kind) { return kind & kInterpolate; }))
        continue;
      kernels_.centers(corner_row(row), corner_row(row + 1), columns,
                       {centers_.x.data(), centers_.y.data(), centers_.face.data()});
      missed_.assign(columns, 0);
      kernels_.interpolate(face_texels(job_), centers_.x.data(), centers_.y.data(), centers_.face.data(),
                           kinds, shares_.data() + texel(row, 0), columns, result(row, 0), missed_.data());
      for (std::size_t i = 0; i < columns; ++i) {
        if (!missed_[i]) continue;
        seam_.mix(centers_.face[i], centers_.x[i], centers_.y[i], shares_[texel(row, 0) + i],
                  result(row, static_cast<int>(i)));
      }
    }
  }

  void add_irregular() {
    for (int row = 0; row < tile_.rows; ++row) {
      for (int column = 0; column < tile_.columns; ++column) {
        if (kinds_[texel(row, column)] != kIrregular) continue;
        irregular_.write(tile_.face, target_corner(row, column), target_corner(row + 1, column + 1),
                         result(row, column));
      }
    }
  }

  const ResampleJob& job_;
  const ResampleKernels& kernels_;
  EnvMap& result_;
  LineLookup lookup_;
  IrregularTexels irregular_;
  const StraightLimits limits_;
  SeamInterpolation seam_;
  Tile tile_;
  std::uint8_t all_kinds_ = 0;  // union of kinds_
  Positions corners_;
  Positions centers_;
  std::vector<std::uint8_t> kinds_, takes_, flags_, needed_, missed_;
  std::vector<float> shares_;
  FluxWindow window_;
  std::vector<double> running_, above_, below_, verticals_;
};

void resample_areas(const ResampleJob& job, EnvMap& result) {
  const EnvMapLayout& to = result.layout;
  // Tiles that read some 100² texels of the source, as far as these are spread evenly.
  const double ratio = std::sqrt(static_cast<double>(job.source.layout.level_texels(0)) /
                                 static_cast<double>(to.level_texels(0)));
  const int side = static_cast<int>(std::clamp(64.0 / ratio, 1.0, 48.0));
  const int across = (to.width + side - 1) / side;
  const int down = (to.height + side - 1) / side;
  const std::size_t tiles = static_cast<std::size_t>(face_count(to.projection)) *
                            static_cast<std::size_t>(down) * static_cast<std::size_t>(across);
  parallel_for(tiles, (tiles + 31) / 32, [&](std::size_t begin, std::size_t end) {
    TileResampler resampler(job, result);
    for (std::size_t i = begin; i < end; ++i) {
      const int number = static_cast<int>(i);
      Tile tile;
      tile.face = number / (down * across);
      tile.row = number / across % down * side;
      tile.column = number % across * side;
      tile.rows = std::min(side, to.height - tile.row);
      tile.columns = std::min(side, to.width - tile.column);
      resampler.write(tile);
    }
  });
}

void resample_centers(const ResampleJob& job, EnvMap& result) {
  const EnvMapLayout& to = result.layout;
  const ResampleKernels& kernels = resample_kernels();
  const std::size_t columns = static_cast<std::size_t>(to.width);
  const std::size_t lines =
      static_cast<std::size_t>(face_count(to.projection)) * static_cast<std::size_t>(to.height);
  parallel_for(lines, 8, [&](std::size_t begin, std::size_t end) {
    LineLookup lookup(job, center_coordinates(to.width));
    SeamInterpolation seam(job);
    Positions centers;
    centers.resize(columns);
    std::vector<std::uint8_t> kinds(columns), missed(columns);
    const std::vector<float> shares(columns, 1.0F);
    for (std::size_t line = begin; line < end; ++line) {
      const int face = static_cast<int>(line) / to.height;
      const int row = static_cast<int>(line) % to.height;
      lookup.find(face, row_center(row, to.height), 0, columns, centers, 0);
      float* values = result.values.data() + to.index(0, face, row, 0);
      if (job.filter == ResampleFilter::nearest) {
        for (std::size_t i = 0; i < columns; ++i) {
          if (centers.face[i] < 0) continue;
          const int from_column = std::clamp(static_cast<int>(centers.x[i]), 0, job.width() - 1);
          const int from_row = std::clamp(static_cast<int>(centers.y[i]), 0, job.height() - 1);
          std::copy_n(
              job.source.values.data() + job.source.layout.index(0, centers.face[i], from_row, from_column),
              to.channels, values + i * static_cast<std::size_t>(to.channels));
        }
        continue;
      }
      for (std::size_t i = 0; i < columns; ++i) kinds[i] = centers.face[i] < 0 ? kLeave : kInterpolate;
      std::fill(missed.begin(), missed.end(), std::uint8_t{0});
      kernels.interpolate(face_texels(job), centers.x.data(), centers.y.data(), centers.face.data(),
                          kinds.data(), shares.data(), columns, values, missed.data());
      for (std::size_t i = 0; i < columns; ++i) {
        if (missed[i]) {
          seam.mix(centers.face[i], centers.x[i], centers.y[i], 1.0F,
                   values + i * static_cast<std::size_t>(to.channels));
        }
      }
    }
  });
}

// Solid angles of the texels of the source as if the rim did not cut them: it cuts the images of the target's
// texels. Where texels are many and small, the density in their centre will do.
void set_weights(ResampleJob& job) {
  const Projection& projection = job.projection();
  const int width = job.width();
  const int height = job.height();
  if (projection.kind == ProjectionKind::latlong) {
    job.weights_by_row = true;
    for (int row = 0; row < height; ++row) {
      job.weights.push_back(texel_solid_angle(projection, width, height, 0, row));
    }
    return;
  }
  if (projection.kind == ProjectionKind::cube && width <= 64) {
    job.weights = texel_solid_angles(projection, width, height);
    return;
  }
  const std::size_t columns = static_cast<std::size_t>(width);
  job.weights.resize(columns * static_cast<std::size_t>(height));
  const double area = 4.0 / (static_cast<double>(width) * height);
  parallel_for(static_cast<std::size_t>(height), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      const double y = row_center(static_cast<int>(row), height);
      for (int column = 0; column < width; ++column) {
        const double x = column_center(column, width);
        const double r2 = x * x + y * y;
        double density = 4.0;  // of a sphere map
        if (projection.kind == ProjectionKind::cube) {
          density = 1.0 / ((1.0 + r2) * std::sqrt(1.0 + r2));
        } else if (projection.kind != ProjectionKind::sphere_map) {
          density = solid_angle_density(projection, 0, x, y);
        }
        job.weights[row * columns + static_cast<std::size_t>(column)] = area * density;
      }
    }
  });
}

void check_orthonormal(const glm::mat3& m) {
  const glm::mat3 product = m * glm::transpose(m);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (!(std::abs(product[i][j] - (i == j ? 1.0F : 0.0F)) <= 1e-4F)) {
        throw InvalidArgument("source_from_target", "not orthonormal", "a rotation or reflection");
      }
    }
  }
}

}  // namespace

ResampleFilter parse_resample_filter(std::string_view name) {
  if (name == "automatic") return ResampleFilter::automatic;
  if (name == "area") return ResampleFilter::area;
  if (name == "bilinear") return ResampleFilter::bilinear;
  if (name == "nearest") return ResampleFilter::nearest;
  throw InvalidArgument("filter", name, "automatic, area, bilinear or nearest");
}

EnvMap resample(const EnvMapView& source, const Projection& target, int width, int height,
                const ResampleOptions& options) {
  validate(source);
  check_orthonormal(options.source_from_target);
  EnvMap result = make_envmap({target, width, height, 1, source.layout.channels}, source.channels);
  ResampleJob job{source, result.layout, options.filter, glm::dmat3(options.source_from_target), {}, false};
  if (options.filter == ResampleFilter::automatic || options.filter == ResampleFilter::area) {
    set_weights(job);
    resample_areas(job, result);
  } else {
    resample_centers(job, result);
  }
  return result;
}

}  // namespace mirrorbake
