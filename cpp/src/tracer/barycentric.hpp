#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake::tracing {

/// What vertices carry, between the corners of a triangle. `weights` are those of the second and third
/// corner.
template <typename Values>
auto interpolate(const Values& values, glm::uvec3 corner, glm::vec2 weights) {
  return (1.0F - weights.x - weights.y) * values[corner.x] + weights.x * values[corner.y] +
         weights.y * values[corner.z];
}

/// Texture coordinates of a point of a triangle; 0 where the mesh has none.
inline glm::vec2 uv_at(const TriangleMesh& mesh, std::uint32_t triangle, glm::vec2 weights) {
  return mesh.uvs.empty() ? glm::vec2(0.0F) : interpolate(mesh.uvs, mesh.triangles[triangle], weights);
}

}  // namespace mirrorbake::tracing
