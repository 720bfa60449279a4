#include "irregular_texels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/envmap/texel_lookup.hpp"

namespace mirrorbake {

namespace {

double cross(glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; }

}  // namespace

StraightLimits straight_limits(const EnvMapLayout& source) {
  const double length = 0.25 * (source.width + 4);
  constexpr double kAny = std::numeric_limits<double>::max();
  switch (source.projection.kind) {
    // Around the poles of a panorama images are long and bent along their length: n texels of the target away
    // from one straight edges shift 1/(12 n) of the area.
    case ProjectionKind::latlong: return {0.1, kAny, length};
    case ProjectionKind::cube:
    case ProjectionKind::dual_paraboloid: return {0.01, kAny, length};
    // Along a rim that is a single direction they are slivers, which a small bend empties.
    case ProjectionKind::sphere_map:
    case ProjectionKind::angular:
    case ProjectionKind::fisheye: break;
  }
  return {0.01, 0.2, length};
}

bool is_straight(const Quad& quad, const StraightLimits& limits) {
  const glm::dvec2 bend = quad[0] + quad[2] - quad[1] - quad[3];
  const glm::dvec2 p = quad[2] - quad[0];
  const glm::dvec2 q = quad[3] - quad[1];
  const double longest =
      std::max(std::max(std::abs(p.x), std::abs(p.y)), std::max(std::abs(q.x), std::abs(q.y)));
  return longest < limits.length &&
         std::abs(bend.x) + std::abs(bend.y) < std::max(kStraightBend, limits.per_length * longest) &&
         std::abs(cross(bend, p)) + std::abs(cross(bend, q)) <= limits.shift * std::abs(cross(p, q));
}

double interpolated_share(double side) { return std::clamp(4.0 - 4.0 * side, 0.0, 1.0); }

DiscExtent disc_extent(ProjectionKind kind, glm::dvec2 low, glm::dvec2 high) {
  if (kind == ProjectionKind::cube || kind == ProjectionKind::latlong) return DiscExtent::inside;
  const glm::dvec2 a = glm::min(low, high);
  const glm::dvec2 b = glm::max(low, high);
  const glm::dvec2 nearest = glm::clamp(glm::dvec2(0.0), a, b);
  const glm::dvec2 farthest = glm::max(glm::abs(a), glm::abs(b));
  if (glm::dot(farthest, farthest) <= 1.0) return DiscExtent::inside;
  return glm::dot(nearest, nearest) >= 1.0 ? DiscExtent::outside : DiscExtent::crosses_rim;
}

IrregularTexels::IrregularTexels(const ResampleJob& job)
    : job_(job),
      limits_(straight_limits(job.source.layout)),
      limits_of_parts_(limits_),
      radiance_(static_cast<std::size_t>(job.source.layout.channels)),
      sample_(radiance_.size()),
      point_(radiance_.size()) {
  limits_of_parts_.per_length *= 1.5;
}

IrregularTexels::Corner IrregularTexels::corner(int face, double x, double y) const {
  const glm::dvec3 d = job_.direction(face, x, y);
  const MapPoint point = point_from_direction(job_.projection(), d);
  if (!point.covered) {
    // Beyond a fisheye's field of view: where the projection goes on, not on the rim.
    if (const auto beyond = point_on_face(job_.projection(), 0, d))
      return {d, 0, job_.position(beyond->x, beyond->y)};
  }
  return {d, point.face, job_.position(point.x, point.y)};
}

IrregularTexels::Corners IrregularTexels::corners(int face, glm::dvec2 low, glm::dvec2 high) const {
  return {corner(face, low.x, low.y), corner(face, high.x, low.y), corner(face, high.x, high.y),
          corner(face, low.x, high.y)};
}

bool IrregularTexels::covered(const Corner& corner) const {
  return point_from_direction(job_.projection(), corner.direction).covered;
}

const float* IrregularTexels::texel(const Corner& corner) const {
  const int column = std::clamp(static_cast<int>(corner.position.x), 0, job_.width() - 1);
  const int row = std::clamp(static_cast<int>(corner.position.y), 0, job_.height() - 1);
  return job_.source.values.data() + job_.source.layout.index(0, corner.face, row, column);
}

void IrregularTexels::add(const float* values, double weight) {
  solid_angle_ += weight;
  for (std::size_t c = 0; c < radiance_.size(); ++c) radiance_[c] += weight * static_cast<double>(values[c]);
}

// The texel as a quadrilateral in the plane of the source face of its first corner; nothing if it is not
// close to one.
std::optional<Quad> IrregularTexels::regular_quad(const Corners& corners, int depth) const {
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
  if (job_.projection().kind == ProjectionKind::latlong) {
    for (glm::dvec2& p : quad) {
      if (p.x - quad[0].x > 0.5 * job_.width()) p.x -= job_.width();
      if (p.x - quad[0].x < -0.5 * job_.width()) p.x += job_.width();
    }
  }
  return is_straight(quad, depth == 0 ? limits_ : limits_of_parts_) ? std::optional<Quad>(quad)
                                                                    : std::nullopt;
}

void IrregularTexels::write(int face, glm::dvec2 low, glm::dvec2 high, float* result) {
  std::fill(sample_.begin(), sample_.end(), 0.0);
  const Corners around = corners(face, low, high);
  const glm::dvec2 middle = 0.5 * (low + high);
  double share = 0.0;
  if (job_.filter == ResampleFilter::automatic) share = interpolated_share(texels_across(face, low, high));
  if (share < 1.0) {
    std::fill(radiance_.begin(), radiance_.end(), 0.0);
    solid_angle_ = 0.0;
    clipped_ = disc_extent(job_.target.projection.kind, low, high) == DiscExtent::crosses_rim;
    gather(face, low, high, around, 0);
    if (solid_angle_ > 0.0) {
      for (std::size_t c = 0; c < sample_.size(); ++c) {
        sample_[c] = (1.0 - share) / solid_angle_ * radiance_[c];
      }
    } else {
      // A texel without area, such as one beyond the rim of a sphere map, which is all one direction.
      const Corner center = corner(face, middle.x, middle.y);
      if (covered(center)) {
        const float* values = texel(center);
        for (std::size_t c = 0; c < sample_.size(); ++c) {
          sample_[c] = (1.0 - share) * static_cast<double>(values[c]);
        }
      }
    }
  }
  if (share > 0.0) {
    const Corner center = corner(face, middle.x, middle.y);
    if (covered(center)) {
      interpolate(job_.source, 0, center.face, center.position.x, center.position.y, point_);
      for (std::size_t c = 0; c < sample_.size(); ++c) sample_[c] += share * point_[c];
    }
  }
  for (std::size_t c = 0; c < sample_.size(); ++c) result[c] = static_cast<float>(sample_[c]);
}

// The length of a texel over that of the source's there, the longer one of the latter.
double IrregularTexels::texels_across(int face, glm::dvec2 low, glm::dvec2 high) const {
  const glm::dvec2 middle = 0.5 * (low + high);
  const double area = std::abs((high.x - low.x) * (high.y - low.y));
  const double length =
      std::sqrt(area * solid_angle_density(job_.target.projection, face, middle.x, middle.y));
  const MapPoint at = point_from_direction(job_.projection(), job_.direction(face, middle.x, middle.y));
  const MapJacobian jacobian = map_jacobian(job_.projection(), at.face, at.x, at.y);
  const double source =
      std::max(2.0 / job_.width() * glm::length(jacobian.dx), 2.0 / job_.height() * glm::length(jacobian.dy));
  return source > 0.0 ? length / source : 1.0;
}

void IrregularTexels::gather(int face, glm::dvec2 low, glm::dvec2 high, const Corners& corners, int depth) {
  const DiscExtent place =
      clipped_ ? disc_extent(job_.target.projection.kind, low, high) : DiscExtent::inside;
  if (place == DiscExtent::outside) return;
  // Faces of the source that the corners lie on; a face that only the inside of the texel touches is a
  // sliver.
  std::array<int, 4> faces{};
  std::size_t count = 0;
  for (const Corner& corner : corners) {
    const auto end = faces.begin() + static_cast<std::ptrdiff_t>(count);
    if (std::find(faces.begin(), end, corner.face) == end) faces[count++] = corner.face;
  }
  std::array<Quad, 4> quads;
  bool regular = place == DiscExtent::inside;
  for (std::size_t f = 0; f < count && regular; ++f) {
    Corners seen = corners;
    // The face under consideration comes first, the order around the texel stays.
    while (seen[0].face != faces[f]) std::rotate(seen.begin(), seen.begin() + 1, seen.end());
    const std::optional<Quad> quad = regular_quad(seen, depth);
    regular = quad.has_value();
    if (regular) quads[f] = *quad;
  }
  if (regular) {
    for (std::size_t f = 0; f < count; ++f) gather_quad(faces[f], quads[f]);
    return;
  }
  const glm::dvec2 middle = 0.5 * (low + high);
  if (depth == (place == DiscExtent::crosses_rim ? kDeepestOnRim : kDeepest)) {
    const Corner center = corner(face, middle.x, middle.y);
    if (!covered(center) || (clipped_ && glm::dot(middle, middle) > 1.0)) return;
    const double density = solid_angle_density(job_.target.projection, face, middle.x, middle.y);
    add(texel(center), density * std::abs((high.x - low.x) * (high.y - low.y)));
    return;
  }
  // The corners of the four parts, row by row; the outer ones are known.
  const Corner center = corner(face, middle.x, middle.y);
  const Corner top = corner(face, middle.x, low.y);
  const Corner right = corner(face, high.x, middle.y);
  const Corner bottom = corner(face, middle.x, high.y);
  const Corner left = corner(face, low.x, middle.y);
  gather(face, low, middle, {corners[0], top, center, left}, depth + 1);
  gather(face, {middle.x, low.y}, {high.x, middle.y}, {top, corners[1], right, center}, depth + 1);
  gather(face, {low.x, middle.y}, {middle.x, high.y}, {left, center, bottom, corners[3]}, depth + 1);
  gather(face, middle, high, {center, right, corners[2], bottom}, depth + 1);
}

void IrregularTexels::gather_quad(int face, const Quad& quad) {
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
    const double weight = area * job_.weight(row, column);
    if (weight > 0.0) add(first + i * radiance_.size(), weight);
  });
}

}  // namespace mirrorbake
