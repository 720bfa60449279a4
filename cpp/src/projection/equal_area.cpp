#include "mirrorbake/projection/equal_area.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "all_projections.hpp"
#include "finite_direction.hpp"
#include "mirrorbake/projection/latlong.hpp"

namespace mirrorbake {
namespace {

constexpr double kPi = std::numbers::pi;

// Sine and cosine of the latitude at any y, and the longitude at any x there.
struct Place {
  double longitude, sine, cosine;
};

Place place_of(double x, double y) {
  // Over a pole and back: y has a period of 4.
  const double turned = y - 4.0 * std::round(0.25 * y);  // in [−2, 2]
  const bool beyond = std::abs(turned) > 1.0;
  const double sine = beyond ? std::copysign(2.0 - std::abs(turned), turned) : turned;
  return {kPi * (beyond ? x + 1.0 : x), sine, std::sqrt(std::max(0.0, (1.0 - sine) * (1.0 + sine)))};
}

}  // namespace

MapPoint equal_area_from_direction(glm::dvec3 d) {
  MapPoint point = latlong_from_direction(d);
  // The size of the largest component is taken out, so that no square overflows or vanishes.
  if (point.covered) {
    d /= std::max(std::abs(d.x), std::max(std::abs(d.y), std::abs(d.z)));
    point.y = d.y / glm::length(d);
  }
  return point;
}

glm::dvec3 direction_from_equal_area(double x, double y) {
  const Place p = place_of(x, y);
  return {p.cosine * std::sin(p.longitude), p.sine, -p.cosine * std::cos(p.longitude)};
}

MapJacobian equal_area_jacobian(double x, double y) {
  const Place p = place_of(x, y);
  const double cosine = std::max(p.cosine, 1e-9);
  const double s = std::sin(p.longitude);
  const double c = std::cos(p.longitude);
  // Beyond a pole the latitude falls with y.
  const double way = std::abs(y - 4.0 * std::round(0.25 * y)) > 1.0 ? -1.0 : 1.0;
  return {kPi * cosine * glm::dvec3(c, 0.0, s), way / cosine * glm::dvec3(-p.sine * s, p.cosine, p.sine * c)};
}

const ProjectionTraits kEqualAreaTraits{
    .name = "equal_area",
    .shape = FaceShape::panorama,
    .point_from_direction = [](const Projection&, glm::dvec3 d) { return equal_area_from_direction(d); },
    .direction_from_point = [](const Projection&, int, double x,
                               double y) { return direction_from_equal_area(x, y); },
    .jacobian = [](const Projection&, int, double x, double y) { return equal_area_jacobian(x, y); },
    .texel_solid_angle = [](const Projection&, int width, int height, int,
                            int) { return 4.0 * kPi / (static_cast<double>(width) * height); },
    // In height that of two rows from a pole, not √(4/rows) of the texels there.
    .largest_texel = [](const Projection&) { return glm::dvec2(kPi, 2.0); },
};

}  // namespace mirrorbake
