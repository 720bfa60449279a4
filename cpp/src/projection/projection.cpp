#include "mirrorbake/projection/projection.hpp"

#include <array>
#include <atomic>
#include <charconv>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "finite_direction.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/projection/cube.hpp"
#include "mirrorbake/projection/dual_paraboloid.hpp"
#include "mirrorbake/projection/equal_area.hpp"
#include "mirrorbake/projection/fisheye.hpp"
#include "mirrorbake/projection/latlong.hpp"
#include "mirrorbake/projection/sphere_map.hpp"
#include "texel_integral.hpp"

namespace mirrorbake {
namespace {

constexpr double kPi = std::numbers::pi;

constexpr std::array<std::pair<ProjectionKind, std::string_view>, 7> kNames = {{
    {ProjectionKind::cube, "cube"},
    {ProjectionKind::dual_paraboloid, "dual_paraboloid"},
    {ProjectionKind::sphere_map, "sphere_map"},
    {ProjectionKind::latlong, "latlong"},
    {ProjectionKind::angular, "angular"},
    {ProjectionKind::fisheye, "fisheye"},
    {ProjectionKind::equal_area, "equal_area"},
}};

double field_of_view_radians(const Projection& p) {
  return p.kind == ProjectionKind::angular ? 2.0 * kPi : glm::radians(static_cast<double>(p.field_of_view));
}

}  // namespace

Projection parse_projection(std::string_view text) {
  const std::string_view name = text.substr(0, text.find(':'));
  for (const auto& [kind, known] : kNames) {
    if (name != known) continue;
    Projection projection{kind};
    if (name.size() < text.size()) {
      const std::string_view degrees = text.substr(name.size() + 1);
      const char* end = degrees.data() + degrees.size();
      const auto [rest, error] = std::from_chars(degrees.data(), end, projection.field_of_view);
      if (kind != ProjectionKind::fisheye || error != std::errc() || rest != end) break;
    }
    validate(projection);
    return projection;
  }
  throw InvalidArgument(
      "projection", text,
      "cube, dual_paraboloid, sphere_map, latlong, equal_area, angular, fisheye or fisheye:DEGREES");
}

std::string to_string(const Projection& projection) {
  for (const auto& [kind, name] : kNames) {
    if (kind != projection.kind) continue;
    if (kind != ProjectionKind::fisheye) return std::string(name);
    std::array<char, 32> digits{};
    const auto end =
        std::to_chars(digits.data(), digits.data() + digits.size(), projection.field_of_view).ptr;
    return std::string(name) + ":" + std::string(digits.data(), end);
  }
  return "unknown";
}

void validate(const Projection& projection) {
  if (projection.kind != ProjectionKind::fisheye) return;
  if (!(projection.field_of_view > 0.0F && projection.field_of_view <= 360.0F)) {
    throw InvalidArgument("field_of_view", text_of(projection.field_of_view),
                          "above 0 and up to 360 degrees");
  }
}

int face_count(const Projection& projection) {
  return projection.kind == ProjectionKind::cube              ? 6
         : projection.kind == ProjectionKind::dual_paraboloid ? 2
                                                              : 1;
}

int natural_aspect(const Projection& projection) { return is_panorama(projection.kind) ? 2 : 1; }

MapPoint point_from_direction(const Projection& p, glm::dvec3 d) {
  switch (p.kind) {
    case ProjectionKind::cube: return cube_point_from_direction(d);
    case ProjectionKind::dual_paraboloid: return dual_paraboloid_from_direction(d);
    case ProjectionKind::sphere_map: return sphere_map_from_direction(d);
    case ProjectionKind::latlong: return latlong_from_direction(d);
    case ProjectionKind::equal_area: return equal_area_from_direction(d);
    case ProjectionKind::angular:
    case ProjectionKind::fisheye: return fisheye_from_direction(d, field_of_view_radians(p));
  }
  return {};
}

std::optional<glm::dvec2> point_on_face(const Projection& p, int face, glm::dvec3 d) {
  switch (p.kind) {
    case ProjectionKind::cube: {
      const glm::dvec3 major = direction_from_cube_point(face, 0.0, 0.0);
      const double depth = glm::dot(d, major);
      if (!(depth > 1e-9 * glm::length(d))) return std::nullopt;
      const glm::dvec3 x_axis = direction_from_cube_point(face, 1.0, 0.0) - major;
      const glm::dvec3 y_axis = direction_from_cube_point(face, 0.0, 1.0) - major;
      return glm::dvec2(glm::dot(d, x_axis), glm::dot(d, y_axis)) / depth;
    }
    case ProjectionKind::dual_paraboloid: {
      const double length = glm::length(d);
      const double q = length + (face == 0 ? d.z : -d.z);
      if (!(q > 1e-9 * length)) return std::nullopt;
      return glm::dvec2(d) / q;
    }
    case ProjectionKind::angular:
    case ProjectionKind::fisheye: {
      const double across = std::hypot(d.x, d.y);
      const double radius = std::atan2(across, -d.z) / (0.5 * field_of_view_radians(p));
      return across == 0.0 ? glm::dvec2(radius, 0.0) : radius / across * glm::dvec2(d);
    }
    case ProjectionKind::sphere_map:
    case ProjectionKind::latlong:
    case ProjectionKind::equal_area: {
      const MapPoint point = point_from_direction(p, d);
      return glm::dvec2(point.x, point.y);
    }
  }
  return std::nullopt;
}

glm::dvec3 direction_from_point(const Projection& p, int face, double x, double y) {
  switch (p.kind) {
    case ProjectionKind::cube: return glm::normalize(direction_from_cube_point(face, x, y));
    case ProjectionKind::dual_paraboloid: return direction_from_dual_paraboloid(face, x, y);
    case ProjectionKind::sphere_map: return direction_from_sphere_map(x, y);
    case ProjectionKind::latlong: return direction_from_latlong(x, y);
    case ProjectionKind::equal_area: return direction_from_equal_area(x, y);
    case ProjectionKind::angular:
    case ProjectionKind::fisheye: return direction_from_fisheye(x, y, field_of_view_radians(p));
  }
  return {};
}

MapJacobian map_jacobian(const Projection& p, int face, double x, double y) {
  switch (p.kind) {
    case ProjectionKind::cube: return cube_jacobian(face, x, y);
    case ProjectionKind::dual_paraboloid: return dual_paraboloid_jacobian(face, x, y);
    case ProjectionKind::sphere_map: return sphere_map_jacobian(x, y);
    case ProjectionKind::latlong: return latlong_jacobian(x, y);
    case ProjectionKind::equal_area: return equal_area_jacobian(x, y);
    case ProjectionKind::angular:
    case ProjectionKind::fisheye: return fisheye_jacobian(x, y, field_of_view_radians(p));
  }
  return {};
}

double solid_angle_density(const Projection& p, int face, double x, double y) {
  const MapJacobian j = map_jacobian(p, face, x, y);
  return glm::length(glm::cross(j.dx, j.dy));
}

double texel_solid_angle(const Projection& p, int width, int height, int column, int row) {
  const Rectangle r{2.0 * column / width - 1.0, 2.0 * (column + 1) / width - 1.0,
                    1.0 - 2.0 * (row + 1) / height, 1.0 - 2.0 * row / height};
  switch (p.kind) {
    case ProjectionKind::cube:
      if (width == height) return cube_texel_solid_angle(width, column, row);
      return integrate_rectangle(r, [](double x, double y) { return std::pow(1.0 + x * x + y * y, -1.5); });
    case ProjectionKind::latlong: {
      // Δλ (sin φ₁ − sin φ₀), the difference as a product so that it does not cancel.
      const double middle = 0.25 * kPi * (r.y0 + r.y1);
      return 2.0 * kPi / width * 2.0 * std::cos(middle) * std::sin(0.5 * kPi / height);
    }
    case ProjectionKind::equal_area: return 4.0 * kPi / (static_cast<double>(width) * height);
    case ProjectionKind::dual_paraboloid:
      return integrate_in_disc(r, [](double r2) { return 4.0 / ((1.0 + r2) * (1.0 + r2)); });
    case ProjectionKind::sphere_map: return integrate_in_disc(r, [](double) { return 4.0; });
    case ProjectionKind::angular:
    case ProjectionKind::fisheye: {
      const double half = 0.5 * field_of_view_radians(p);
      return integrate_in_disc(r, [half](double r2) {
        const double radius = std::sqrt(r2);
        return half * (radius > 1e-8 ? std::sin(half * radius) / radius : half);
      });
    }
  }
  return 0.0;
}

std::vector<double> texel_solid_angles(const Projection& p, int width, int height) {
  validate(p);
  for (int size : {width, height}) {
    check_range("size", size, 1, 65536, " texels");
  }
  std::vector<double> angles(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  parallel_for(static_cast<std::size_t>(height), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      double* out = angles.data() + row * static_cast<std::size_t>(width);
      if (is_panorama(p.kind)) {
        std::fill_n(out, width, texel_solid_angle(p, width, height, 0, static_cast<int>(row)));
        continue;
      }
      for (int column = 0; column < width; ++column) {
        out[column] = texel_solid_angle(p, width, height, column, static_cast<int>(row));
      }
    }
  });
  return angles;
}

std::size_t points_from_directions(const Projection& p, std::span<const glm::vec3> directions,
                                   std::span<std::int32_t> faces, std::span<glm::vec2> points,
                                   std::size_t* not_covered) {
  if (faces.size() != directions.size() || points.size() != directions.size()) {
    throw InvalidArgument("faces, points", "of another length",
                          std::to_string(directions.size()) + " entries");
  }
  validate(p);
  std::atomic<std::size_t> unusable{0};
  std::atomic<std::size_t> outside{0};
  parallel_for(directions.size(), 4096, [&](std::size_t begin, std::size_t end) {
    std::size_t bad = 0;
    std::size_t out = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const MapPoint point = point_from_direction(p, glm::dvec3(directions[i]));
      faces[i] = point.face;
      points[i] = glm::vec2(static_cast<float>(point.x), static_cast<float>(point.y));
      if (!point.covered) ++(is_usable(glm::dvec3(directions[i])) ? out : bad);
    }
    unusable += bad;
    outside += out;
  });
  if (not_covered) *not_covered = outside;
  return unusable;
}

void directions_from_points(const Projection& p, std::span<const std::int32_t> faces,
                            std::span<const glm::vec2> points, std::span<glm::vec3> directions) {
  if (faces.size() != points.size() || directions.size() != points.size()) {
    throw InvalidArgument("faces, directions", "of another length",
                          std::to_string(points.size()) + " entries");
  }
  validate(p);
  const int face_limit = face_count(p);
  parallel_for(points.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (faces[i] < 0 || faces[i] >= face_limit) {
        throw InvalidArgument("faces[" + std::to_string(i) + "]", std::to_string(faces[i]),
                              "0 to " + std::to_string(face_limit - 1));
      }
      if (!std::isfinite(points[i].x) || !std::isfinite(points[i].y)) {
        throw InvalidArgument("points[" + std::to_string(i) + "]", "not finite", "coordinates in [-1, 1]");
      }
      directions[i] = glm::vec3(direction_from_point(p, faces[i], static_cast<double>(points[i].x),
                                                     static_cast<double>(points[i].y)));
    }
  });
}

}  // namespace mirrorbake
