#include "mirrorbake/scene/shapes.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

constexpr int kMaxSegments = 4096;

void check_finite(const char* argument, glm::vec3 v) {
  if (std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z)) return;
  throw InvalidArgument(argument, text_of(v), "finite coordinates");
}

void check_length(const char* argument, float length) {
  if (length > 0.0F && std::isfinite(length)) return;
  throw InvalidArgument(argument, text_of(length), "a finite length above 0");
}

void check_segments(int segments) {
  if (segments >= 3 && segments <= kMaxSegments) return;
  throw InvalidArgument("segments", std::to_string(segments), "3 to " + std::to_string(kMaxSegments));
}

// Direction in the xz plane at a fraction of a full turn, counter-clockwise seen from above, from +X towards
// −Z. The last step of a turn is exactly the first, so that shapes close.
glm::vec3 around_y(int step, int steps) {
  const double angle = 2.0 * std::numbers::pi * (step % steps) / steps;
  return {static_cast<float>(std::cos(angle)), 0.0F, static_cast<float>(-std::sin(angle))};
}

float fraction(int i, int n) { return static_cast<float>(i) / static_cast<float>(n); }

void add_vertex(TriangleMesh& mesh, glm::vec3 position, glm::vec3 normal, glm::vec2 uv) {
  mesh.positions.push_back(position);
  mesh.normals.push_back(normal);
  mesh.uvs.push_back(uv);
}

// Triangles of a grid of (columns + 1) × (rows + 1) vertices that starts at `first`, counter-clockwise where
// rows grow upwards and columns to the right.
void add_grid(TriangleMesh& mesh, std::uint32_t first, int columns, int rows) {
  const std::uint32_t stride = static_cast<std::uint32_t>(columns) + 1;
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(rows); ++j) {
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(columns); ++i) {
      const std::uint32_t corner = first + j * stride + i;
      mesh.triangles.push_back({corner, corner + 1, corner + stride + 1});
      mesh.triangles.push_back({corner, corner + stride + 1, corner + stride});
    }
  }
}

std::uint32_t next_vertex(const TriangleMesh& mesh) {
  return static_cast<std::uint32_t>(mesh.positions.size());
}

// A flat disc that faces up or down, its texture the disc inscribed in the unit square.
void add_disc(TriangleMesh& mesh, glm::vec3 centre, float radius, int segments, bool faces_up) {
  const std::uint32_t first = next_vertex(mesh);
  const glm::vec3 normal(0.0F, faces_up ? 1.0F : -1.0F, 0.0F);
  add_vertex(mesh, centre, normal, {0.5F, 0.5F});
  for (int i = 0; i <= segments; ++i) {
    const glm::vec3 d = around_y(i, segments);
    add_vertex(mesh, centre + radius * d, normal,
               {0.5F + 0.5F * d.x, 0.5F + (faces_up ? -0.5F : 0.5F) * d.z});
  }
  for (std::uint32_t i = 1; i <= static_cast<std::uint32_t>(segments); ++i) {
    mesh.triangles.push_back(faces_up ? glm::uvec3(first, first + i, first + i + 1)
                                      : glm::uvec3(first, first + i + 1, first + i));
  }
}

}  // namespace

TriangleMesh make_rectangle(glm::vec3 corner, glm::vec3 u, glm::vec3 v) {
  check_finite("corner", corner);
  check_finite("u", u);
  check_finite("v", v);
  const glm::dvec3 normal = glm::cross(glm::dvec3(u), glm::dvec3(v));
  const double area = glm::length(normal);
  if (!(area > 0.0)) throw InvalidArgument("area of u × v", text_of(area), "edges that span an area");
  TriangleMesh mesh;
  const glm::vec3 unit(normal / area);
  add_vertex(mesh, corner, unit, {0.0F, 0.0F});
  add_vertex(mesh, corner + u, unit, {1.0F, 0.0F});
  add_vertex(mesh, corner + u + v, unit, {1.0F, 1.0F});
  add_vertex(mesh, corner + v, unit, {0.0F, 1.0F});
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TriangleMesh make_box(glm::vec3 min, glm::vec3 max) {
  check_finite("min", min);
  check_finite("max", max);
  const glm::vec3 size = max - min;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(size[axis] > 0.0F)) {
      throw InvalidArgument("max", text_of(max[axis]) + " on axis " + std::to_string(axis),
                            "more than min, " + text_of(min[axis]));
    }
  }
  const glm::vec3 x(size.x, 0, 0);
  const glm::vec3 y(0, size.y, 0);
  const glm::vec3 z(0, 0, size.z);
  const std::array<TriangleMesh, 6> faces = {
      make_rectangle(min + x + z, -z, y),  // +X
      make_rectangle(min, z, y),           // −X
      make_rectangle(min + y + z, x, -z),  // +Y
      make_rectangle(min, x, z),           // −Y
      make_rectangle(min + z, x, y),       // +Z
      make_rectangle(min + x, -x, y),      // −Z
  };
  TriangleMesh mesh;
  for (const TriangleMesh& face : faces) {
    const std::uint32_t first = next_vertex(mesh);
    for (std::size_t i = 0; i < 4; ++i) add_vertex(mesh, face.positions[i], face.normals[i], face.uvs[i]);
    for (const glm::uvec3 t : face.triangles) mesh.triangles.push_back(t + first);
  }
  return mesh;
}

TriangleMesh make_sphere(glm::vec3 centre, float radius, int segments) {
  check_finite("centre", centre);
  check_length("radius", radius);
  check_segments(segments);
  TriangleMesh mesh;
  const int rings = std::max(2, segments / 2);
  // Every sector has its own pole vertex, with the texture coordinate of its middle.
  for (int j = 0; j <= rings; ++j) {
    const double latitude = std::numbers::pi * (fraction(j, rings) - 0.5);
    const bool is_pole = j == 0 || j == rings;
    const float ring_radius = is_pole ? 0.0F : static_cast<float>(std::cos(latitude));
    const float y = is_pole ? (j == 0 ? -1.0F : 1.0F) : static_cast<float>(std::sin(latitude));
    for (int i = 0; i <= segments; ++i) {
      const glm::vec3 d = around_y(i, segments);
      const glm::vec3 normal(ring_radius * d.x, y, ring_radius * d.z);
      const float u =
          is_pole ? (static_cast<float>(i) + 0.5F) / static_cast<float>(segments) : fraction(i, segments);
      add_vertex(mesh, centre + radius * normal, normal, {u, fraction(j, rings)});
    }
  }
  const std::uint32_t stride = static_cast<std::uint32_t>(segments) + 1;
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(rings); ++j) {
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(segments); ++i) {
      const std::uint32_t corner = j * stride + i;
      // One triangle of each cell would have no area at a pole.
      if (j != 0) mesh.triangles.push_back({corner, corner + 1, corner + stride + 1});
      if (j == 0) mesh.triangles.push_back({corner, corner + stride + 1, corner + stride});
      if (j != 0 && j + 1 != static_cast<std::uint32_t>(rings)) {
        mesh.triangles.push_back({corner, corner + stride + 1, corner + stride});
      }
    }
  }
  // The last ring's triangles end in the pole vertex of their own sector.
  const std::size_t last_ring = mesh.triangles.size() - static_cast<std::size_t>(segments);
  for (std::size_t i = last_ring; i < mesh.triangles.size(); ++i) mesh.triangles[i].z -= 1;
  return mesh;
}

TriangleMesh make_cylinder(glm::vec3 base, float radius, float height, int segments) {
  check_finite("base", base);
  check_length("radius", radius);
  check_length("height", height);
  check_segments(segments);
  TriangleMesh mesh;
  for (int j = 0; j <= 1; ++j) {
    for (int i = 0; i <= segments; ++i) {
      const glm::vec3 d = around_y(i, segments);
      add_vertex(mesh, base + radius * d + glm::vec3(0.0F, j == 0 ? 0.0F : height, 0.0F), d,
                 {fraction(i, segments), static_cast<float>(j)});
    }
  }
  add_grid(mesh, 0, segments, 1);
  add_disc(mesh, base, radius, segments, false);
  add_disc(mesh, base + glm::vec3(0.0F, height, 0.0F), radius, segments, true);
  return mesh;
}

TriangleMesh make_cone(glm::vec3 base, float radius, float height, int segments) {
  check_finite("base", base);
  check_length("radius", radius);
  check_length("height", height);
  check_segments(segments);
  TriangleMesh mesh;
  const float slant = std::hypot(radius, height);
  const auto side_normal = [&](glm::vec3 d) { return (height * d + glm::vec3(0.0F, radius, 0.0F)) / slant; };
  const glm::vec3 apex = base + glm::vec3(0.0F, height, 0.0F);
  // The apex has no normal of its own: each sector's copy takes that of the sector's middle.
  for (int i = 0; i <= segments; ++i) {
    const glm::vec3 d = around_y(i, segments);
    add_vertex(mesh, base + radius * d, side_normal(d), {fraction(i, segments), 0.0F});
  }
  for (int i = 0; i < segments; ++i) {
    const glm::vec3 d = around_y(2 * i + 1, 2 * segments);
    const std::uint32_t corner = static_cast<std::uint32_t>(i);
    mesh.triangles.push_back({corner, corner + 1, next_vertex(mesh)});
    add_vertex(mesh, apex, side_normal(d),
               {(static_cast<float>(i) + 0.5F) / static_cast<float>(segments), 1.0F});
  }
  add_disc(mesh, base, radius, segments, false);
  return mesh;
}

TriangleMesh make_torus(glm::vec3 centre, float ring_radius, float tube_radius, int segments) {
  check_finite("centre", centre);
  check_length("ring_radius", ring_radius);
  check_length("tube_radius", tube_radius);
  check_segments(segments);
  if (tube_radius >= ring_radius) {
    throw InvalidArgument("tube_radius", text_of(tube_radius),
                          "less than ring_radius, " + text_of(ring_radius));
  }
  TriangleMesh mesh;
  const int tube_segments = std::max(3, segments / 2);
  // Up the outside of the tube first, so that rows grow upwards there.
  for (int j = 0; j <= tube_segments; ++j) {
    const glm::vec3 tube = around_y(j, tube_segments);
    for (int i = 0; i <= segments; ++i) {
      const glm::vec3 d = around_y(i, segments);
      const glm::vec3 normal = tube.x * d + glm::vec3(0.0F, -tube.z, 0.0F);
      add_vertex(mesh, centre + ring_radius * d + tube_radius * normal, normal,
                 {fraction(i, segments), fraction(j, tube_segments)});
    }
  }
  add_grid(mesh, 0, segments, tube_segments);
  return mesh;
}

}  // namespace mirrorbake
