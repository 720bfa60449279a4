#include "mirrorbake/projection/latlong.hpp"

#include <cmath>
#include <numbers>

#include "all_projections.hpp"
#include "finite_direction.hpp"
#include "texel_integral.hpp"

namespace mirrorbake {
namespace {
constexpr double kPi = std::numbers::pi;
}

MapPoint latlong_from_direction(glm::dvec3 d) {
  if (!is_usable(d)) return {0, 0.0, 0.0, false};
  return {0, std::atan2(d.x, -d.z) / kPi, std::atan2(d.y, std::sqrt(d.x * d.x + d.z * d.z)) / (0.5 * kPi),
          true};
}

glm::dvec3 direction_from_latlong(double x, double y) {
  const double longitude = kPi * x;
  const double latitude = 0.5 * kPi * y;
  const double c = std::cos(latitude);
  return {c * std::sin(longitude), std::sin(latitude), -c * std::cos(longitude)};
}

MapJacobian latlong_jacobian(double x, double y) {
  const double sin_long = std::sin(kPi * x);
  const double cos_long = std::cos(kPi * x);
  const double sin_lat = std::sin(0.5 * kPi * y);
  const double cos_lat = std::cos(0.5 * kPi * y);
  return {kPi * cos_lat * glm::dvec3(cos_long, 0.0, sin_long),
          0.5 * kPi * glm::dvec3(-sin_lat * sin_long, cos_lat, sin_lat * cos_long)};
}

namespace {

double solid_angle(const Projection&, int width, int height, int column, int row) {
  // Δλ (sin φ₁ − sin φ₀), the difference as a product so that it does not cancel.
  const Rectangle r = texel_rectangle(width, height, column, row);
  const double middle = 0.25 * kPi * (r.y0 + r.y1);
  return 2.0 * kPi / width * 2.0 * std::cos(middle) * std::sin(0.5 * kPi / height);
}

}  // namespace

const ProjectionTraits kLatlongTraits{
    .name = "latlong",
    .shape = FaceShape::panorama,
    .point_from_direction = [](const Projection&, glm::dvec3 d) { return latlong_from_direction(d); },
    .direction_from_point = [](const Projection&, int, double x,
                               double y) { return direction_from_latlong(x, y); },
    .jacobian = [](const Projection&, int, double x, double y) { return latlong_jacobian(x, y); },
    .texel_solid_angle = solid_angle,
    .largest_texel = [](const Projection&) { return glm::dvec2(kPi, 0.5 * kPi); },
};

}  // namespace mirrorbake
