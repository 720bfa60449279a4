#include "mirrorbake/projection/cube.hpp"

#include <array>
#include <cmath>

#include <glm/geometric.hpp>

#include "all_projections.hpp"
#include "finite_direction.hpp"
#include "texel_integral.hpp"

namespace mirrorbake {
namespace {

// OpenGL 4.6 core profile, table 8.19: on each face the axis that the direction follows, and those along
// which s and t grow.
struct FaceFrame {
  glm::vec3 major, s_axis, t_axis;
};
constexpr FaceFrame kFaces[6] = {
    {{1, 0, 0}, {0, 0, -1}, {0, -1, 0}}, {{-1, 0, 0}, {0, 0, 1}, {0, -1, 0}},
    {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}},   {{0, -1, 0}, {1, 0, 0}, {0, 0, -1}},
    {{0, 0, 1}, {1, 0, 0}, {0, -1, 0}},  {{0, 0, -1}, {-1, 0, 0}, {0, -1, 0}},
};

}  // namespace

CubeCoordinates cube_from_direction(glm::vec3 d) {
  const glm::vec3 a = glm::abs(d);
  int axis = 0;
  if (a.y > a.x) axis = 1;
  if (a.z > a[axis]) axis = 2;
  const float major = a[axis];
  if (!(major > 0.0F) || !std::isfinite(a.x) || !std::isfinite(a.y) || !std::isfinite(a.z)) return {};
  const int face = 2 * axis + (d[axis] < 0.0F ? 1 : 0);
  // Divide first: the components may be huge or subnormal, their ratios are in [−1,1].
  const glm::vec3 on_cube(d.x / major, d.y / major, d.z / major);
  const FaceFrame& frame = kFaces[face];
  return {face, 0.5F + 0.5F * glm::dot(on_cube, frame.s_axis), 0.5F + 0.5F * glm::dot(on_cube, frame.t_axis)};
}

glm::vec3 direction_from_cube(int face, float s, float t) {
  const FaceFrame& frame = kFaces[face];
  return frame.major + (2.0F * s - 1.0F) * frame.s_axis + (2.0F * t - 1.0F) * frame.t_axis;
}

MapPoint cube_point_from_direction(glm::dvec3 d) {
  if (!is_usable(d)) return {0, 0.0, 0.0, false};
  const glm::dvec3 a = glm::abs(d);
  int axis = 0;
  if (a.y > a.x) axis = 1;
  if (a.z > a[axis]) axis = 2;
  const int face = 2 * axis + (d[axis] < 0.0 ? 1 : 0);
  const glm::dvec3 on_cube = d / a[axis];
  const FaceFrame& frame = kFaces[face];
  return {face, glm::dot(on_cube, glm::dvec3(frame.s_axis)), -glm::dot(on_cube, glm::dvec3(frame.t_axis)),
          true};
}

glm::dvec3 direction_from_cube_point(int face, double x, double y) {
  const FaceFrame& frame = kFaces[face];
  return glm::dvec3(frame.major) + x * glm::dvec3(frame.s_axis) - y * glm::dvec3(frame.t_axis);
}

MapJacobian cube_jacobian(int face, double x, double y) {
  const glm::dvec3 on_cube = direction_from_cube_point(face, x, y);
  const double length = glm::length(on_cube);
  const glm::dvec3 d = on_cube / length;
  const auto derivative = [&](glm::dvec3 axis) { return (axis - d * glm::dot(d, axis)) / length; };
  const FaceFrame& frame = kFaces[face];
  return {derivative(glm::dvec3(frame.s_axis)), derivative(-glm::dvec3(frame.t_axis))};
}

double cube_texel_solid_angle(int size, int column, int row) {
  const double step = 2.0 / size;
  const double x0 = column * step - 1.0;
  const double y0 = row * step - 1.0;
  const double x1 = x0 + step;
  const double y1 = y0 + step;
  // Ω = A(x1,y1) − A(x0,y1) − A(x1,y0) + A(x0,y0), A(x,y) = atan(xy/√(x²+y²+1)), cancels as the texel
  // shrinks. Instead integrate the density (1+x²+y²)^(−3/2) exactly in x, ∂A/∂y = x / ((1+y²) √(1+x²+y²)),
  // whose difference between x1 and x0 is taken without cancellation, and in y by Gauss-Legendre with five
  // nodes, which for a texel is exact to rounding once size ≥ 32; coarser texels use the corners, which do
  // not cancel.
  if (size < 32) {
    const auto corner = [](double x, double y) { return std::atan2(x * y, std::sqrt(x * x + y * y + 1.0)); };
    return corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0);
  }
  constexpr double kNodes[5] = {0.0, -0.5384693101056831, 0.5384693101056831, -0.9061798459386640,
                                0.9061798459386640};
  constexpr double kWeights[5] = {0.5688888888888889, 0.4786286704993665, 0.4786286704993665,
                                  0.2369268850561891, 0.2369268850561891};
  double sum = 0.0;
  for (int i = 0; i < 5; ++i) {
    const double y = y0 + 0.5 * step * (1.0 + kNodes[i]);
    const double q = 1.0 + y * y;
    const double r0 = std::sqrt(q + x0 * x0);
    const double r1 = std::sqrt(q + x1 * x1);
    // x1/r1 − x0/r0 = (x1² r0² − x0² r1²) / (r0 r1 (x1 r0 + x0 r1)) = q (x1−x0)(x1+x0) / (…); when x0 and x1
    // have opposite signs the plain difference does not cancel.
    const double difference =
        x0 * x1 > 0.0 ? q * step * (x0 + x1) / (r0 * r1 * (x1 * r0 + x0 * r1)) : x1 / r1 - x0 / r0;
    sum += kWeights[i] * difference / q;
  }
  return 0.5 * step * sum;
}

namespace {

constexpr std::array<std::string_view, 6> kFaceNames = {"px", "nx", "py", "ny", "pz", "nz"};

double solid_angle(const Projection&, int width, int height, int column, int row) {
  if (width == height) return cube_texel_solid_angle(width, column, row);
  return integrate_rectangle(texel_rectangle(width, height, column, row),
                             [](double x, double y) { return std::pow(1.0 + x * x + y * y, -1.5); });
}

// Behind the face there is none.
std::optional<glm::dvec2> on_face(const Projection&, int face, glm::dvec3 d) {
  const glm::dvec3 major = direction_from_cube_point(face, 0.0, 0.0);
  const double depth = glm::dot(d, major);
  if (!(depth > 1e-9 * glm::length(d))) return std::nullopt;
  const glm::dvec3 x_axis = direction_from_cube_point(face, 1.0, 0.0) - major;
  const glm::dvec3 y_axis = direction_from_cube_point(face, 0.0, 1.0) - major;
  return glm::dvec2(glm::dot(d, x_axis), glm::dot(d, y_axis)) / depth;
}

}  // namespace

const ProjectionTraits kCubeTraits{
    .name = "cube",
    .density = CenterDensity::cube,
    .face_names = kFaceNames,
    .point_from_direction = [](const Projection&, glm::dvec3 d) { return cube_point_from_direction(d); },
    .direction_from_point = [](const Projection&, int face, double x,
                               double y) { return glm::normalize(direction_from_cube_point(face, x, y)); },
    .jacobian = [](const Projection&, int face, double x, double y) { return cube_jacobian(face, x, y); },
    .texel_solid_angle = solid_angle,
    .point_on_face = on_face,
    .largest_texel = [](const Projection&) { return glm::dvec2(1.0); },
};

}  // namespace mirrorbake
