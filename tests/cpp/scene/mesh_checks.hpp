#pragma once

#include <array>
#include <map>
#include <tuple>
#include <utility>
#include <vector>
#include <glm/geometric.hpp>

#include "mirrorbake/scene/scene.hpp"

/// Facts about meshes, computed independently of the code that makes them.
namespace mirrorbake::testing {

inline glm::dvec3 area_vector(const TriangleMesh& mesh, glm::uvec3 t) {
  const glm::dvec3 a(mesh.positions[t.x]);
  return 0.5 * glm::cross(glm::dvec3(mesh.positions[t.y]) - a, glm::dvec3(mesh.positions[t.z]) - a);
}

inline double total_area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const glm::uvec3 t : mesh.triangles) sum += glm::length(area_vector(mesh, t));
  return sum;
}

inline double signed_volume(const std::vector<std::array<glm::dvec3, 3>>& triangles) {
  double sum = 0;
  for (const auto& [a, b, c] : triangles) sum += glm::dot(a, glm::cross(b, c)) / 6.0;
  return sum;
}

/// Vertices with bit-identical positions are one.
struct WeldedMesh {
  std::vector<glm::vec3> positions;
  std::vector<glm::uvec3> triangles;  ///< those that keep three different vertices
  std::size_t collapsed = 0;          ///< number of the others
};

inline WeldedMesh weld(const TriangleMesh& mesh) {
  WeldedMesh welded;
  std::map<std::tuple<float, float, float>, unsigned> index_of;  // −0 and 0 compare equal
  std::vector<unsigned> index(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const glm::vec3 p = mesh.positions[i];
    const auto [it, is_new] =
        index_of.try_emplace({p.x, p.y, p.z}, static_cast<unsigned>(welded.positions.size()));
    if (is_new) welded.positions.push_back(p);
    index[i] = it->second;
  }
  for (const glm::uvec3 t : mesh.triangles) {
    const glm::uvec3 w(index[t.x], index[t.y], index[t.z]);
    if (w.x == w.y || w.y == w.z || w.z == w.x) {
      ++welded.collapsed;
    } else {
      welded.triangles.push_back(w);
    }
  }
  return welded;
}

/// How often each directed edge occurs.
inline std::map<std::pair<unsigned, unsigned>, int> directed_edges(const WeldedMesh& mesh) {
  std::map<std::pair<unsigned, unsigned>, int> edges;
  for (const glm::uvec3 t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  return edges;
}

/// The edges without an opposite one, each vertex's successor along its loop.
inline std::map<unsigned, unsigned> boundary_loops(const WeldedMesh& mesh) {
  const auto edges = directed_edges(mesh);
  std::map<unsigned, unsigned> next;
  for (const auto& [edge, count] : edges) {
    if (!edges.contains({edge.second, edge.first})) next[edge.first] = edge.second;
  }
  return next;
}

}  // namespace mirrorbake::testing
