#include "loaded_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

constexpr float kMissingNormal = 1e-6F;

glm::dvec3 facet_cross(const std::vector<glm::vec3>& positions, glm::uvec3 t) {
  const glm::dvec3 a(positions[t.x]);
  return glm::cross(glm::dvec3(positions[t.y]) - a, glm::dvec3(positions[t.z]) - a);
}

// Number of each vertex's place, counted from 0 in an order that only depends on the positions and
// `smoothing`.
std::vector<std::uint32_t> weld_positions(const std::vector<glm::vec3>& positions,
                                          std::span<const std::uint64_t> smoothing) {
  const auto before = [&](std::uint32_t a, std::uint32_t b) {
    const glm::vec3 p = positions[a];
    const glm::vec3 q = positions[b];
    if (p.x != q.x) return p.x < q.x;
    if (p.y != q.y) return p.y < q.y;
    if (p.z != q.z) return p.z < q.z;
    return !smoothing.empty() && smoothing[a] < smoothing[b];
  };
  std::vector<std::uint32_t> order(positions.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), before);
  std::vector<std::uint32_t> place(order.size());
  std::uint32_t current = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i > 0 && before(order[i - 1], order[i])) ++current;
    place[order[i]] = current;
  }
  return place;
}

}  // namespace

void check_positions(const std::string& path, const std::vector<glm::vec3>& positions, std::size_t first) {
  constexpr float kMaxCoordinate = 1e12F;  // as validate() has it
  for (std::size_t i = first; i < positions.size(); ++i) {
    const glm::vec3 p = positions[i];
    const float largest = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && largest <= kMaxCoordinate) continue;
    throw FileError(path, "vertex " + std::to_string(i) + " is " + text_of(p) +
                              ", expected finite coordinates up to 1e12");
  }
}

void check_limits(const std::string& path, std::uint64_t vertices, std::uint64_t triangles,
                  const MeshLimits& limits) {
  constexpr std::uint64_t kMaxIndex = std::numeric_limits<std::uint32_t>::max();
  const std::uint64_t max_vertices = std::min(limits.max_vertices, kMaxIndex);
  if (vertices > max_vertices) {
    throw FileError(path, "has " + std::to_string(vertices) + " vertices or more, the limit is " +
                              std::to_string(max_vertices));
  }
  const std::uint64_t max_triangles = std::min(limits.max_triangles, kMaxIndex);
  if (triangles > max_triangles) {
    throw FileError(path, "has " + std::to_string(triangles) + " triangles or more, the limit is " +
                              std::to_string(max_triangles));
  }
}

void complete_normals(TriangleMesh& mesh, std::span<const std::uint64_t> smoothing) {
  mesh.normals.resize(mesh.positions.size(), glm::vec3(0.0F));
  bool is_complete = true;
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    const float length = glm::length(mesh.normals[i]);
    if (length >= kMissingNormal && std::isfinite(length)) {
      mesh.normals[i] /= length;
    } else {
      mesh.normals[i] = glm::vec3(0.0F);
      is_complete = false;
    }
  }
  if (is_complete) return;

  const std::vector<std::uint32_t> place = weld_positions(mesh.positions, smoothing);
  std::vector<glm::dvec3> sums(place.size(), glm::dvec3(0.0));
  for (const glm::uvec3 t : mesh.triangles) {
    const glm::dvec3 cross = facet_cross(mesh.positions, t);
    const double length = glm::length(cross);
    if (!(length > 0.0)) continue;
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 p(mesh.positions[t[k]]);
      const glm::dvec3 a = glm::dvec3(mesh.positions[t[(k + 1) % 3]]) - p;
      const glm::dvec3 b = glm::dvec3(mesh.positions[t[(k + 2) % 3]]) - p;
      sums[place[t[k]]] += std::atan2(length, glm::dot(a, b)) / length * cross;
    }
  }
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    if (mesh.normals[i] != glm::vec3(0.0F)) continue;
    const glm::dvec3 sum = sums[place[i]];
    const double length = glm::length(sum);
    // Facets that cancel out, or none: any unit vector will do.
    mesh.normals[i] = length > 1e-12 ? glm::vec3(sum / length) : glm::vec3(0.0F, 1.0F, 0.0F);
  }
}

void drop_degenerate(const std::string& path, LoadedMesh& loaded) {
  TriangleMesh& mesh = loaded.mesh;
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> new_index(mesh.positions.size(), kUnused);
  std::size_t kept = 0;
  std::size_t next_group = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    while (next_group < loaded.groups.size() && loaded.groups[next_group].first_triangle == i) {
      loaded.groups[next_group++].first_triangle = kept;
    }
    const glm::uvec3 t = mesh.triangles[i];
    if (!(glm::length(facet_cross(mesh.positions, t)) > 0.0)) continue;
    for (int k = 0; k < 3; ++k) new_index[t[k]] = 0;
    mesh.triangles[kept++] = t;
  }
  for (; next_group < loaded.groups.size(); ++next_group) loaded.groups[next_group].first_triangle = kept;
  if (kept == 0) {
    throw FileError(path, mesh.triangles.empty() ? "has no triangles" : "has no triangle with an area");
  }
  mesh.triangles.resize(kept);

  std::uint32_t next = 0;
  for (std::size_t i = 0; i < new_index.size(); ++i) {
    if (new_index[i] == kUnused) continue;
    mesh.positions[next] = mesh.positions[i];
    if (!mesh.normals.empty()) mesh.normals[next] = mesh.normals[i];
    if (!mesh.uvs.empty()) mesh.uvs[next] = mesh.uvs[i];
    if (!mesh.colors.empty()) mesh.colors[next] = mesh.colors[i];
    if (!mesh.tangents.empty()) mesh.tangents[next] = mesh.tangents[i];
    new_index[i] = next++;
  }
  mesh.positions.resize(next);
  if (!mesh.normals.empty()) mesh.normals.resize(next);
  if (!mesh.uvs.empty()) mesh.uvs.resize(next);
  if (!mesh.colors.empty()) mesh.colors.resize(next);
  if (!mesh.tangents.empty()) mesh.tangents.resize(next);
  for (glm::uvec3& t : mesh.triangles) t = {new_index[t.x], new_index[t.y], new_index[t.z]};
}

}  // namespace mirrorbake
