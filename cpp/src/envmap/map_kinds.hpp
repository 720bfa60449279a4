#pragma once

#include <array>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/envmap/texel_topology.hpp"
#include "mirrorbake/projection/cube.hpp"

/// The projections in which maps are kept whose levels are inferred: what each is, where a direction falls on
/// its faces, and how far a change of the direction moves it there. `viewer/src/projection.ts` has the same
/// for the page.
namespace mirrorbake {

/// A point of a face, (0, 0) its top left corner, (1, 1) its bottom right one.
struct FacePoint {
  int face;
  float s, t;
};

struct CubeMaps {
  static constexpr MapProjection kTraits{
      .kind = TopologyKind::cube,
      .name = "cube",
      .projection = ProjectionKind::cube,
      .faces = 6,
      .faces_in_a_row = 3,
      .order = "+X -X +Y -Y +Z -Z, OpenGL orientation, row 0 on top",
      .beyond_edges = BeyondEdges::neighbour,
  };

  static FacePoint point(glm::vec3 d) {
    const CubeCoordinates c = cube_from_direction(d);
    return {c.face, c.s, c.t};
  }

  static float length(glm::vec3 d, glm::vec3 change, glm::vec2 sides) {
    const glm::vec3 a = glm::abs(d);
    int axis = a.y > a.x ? 1 : 0;
    if (a.z > a[axis]) axis = 2;
    // Derivative of the face coordinates ½ + ½ d/|major|, by the quotient rule.
    const float sign = d[axis] < 0.0F ? -1.0F : 1.0F;
    glm::vec3 on_face = (change - d / a[axis] * (sign * change[axis])) / a[axis];
    on_face[axis] = 0.0F;
    return sides.x * std::sqrt(0.25F * glm::dot(on_face, on_face));
  }
};

struct ParaboloidMaps {
  static constexpr MapProjection kTraits{
      .kind = TopologyKind::dual_paraboloid,
      .name = "paraboloid",
      .projection = ProjectionKind::dual_paraboloid,
      .faces = 2,
      .faces_in_a_row = 2,
      .order = "front (+Z), back (-Z), row 0 on top",
      .beyond_edges = BeyondEdges::nothing,
  };

  static FacePoint point(glm::vec3 d) {
    const glm::dvec3 e(d);
    const double size = glm::length(e) + std::abs(e.z);
    return {d.z >= 0.0F ? 0 : 1, static_cast<float>(0.5 + 0.5 * e.x / size),
            static_cast<float>(0.5 - 0.5 * e.y / size)};
  }

  static float length(glm::vec3 d, glm::vec3 change, glm::vec2 sides) {
    // Derivative of ½ + ½ (x, y) / (|d| + |z|).
    const float range = glm::length(d);
    const float size = range + std::abs(d.z);
    const float growth = glm::dot(d, change) / range + (d.z < 0.0F ? -change.z : change.z);
    const glm::vec2 on_face = (glm::vec2(change) - glm::vec2(d) * (growth / size)) / size;
    return sides.x * std::sqrt(0.25F * glm::dot(on_face, on_face));
  }
};

/// No projection of directions: (u, v) are their x and y.
struct AtlasMaps {
  static FacePoint point(glm::vec3 d) { return {0, d.x, d.y}; }
  static float length(glm::vec3 /*d*/, glm::vec3 change, glm::vec2 sides) {
    return glm::length(glm::vec2(change) * sides);
  }
};

inline constexpr std::array kMapProjections = {CubeMaps::kTraits, ParaboloidMaps::kTraits};

/// Calls body(CubeMaps{}) for a cube and so on, so that it is compiled for each kind.
template <typename Body>
auto for_kind(TopologyKind kind, const Body& body) {
  switch (kind) {
    case TopologyKind::cube: return body(CubeMaps{});
    case TopologyKind::dual_paraboloid: return body(ParaboloidMaps{});
    case TopologyKind::atlas: break;
  }
  return body(AtlasMaps{});
}

}  // namespace mirrorbake
