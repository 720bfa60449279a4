#include "mirrorbake/projection/fisheye.hpp"

#include <cmath>

#include "finite_direction.hpp"

namespace mirrorbake {
namespace {

// sin(a r)/r, continuous at 0.
double sine_over_radius(double a, double r) { return r > 1e-8 ? std::sin(a * r) / r : a; }

}  // namespace

MapPoint fisheye_from_direction(glm::dvec3 d, double field_of_view) {
  if (!is_usable(d)) return {0, 0.0, 0.0, false};
  const double half = 0.5 * field_of_view;
  const double across = std::sqrt(d.x * d.x + d.y * d.y);
  const double radius = std::atan2(across, -d.z) / half;
  // A direction on the rim may come out a rounding error beyond it.
  const bool covered = radius <= 1.0 + 1e-7;
  const double r = radius > 1.0 ? 1.0 : radius;
  if (across == 0.0) return {0, r, 0.0, covered};
  return {0, r * (d.x / across), r * (d.y / across), covered};
}

glm::dvec3 direction_from_fisheye(double x, double y, double field_of_view) {
  const double half = 0.5 * field_of_view;
  const double r = std::sqrt(x * x + y * y);
  const double g = sine_over_radius(half, r);
  return {g * x, g * y, -std::cos(half * r)};
}

MapJacobian fisheye_jacobian(double x, double y, double field_of_view) {
  const double a = 0.5 * field_of_view;
  const double r = std::sqrt(x * x + y * y);
  const double g = sine_over_radius(a, r);
  // g'(r)/r, by its series where the quotient cancels.
  const double h =
      a * r > 1e-3 ? (a * std::cos(a * r) * r - std::sin(a * r)) / (r * r * r) : -a * a * a / 3.0;
  return {{g + h * x * x, h * x * y, a * g * x}, {h * x * y, g + h * y * y, a * g * y}};
}

}  // namespace mirrorbake
