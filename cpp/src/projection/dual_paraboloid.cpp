#include "mirrorbake/projection/dual_paraboloid.hpp"

#include <array>
#include <cmath>
#include <string>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "all_projections.hpp"
#include "finite_direction.hpp"
#include "mirrorbake/core/check.hpp"
#include "texel_integral.hpp"

namespace mirrorbake {

MapPoint dual_paraboloid_from_direction(glm::dvec3 d) {
  if (!is_usable(d)) return {0, 0.0, 0.0, false};
  const double length = glm::length(d);
  const double q = length + std::abs(d.z);
  return {d.z >= 0.0 ? 0 : 1, d.x / q, d.y / q, true};
}

glm::dvec3 direction_from_dual_paraboloid(int face, double x, double y) {
  const double r2 = x * x + y * y;
  return glm::dvec3(2.0 * x, 2.0 * y, face == 0 ? 1.0 - r2 : r2 - 1.0) / (1.0 + r2);
}

MapJacobian dual_paraboloid_jacobian(int face, double x, double y) {
  const double q = 1.0 + x * x + y * y;
  const glm::dvec3 d = direction_from_dual_paraboloid(face, x, y);
  const double sign = face == 0 ? -2.0 : 2.0;
  return {(glm::dvec3(2.0, 0.0, sign * x) - 2.0 * x * d) / q,
          (glm::dvec3(0.0, 2.0, sign * y) - 2.0 * y * d) / q};
}

glm::mat4 dual_paraboloid_texture_matrix(const glm::mat3& frame_from_map, int face) {
  check_range("face", face, 0, 1);
  check_orthonormal("frame_from_map", frame_from_map);
  // s = ½ + ½ r_x/q and t = ½ − ½ r_y/q with q = 1 ± r_z, in the order A · P · S · M⁻¹ of [EMT]; GLM's
  // matrices are lists of columns.
  const float sign = face == 0 ? 1.0F : -1.0F;
  const glm::mat4 subtract(glm::vec4(1, 0, 0, 0), glm::vec4(0, 1, 0, 0), glm::vec4(0, 0, sign, 0),
                           glm::vec4(0, 0, 1, 1));
  const glm::mat4 perspective(glm::vec4(1, 0, 0, 0), glm::vec4(0, 1, 0, 0), glm::vec4(0, 0, 1, 1),
                              glm::vec4(0, 0, 0, 0));
  const glm::mat4 to_texture(glm::vec4(0.5F, 0, 0, 0), glm::vec4(0, -0.5F, 0, 0), glm::vec4(0, 0, 1, 0),
                             glm::vec4(0.5F, 0.5F, 0, 1));
  return to_texture * perspective * subtract * glm::mat4(glm::transpose(frame_from_map));
}

namespace {

constexpr std::array<std::string_view, 2> kFaceNames = {"front", "back"};

double solid_angle(const Projection&, int width, int height, int column, int row) {
  return integrate_in_disc(texel_rectangle(width, height, column, row),
                           [](double r2) { return 4.0 / ((1.0 + r2) * (1.0 + r2)); });
}

std::optional<glm::dvec2> on_face(const Projection&, int face, glm::dvec3 d) {
  const double length = glm::length(d);
  const double q = length + (face == 0 ? d.z : -d.z);
  if (!(q > 1e-9 * length)) return std::nullopt;
  return glm::dvec2(d) / q;
}

}  // namespace

const ProjectionTraits kDualParaboloidTraits{
    .name = "dual_paraboloid",
    .shape = FaceShape::disc,
    .rim = Rim::neighbour,
    .density = CenterDensity::paraboloid,
    .face_names = kFaceNames,
    .point_from_direction = [](const Projection&, glm::dvec3 d) { return dual_paraboloid_from_direction(d); },
    .direction_from_point = [](const Projection&, int face, double x,
                               double y) { return direction_from_dual_paraboloid(face, x, y); },
    .jacobian = [](const Projection&, int face, double x,
                   double y) { return dual_paraboloid_jacobian(face, x, y); },
    .texel_solid_angle = solid_angle,
    .point_on_face = on_face,
    .largest_texel = [](const Projection&) { return glm::dvec2(2.0); },
};

}  // namespace mirrorbake
