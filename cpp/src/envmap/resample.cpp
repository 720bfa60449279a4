#include "mirrorbake/envmap/resample.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "coverage.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/envmap/texel_lookup.hpp"

namespace mirrorbake {
namespace {

using Quad = std::array<glm::dvec2, 4>;

// A corner of target texels: its direction in the frame of the source, and where that lies in the source, in texels
// from the top left corner of a face.
struct Corner {
  glm::dvec3 direction{0.0};
  int face = 0;
  glm::dvec2 position{0.0};
};

// What all texels share.
struct Job {
  const EnvMapView& source;
  const EnvMapLayout& target;
  ResampleFilter filter;
  glm::dmat3 source_from_target;
  std::vector<double> solid_angles;  // of the source's texels

  int width() const { return source.layout.width; }
  int height() const { return source.layout.height; }
  const Projection& projection() const { return source.layout.projection; }

  glm::dvec2 position(double x, double y) const {
    return {0.5 * (x + 1.0) * width(), 0.5 * (1.0 - y) * height()};
  }
  glm::dvec3 direction(int face, double x, double y) const {
    return source_from_target * direction_from_point(target.projection, face, x, y);
  }
  Corner corner(int face, double x, double y) const {
    const glm::dvec3 d = direction(face, x, y);
    const MapPoint point = point_from_direction(projection(), d);
    if (!point.covered) {
      // Beyond a fisheye's field of view: where the projection goes on, not on the rim.
      if (const auto beyond = point_on_face(projection(), 0, d))
        return {d, 0, position(beyond->x, beyond->y)};
    }
    return {d, point.face, position(point.x, point.y)};
  }
};

// Sum of what was gathered for one target texel.
struct Gathered {
  std::vector<double> radiance;  // times solid angle
  double solid_angle = 0.0;

  explicit Gathered(std::size_t channels) : radiance(channels) {}
  void clear() {
    std::fill(radiance.begin(), radiance.end(), 0.0);
    solid_angle = 0.0;
  }
  void add(const float* values, double weight) {
    solid_angle += weight;
    for (std::size_t c = 0; c < radiance.size(); ++c) radiance[c] += weight * static_cast<double>(values[c]);
  }
};

class TexelGatherer {
 public:
  explicit TexelGatherer(const Job& job)
      : job_(job),
        area_(static_cast<std::size_t>(job.source.layout.channels)),
        sample_(area_.radiance.size()) {}

  // Writes the texel of `face` that spans the given rectangle of the target and has these corners.
  void write(int face, glm::dvec2 low, glm::dvec2 high, const std::array<Corner, 4>& corners, float* result) {
    if (job_.filter == ResampleFilter::nearest || job_.filter == ResampleFilter::bilinear) {
      const Corner center = job_.corner(face, 0.5 * (low.x + high.x), 0.5 * (low.y + high.y));
      std::fill(sample_.begin(), sample_.end(), 0.0);
      if (covered(center)) sample_at(center);
      for (std::size_t c = 0; c < sample_.size(); ++c) result[c] = static_cast<float>(sample_[c]);
      return;
    }
    const std::optional<Quad> quad = regular_quad(corners);
    double smooth = 0.0;
    if (quad && job_.filter == ResampleFilter::automatic) {
      const double texels = std::sqrt(std::abs(signed_area(*quad)));
      smooth = std::clamp(2.0 - 2.0 * texels, 0.0, 1.0);
    }
    std::fill(sample_.begin(), sample_.end(), 0.0);
    if (smooth > 0.0) add_interpolated(corners, *quad, smooth);
    if (smooth < 1.0) {
      area_.clear();
      clipped_ = extent(low, high) == Extent::crosses_rim;
      gather(face, low, high, corners, 0);
      if (area_.solid_angle > 0.0) {
        const double scale = (1.0 - smooth) / area_.solid_angle;
        for (std::size_t c = 0; c < sample_.size(); ++c) sample_[c] += scale * area_.radiance[c];
      } else {
        // A texel without area, such as one beyond the rim of a sphere map, which is all one direction.
        const Corner center = job_.corner(face, 0.5 * (low.x + high.x), 0.5 * (low.y + high.y));
        if (covered(center)) add_texel(center, 1.0 - smooth);
      }
    }
    for (std::size_t c = 0; c < sample_.size(); ++c) result[c] = static_cast<float>(sample_[c]);
  }

 private:
  static constexpr int kDeepest = 6;

  bool covered(const Corner& corner) const {
    return point_from_direction(job_.projection(), corner.direction).covered;
  }

  void sample_at(const Corner& corner) {
    if (job_.filter == ResampleFilter::bilinear) {
      interpolate(job_.source, 0, corner.face, corner.position.x, corner.position.y, sample_);
      return;
    }
    add_texel(corner, 1.0);
  }

  void add_texel(const Corner& corner, double scale) {
    const float* values = texel(corner);
    for (std::size_t c = 0; c < sample_.size(); ++c) sample_[c] += scale * static_cast<double>(values[c]);
  }

  // Where a rectangle of the target lies: of a texel that the rim of a round map crosses only the inner part counts.
  enum class Extent { inside, crosses_rim, outside };
  Extent extent(glm::dvec2 low, glm::dvec2 high) const {
    const ProjectionKind kind = job_.target.projection.kind;
    if (kind == ProjectionKind::cube || kind == ProjectionKind::latlong) return Extent::inside;
    const glm::dvec2 a = glm::min(low, high);
    const glm::dvec2 b = glm::max(low, high);
    const glm::dvec2 nearest = glm::clamp(glm::dvec2(0.0), a, b);
    const glm::dvec2 farthest = glm::max(glm::abs(a), glm::abs(b));
    if (glm::dot(farthest, farthest) <= 1.0) return Extent::inside;
    return glm::dot(nearest, nearest) >= 1.0 ? Extent::outside : Extent::crosses_rim;
  }

  const float* texel(const Corner& corner) const {
    const int column = std::clamp(static_cast<int>(corner.position.x), 0, job_.width() - 1);
    const int row = std::clamp(static_cast<int>(corner.position.y), 0, job_.height() - 1);
    return job_.source.values.data() + job_.source.layout.index(0, corner.face, row, column);
  }

  // The texel as a quadrilateral in the plane of the source face of its first corner; nothing if it is not close to a
  // quadrilateral there: around a pole or a singularity, or when it is large.
  std::optional<Quad> regular_quad(const std::array<Corner, 4>& corners) const {
    Quad quad;
    for (std::size_t i = 0; i < 4; ++i) {
      if (corners[i].face == corners[0].face) {
        quad[i] = corners[i].position;
      } else {
        const std::optional<glm::dvec2> point =
            point_on_face(job_.projection(), corners[0].face, corners[i].direction);
        if (!point) return std::nullopt;
        quad[i] = job_.position(point->x, point->y);
      }
    }
    return straighten(quad) ? std::optional<Quad>(quad) : std::nullopt;
  }

  // Undoes the jump at the seam of a panorama, then judges: the edges of the image of a square texel bend about as much
  // as it deviates from a parallelogram.
  bool straighten(Quad& quad) const {
    if (job_.projection().kind == ProjectionKind::latlong) {
      for (glm::dvec2& p : quad) {
        if (p.x - quad[0].x > 0.5 * job_.width()) p.x -= job_.width();
        if (p.x - quad[0].x < -0.5 * job_.width()) p.x += job_.width();
      }
    }
    const glm::dvec2 bend = quad[0] + quad[2] - quad[1] - quad[3];
    const double longest =
        std::max(std::max(std::abs(quad[2].x - quad[0].x), std::abs(quad[2].y - quad[0].y)),
                 std::max(std::abs(quad[3].x - quad[1].x), std::abs(quad[3].y - quad[1].y)));
    return std::abs(bend.x) + std::abs(bend.y) < std::max(0.1, 0.01 * longest) &&
           longest < 0.25 * (job_.width() + 4);
  }

  void gather(int face, glm::dvec2 low, glm::dvec2 high, const std::array<Corner, 4>& corners, int depth) {
    const Extent place = clipped_ ? extent(low, high) : Extent::inside;
    if (place == Extent::outside) return;
    // Faces of the source that the corners lie on; a face that only the inside of the texel touches is a sliver.
    std::array<int, 4> faces{};
    std::size_t count = 0;
    for (const Corner& corner : corners) {
      if (std::find(faces.begin(), faces.begin() + static_cast<std::ptrdiff_t>(count), corner.face) ==
          faces.begin() + static_cast<std::ptrdiff_t>(count)) {
        faces[count++] = corner.face;
      }
    }
    std::array<Quad, 4> quads;
    bool regular = place == Extent::inside;
    for (std::size_t f = 0; f < count && regular; ++f) {
      std::array<Corner, 4> seen = corners;
      // The face under consideration comes first, the order around the texel stays.
      while (seen[0].face != faces[f]) std::rotate(seen.begin(), seen.begin() + 1, seen.end());
      const std::optional<Quad> quad = regular_quad(seen);
      regular = quad.has_value();
      if (regular) quads[f] = *quad;
    }
    if (regular) {
      for (std::size_t f = 0; f < count; ++f) gather_quad(faces[f], quads[f]);
      return;
    }
    const glm::dvec2 middle = 0.5 * (low + high);
    if (depth == kDeepest) {
      const Corner center = job_.corner(face, middle.x, middle.y);
      if (!covered(center) || (clipped_ && glm::dot(middle, middle) > 1.0)) return;
      const double density = solid_angle_density(job_.target.projection, face, middle.x, middle.y);
      area_.add(texel(center), density * std::abs((high.x - low.x) * (high.y - low.y)));
      return;
    }
    for (int i = 0; i < 4; ++i) {
      const glm::dvec2 from(i % 2 ? middle.x : low.x, i / 2 ? middle.y : low.y);
      const glm::dvec2 to(i % 2 ? high.x : middle.x, i / 2 ? high.y : middle.y);
      gather(face, from, to,
             {job_.corner(face, from.x, from.y), job_.corner(face, to.x, from.y),
              job_.corner(face, to.x, to.y), job_.corner(face, from.x, to.y)},
             depth + 1);
    }
  }

  void gather_quad(int face, const Quad& quad) {
    const EnvMapLayout& layout = job_.source.layout;
    const bool wraps = layout.projection.kind == ProjectionKind::latlong;
    const float* first = job_.source.values.data() + layout.index(0, face, 0, 0);
    coverage_.rasterize(quad);
    coverage_.for_each_pixel([&](int column, int row, double area) {
      if (row < 0 || row >= layout.height) return;
      if (wraps) {
        if (column < 0) column += layout.width;
        if (column >= layout.width) column -= layout.width;
      }
      if (column < 0 || column >= layout.width) return;
      const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(layout.width) +
                            static_cast<std::size_t>(column);
      const double weight = area * job_.solid_angles[i];
      if (weight > 0.0) area_.add(first + i * area_.radiance.size(), weight);
    });
  }

  // Mean of interpolated values over the texel, in four places or, if it is much smaller than a texel of the source,
  // in one.
  void add_interpolated(const std::array<Corner, 4>& corners, const Quad& quad, double scale) {
    point_.resize(sample_.size());
    const bool one = scale >= 1.0;
    const double offset = one ? 0.5 : 0.25;
    const int places = one ? 1 : 4;
    for (int i = 0; i < places; ++i) {
      const double u = i % 2 ? 1.0 - offset : offset;
      const double v = i / 2 ? 1.0 - offset : offset;
      const glm::dvec2 p =
          (1 - v) * ((1 - u) * quad[0] + u * quad[1]) + v * ((1 - u) * quad[3] + u * quad[2]);
      const bool on_face = p.x > 0.0 && p.y > 0.0 && p.x < job_.width() && p.y < job_.height();
      if (on_face && job_.projection().kind != ProjectionKind::fisheye) {
        interpolate(job_.source, 0, corners[0].face, p.x, p.y, point_);
      } else {
        // Maybe beyond the face: the same direction on the face that it belongs to, if any.
        const glm::dvec3 d = (1 - v) * ((1 - u) * corners[0].direction + u * corners[1].direction) +
                             v * ((1 - u) * corners[3].direction + u * corners[2].direction);
        const MapPoint point = point_from_direction(job_.projection(), d);
        if (!point.covered) continue;
        const glm::dvec2 q = job_.position(point.x, point.y);
        interpolate(job_.source, 0, point.face, q.x, q.y, point_);
      }
      for (std::size_t c = 0; c < sample_.size(); ++c) sample_[c] += scale / places * point_[c];
    }
  }

  const Job& job_;
  Coverage coverage_;
  Gathered area_;
  bool clipped_ = false;
  std::vector<double> sample_;
  std::vector<double> point_;
};

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
  Job job{source, result.layout, options.filter, glm::dmat3(options.source_from_target), {}};
  if (options.filter == ResampleFilter::automatic || options.filter == ResampleFilter::area) {
    job.solid_angles =
        texel_solid_angles(source.layout.projection, source.layout.width, source.layout.height);
  }

  constexpr std::size_t kRows = 8;
  const std::size_t lines = static_cast<std::size_t>(face_count(target)) * static_cast<std::size_t>(height);
  const auto corner_line = [&](int face, int row, std::vector<Corner>& corners) {
    for (int column = 0; column <= width; ++column) {
      corners[static_cast<std::size_t>(column)] =
          job.corner(face, 2.0 * column / width - 1.0, 1.0 - 2.0 * row / height);
    }
  };
  parallel_for(lines, kRows, [&](std::size_t begin, std::size_t end) {
    TexelGatherer gatherer(job);
    std::vector<Corner> above(static_cast<std::size_t>(width) + 1);
    std::vector<Corner> below(above.size());
    for (std::size_t line = begin; line < end; ++line) {
      const int face = static_cast<int>(line / static_cast<std::size_t>(height));
      const int row = static_cast<int>(line % static_cast<std::size_t>(height));
      if (line == begin || row == 0) {
        corner_line(face, row, above);
      } else {
        std::swap(above, below);
      }
      corner_line(face, row + 1, below);
      for (int column = 0; column < width; ++column) {
        const std::size_t i = static_cast<std::size_t>(column);
        const glm::dvec2 low(2.0 * column / width - 1.0, 1.0 - 2.0 * row / height);
        const glm::dvec2 high(2.0 * (column + 1) / width - 1.0, 1.0 - 2.0 * (row + 1) / height);
        gatherer.write(face, low, high, {above[i], above[i + 1], below[i + 1], below[i]},
                       result.values.data() + result.layout.index(0, face, row, column));
      }
    }
  });
  return result;
}

}  // namespace mirrorbake
