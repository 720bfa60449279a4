#include "mirrorbake/projection/fisheye.hpp"

#include <cmath>
#include <numbers>

#include <glm/trigonometric.hpp>

#include "all_projections.hpp"
#include "finite_direction.hpp"
#include "texel_integral.hpp"

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

namespace {

// An angular map is a fisheye that sees everything.
double field_of_view(const Projection& p) {
  return p.kind == ProjectionKind::angular ? 2.0 * std::numbers::pi
                                           : glm::radians(static_cast<double>(p.field_of_view));
}

// Not clamped to the rim.
std::optional<glm::dvec2> on_face(const Projection& p, int, glm::dvec3 d) {
  const double across = std::hypot(d.x, d.y);
  const double radius = std::atan2(across, -d.z) / (0.5 * field_of_view(p));
  return across == 0.0 ? glm::dvec2(radius, 0.0) : radius / across * glm::dvec2(d);
}

double solid_angle(const Projection& p, int width, int height, int column, int row) {
  const double half = 0.5 * field_of_view(p);
  return integrate_in_disc(texel_rectangle(width, height, column, row), [half](double r2) {
    const double radius = std::sqrt(r2);
    return half * (radius > 1e-8 ? std::sin(half * radius) / radius : half);
  });
}

constexpr ProjectionTraits traits_of(std::string_view name, Rim rim) {
  return {
      .name = name,
      .shape = FaceShape::disc,
      .rim = rim,
      .density = CenterDensity::fisheye,
      .takes_field_of_view = rim == Rim::boundary,
      .point_from_direction = [](const Projection& p,
                                 glm::dvec3 d) { return fisheye_from_direction(d, field_of_view(p)); },
      .direction_from_point = [](const Projection& p, int, double x,
                                 double y) { return direction_from_fisheye(x, y, field_of_view(p)); },
      .jacobian = [](const Projection& p, int, double x,
                     double y) { return fisheye_jacobian(x, y, field_of_view(p)); },
      .texel_solid_angle = solid_angle,
      .point_on_face = on_face,
      .largest_texel = [](const Projection& p) { return glm::dvec2(0.5 * field_of_view(p)); },
  };
}

}  // namespace

const ProjectionTraits kAngularTraits = traits_of("angular", Rim::direction);
const ProjectionTraits kFisheyeTraits = traits_of("fisheye", Rim::boundary);

}  // namespace mirrorbake
