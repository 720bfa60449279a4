#include "mirrorbake/projection/sphere_map.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "all_projections.hpp"
#include "finite_direction.hpp"
#include "texel_integral.hpp"

namespace mirrorbake {

MapPoint sphere_map_from_direction(glm::dvec3 d) {
  if (!is_usable(d)) return {0, 0.0, 0.0, false};
  // |h_xy| = sin(θ/2), θ the angle to v₀; the half angle comes from atan2, since 1 + d_z cancels towards −v₀.
  const double across = std::hypot(d.x, d.y);
  if (across == 0.0) return d.z > 0.0 ? MapPoint{0, 0.0, 0.0, true} : MapPoint{0, 1.0, 0.0, true};
  const double r = std::sin(0.5 * std::atan2(across, d.z));
  return {0, r * (d.x / across), r * (d.y / across), true};
}

glm::dvec3 direction_from_sphere_map(double x, double y) {
  const double z2 = 1.0 - (x * x + y * y);
  if (!(z2 > 0.0)) return {0.0, 0.0, -1.0};
  const double z = std::sqrt(z2);
  return {2.0 * z * x, 2.0 * z * y, 2.0 * z2 - 1.0};
}

MapJacobian sphere_map_jacobian(double x, double y) {
  const double z2 = 1.0 - (x * x + y * y);
  if (!(z2 > 0.0)) return {};
  const double z = std::sqrt(z2);
  const double xy = -2.0 * x * y / z;
  return {{2.0 * z - 2.0 * x * x / z, xy, -4.0 * x}, {xy, 2.0 * z - 2.0 * y * y / z, -4.0 * y}};
}

const ProjectionTraits kSphereMapTraits{
    .name = "sphere_map",
    .shape = FaceShape::disc,
    .rim = Rim::singular,
    .density = CenterDensity::equal,
    .point_from_direction = [](const Projection&, glm::dvec3 d) { return sphere_map_from_direction(d); },
    .direction_from_point = [](const Projection&, int, double x,
                               double y) { return direction_from_sphere_map(x, y); },
    .jacobian = [](const Projection&, int, double x, double y) { return sphere_map_jacobian(x, y); },
    .texel_solid_angle =
        [](const Projection&, int width, int height, int column, int row) {
          return integrate_in_disc(texel_rectangle(width, height, column, row), [](double) { return 4.0; });
        },
    .largest_texel = [](const Projection&) { return glm::dvec2(2.0); },
};

}  // namespace mirrorbake
