#include "straight_texels.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/projection/traits.hpp"

namespace mirrorbake {
namespace {

// Parts of larger texels are rasterised one by one.
constexpr double kLongest = 256.0;

// In texels of the source: of 0.1 rad where texels are largest.
double longest_part(const EnvMapLayout& source) {
  const double width = 0.5 * source.width / traits(source.projection.kind).largest_texel(source.projection).x;
  return std::min(0.1 * width, kLongest);
}

}  // namespace

double length_of(const Quad& quad) {
  const glm::dvec2 p = glm::abs(quad[2] - quad[0]);
  const glm::dvec2 q = glm::abs(quad[3] - quad[1]);
  return std::max(std::max(p.x, p.y), std::max(q.x, q.y));
}

StraightLimits straight_limits(const EnvMapLayout& source, const EnvMapLayout& target) {
  // Edges of texels of some 0.035 rad bend by half a hundredth of their length, but more near a singular rim.
  const ProjectionTraits& from = traits(source.projection.kind);
  const Rim rim = traits(target.projection.kind).rim;
  const std::size_t few_texels = rim == Rim::singular ? 60'000 : rim == Rim::direction ? 15'000 : 10'000;
  const double length =
      target.level_texels(0) < few_texels ? 0.0 : std::min(0.25 * (source.width + 4), kLongest);
  constexpr double kAny = std::numeric_limits<double>::max();
  // Around the poles of a panorama images are long and bent along their length. Straight edges n texels of
  // the target away from one shift 1/(12 n) of the area, which is lost or counted twice beside a texel that
  // is traced. Towards the rim of a sphere map all images are so.
  if (from.shape == FaceShape::panorama) return {rim == Rim::singular ? 0.03 : 0.1, kAny, length};
  // Along a rim that is a single direction, or the last one, images are slivers, which a small bend empties.
  const bool slivers = from.rim != Rim::none && from.rim != Rim::neighbour;
  return {0.01, slivers ? 0.2 : kAny, length};
}

StraightLimits limits_of_parts(const EnvMapLayout& source, const StraightLimits& limits) {
  StraightLimits parts = limits;
  parts.per_length *= 1.5;
  parts.length = longest_part(source);
  return parts;
}

bool is_straight(const Quad& quad, const StraightLimits& limits) {
  const glm::dvec2 bend = quad[0] + quad[2] - quad[1] - quad[3];
  const glm::dvec2 p = quad[2] - quad[0];
  const glm::dvec2 q = quad[3] - quad[1];
  const double longest = length_of(quad);
  return longest < limits.length &&
         std::abs(bend.x) + std::abs(bend.y) < std::max(kStraightBend, limits.per_length * longest) &&
         std::abs(cross(bend, p)) + std::abs(cross(bend, q)) <= limits.shift * std::abs(cross(p, q));
}

double texel_side(double area, double squares) {
  const double long_share = std::clamp(2.5 * squares / std::max(area, 1e-30) - 6.25, 0.0, 1.0);
  const double wide2 = area * area * squares / std::max(squares * squares - area * area, 1e-30);
  return std::sqrt(area + long_share * (wide2 - area));
}

double interpolated_share(double side) {
  const double share = std::clamp(4.0 - 4.0 * side, 0.0, 1.0);
  return share * share * (3.0 - 2.0 * share);
}

double interpolable(const EnvMapLayout& sphere_map, glm::dvec2 position) {
  // Over a quarter of the radius, but no less than sixteen texels: the smoother, the less flux it moves.
  const double radius = 0.5 * sphere_map.width;
  const double from_rim = radius - 1.0 - glm::length(position - radius);
  const double t = std::clamp(from_rim / std::max(16.0, 0.25 * radius), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace mirrorbake
