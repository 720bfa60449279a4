#include "tangents.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include <glm/geometric.hpp>

namespace mirrorbake {
namespace {

/// Number of each vertex among those of equal position, normal and coordinates.
std::vector<std::uint32_t> weld(const TriangleMesh& mesh) {
  const auto key = [&](std::uint32_t i) {
    const glm::vec3 p = mesh.positions[i];
    const glm::vec3 n = mesh.normals[i];
    const glm::vec2 uv = mesh.uvs[i];
    return std::array<float, 8>{p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y};
  };
  std::vector<std::uint32_t> order(mesh.positions.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::vector<std::uint32_t> welded(order.size());
  std::uint32_t current = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i > 0 && key(order[i - 1]) != key(order[i])) ++current;
    welded[order[i]] = current;
  }
  return welded;
}

/// The direction in which u grows on a triangle, of any length, and the sign of the area of its coordinates;
/// 0 where they have no area.
struct Direction {
  glm::dvec3 along{0.0};
  int sign = 0;
};

Direction direction_of_u(const TriangleMesh& mesh, glm::uvec3 t) {
  const glm::dvec2 du = glm::dvec2(mesh.uvs[t.y]) - glm::dvec2(mesh.uvs[t.x]);
  const glm::dvec2 dv = glm::dvec2(mesh.uvs[t.z]) - glm::dvec2(mesh.uvs[t.x]);
  const double area = du.x * dv.y - du.y * dv.x;
  if (area == 0.0) return {};
  const glm::dvec3 corner(mesh.positions[t.x]);
  const glm::dvec3 e1 = glm::dvec3(mesh.positions[t.y]) - corner;
  const glm::dvec3 e2 = glm::dvec3(mesh.positions[t.z]) - corner;
  const glm::dvec3 along = (dv.y * e1 - du.y * e2) * std::copysign(1.0, area);
  return {along, area > 0.0 ? 1 : -1};
}

/// What is left of a vector in the plane of a unit normal, of length 1; 0 if nothing is.
glm::dvec3 in_plane(glm::dvec3 v, glm::dvec3 normal) {
  const glm::dvec3 flat = v - glm::dot(v, normal) * normal;
  const double length = glm::length(flat);
  return length > 1e-12 * glm::length(v) && length > 0.0 ? flat / length : glm::dvec3(0.0);
}

/// Appends a copy of a vertex.
std::uint32_t copy_vertex(TriangleMesh& mesh, std::uint32_t vertex) {
  mesh.positions.push_back(glm::vec3(mesh.positions[vertex]));
  mesh.normals.push_back(glm::vec3(mesh.normals[vertex]));
  mesh.uvs.push_back(glm::vec2(mesh.uvs[vertex]));
  if (!mesh.colors.empty()) mesh.colors.push_back(glm::vec3(mesh.colors[vertex]));
  mesh.tangents.push_back(glm::vec4(0.0F));
  return static_cast<std::uint32_t>(mesh.positions.size() - 1);
}

}  // namespace

void derive_tangents(TriangleMesh& mesh) {
  if (mesh.normals.empty() || mesh.uvs.empty()) return;
  const std::vector<std::uint32_t> welded = weld(mesh);
  const std::size_t place_count = welded.empty() ? 0 : 1 + *std::max_element(welded.begin(), welded.end());
  const auto sum_of = [&](std::uint32_t vertex, int sign) {
    return 2 * std::size_t{welded[vertex]} + (sign < 0 ? 1 : 0);
  };
  std::vector<glm::dvec3> sums(2 * place_count, glm::dvec3(0.0));
  for (const glm::uvec3 t : mesh.triangles) {
    const Direction direction = direction_of_u(mesh, t);
    if (direction.sign == 0) continue;
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 normal(mesh.normals[t[k]]);
      const glm::dvec3 p(mesh.positions[t[k]]);
      const glm::dvec3 a = in_plane(glm::dvec3(mesh.positions[t[(k + 1) % 3]]) - p, normal);
      const glm::dvec3 b = in_plane(glm::dvec3(mesh.positions[t[(k + 2) % 3]]) - p, normal);
      const double angle = std::acos(std::clamp(glm::dot(a, b), -1.0, 1.0));
      sums[sum_of(t[k], direction.sign)] += angle * in_plane(direction.along, normal);
    }
  }

  const std::size_t given = mesh.positions.size();
  mesh.tangents.resize(given, glm::vec4(0.0F));
  const std::vector<glm::vec4> kept = mesh.tangents;
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> other(given, kNone);  // the copy of a vertex for triangles of the other sign
  for (glm::uvec3& t : mesh.triangles) {
    const int sign = direction_of_u(mesh, t).sign;
    if (sign == 0) continue;
    for (int k = 0; k < 3; ++k) {
      std::uint32_t& vertex = t[k];
      if (kept[vertex].w != 0.0F) continue;
      const glm::dvec3 sum = sums[sum_of(vertex, sign)];
      const double length = glm::length(sum);
      if (!(length > 1e-12)) continue;
      const glm::vec4 tangent(glm::vec3(sum / length), static_cast<float>(sign));
      if (mesh.tangents[vertex].w == -tangent.w) {
        if (other[vertex] == kNone) other[vertex] = copy_vertex(mesh, vertex);
        vertex = other[vertex];
      }
      mesh.tangents[vertex] = tangent;
    }
  }
  const auto is_none = [](glm::vec4 tangent) { return tangent.w == 0.0F; };
  if (std::all_of(mesh.tangents.begin(), mesh.tangents.end(), is_none)) mesh.tangents.clear();
}

}  // namespace mirrorbake
