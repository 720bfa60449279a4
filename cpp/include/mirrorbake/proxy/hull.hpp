#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

/// View-independent split of a reflector's polygons (spec G5; [PEM] §4 "Layered EMs").
namespace mirrorbake {

/// Rounding of vertices to float turns the plane of a small triangle; a dent shallower than this fraction of
/// the bounding box's diagonal does not count as one.
inline constexpr double kHullTolerance = 1e-4;

/// For every triangle 1 if it lies on the mesh's convex hull, else 0. A triangle is on the hull if no vertex
/// of the mesh is in front of its plane by more than `tolerance` times the diagonal of the bounding box:
/// nothing of the object can then be seen from it, at whatever angle, and it needs the distant layer only.
/// Triangles face counter-clockwise; those without area are not on the hull.
///
/// Throws InvalidArgument for indices out of range, coordinates that are not finite, and a negative
/// tolerance.
std::vector<std::uint8_t> hull_triangles(std::span<const glm::vec3> positions,
                                         std::span<const glm::uvec3> triangles,
                                         double tolerance = kHullTolerance);

}  // namespace mirrorbake
