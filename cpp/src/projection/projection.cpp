#include "mirrorbake/projection/projection.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cmath>

#include <glm/geometric.hpp>

#include "all_projections.hpp"
#include "finite_direction.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {

const ProjectionTraits& traits(ProjectionKind kind) { return *kProjections[static_cast<std::size_t>(kind)]; }

Projection parse_projection(std::string_view text) {
  const std::string_view name = text.substr(0, text.find(':'));
  for (std::size_t i = 0; i < kProjections.size(); ++i) {
    if (name != kProjections[i]->name) continue;
    Projection projection{static_cast<ProjectionKind>(i)};
    if (name.size() < text.size()) {
      const std::string_view degrees = text.substr(name.size() + 1);
      const char* end = degrees.data() + degrees.size();
      const auto [rest, error] = std::from_chars(degrees.data(), end, projection.field_of_view);
      if (!kProjections[i]->takes_field_of_view || error != std::errc() || rest != end) break;
    }
    validate(projection);
    return projection;
  }
  throw InvalidArgument("projection", text, projection_names());
}

std::string to_string(const Projection& projection) {
  const ProjectionTraits& known = traits(projection.kind);
  if (!known.takes_field_of_view) return std::string(known.name);
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), projection.field_of_view).ptr;
  return std::string(known.name) + ":" + std::string(digits.data(), end);
}

std::string projection_names() {
  std::string names;
  for (const ProjectionTraits* known : kProjections) {
    if (known != kProjections.front()) names += ", ";
    names += known->name;
    if (known->takes_field_of_view) names += ", " + std::string(known->name) + ":DEGREES";
  }
  return names;
}

void validate(const Projection& projection) {
  if (!traits(projection.kind).takes_field_of_view) return;
  if (!(projection.field_of_view > 0.0F && projection.field_of_view <= 360.0F)) {
    throw InvalidArgument("field_of_view", text_of(projection.field_of_view),
                          "above 0 and up to 360 degrees");
  }
}

int face_count(const Projection& projection) {
  return std::max(1, static_cast<int>(traits(projection.kind).face_names.size()));
}

bool is_panorama(ProjectionKind kind) { return traits(kind).shape == FaceShape::panorama; }

int natural_aspect(const Projection& projection) { return is_panorama(projection.kind) ? 2 : 1; }

MapPoint point_from_direction(const Projection& p, glm::dvec3 d) {
  return traits(p.kind).point_from_direction(p, d);
}

std::optional<glm::dvec2> point_on_face(const Projection& p, int face, glm::dvec3 d) {
  const ProjectionTraits& known = traits(p.kind);
  if (known.point_on_face != nullptr) return known.point_on_face(p, face, d);
  const MapPoint point = known.point_from_direction(p, d);
  return glm::dvec2(point.x, point.y);
}

glm::dvec3 direction_from_point(const Projection& p, int face, double x, double y) {
  return traits(p.kind).direction_from_point(p, face, x, y);
}

MapJacobian map_jacobian(const Projection& p, int face, double x, double y) {
  return traits(p.kind).jacobian(p, face, x, y);
}

double solid_angle_density(const Projection& p, int face, double x, double y) {
  const MapJacobian j = map_jacobian(p, face, x, y);
  return glm::length(glm::cross(j.dx, j.dy));
}

double texel_solid_angle(const Projection& p, int width, int height, int column, int row) {
  return traits(p.kind).texel_solid_angle(p, width, height, column, row);
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
