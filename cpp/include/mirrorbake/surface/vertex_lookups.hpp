#pragma once

#include <span>

#include <glm/vec3.hpp>

#include "mirrorbake/surface/surface_samples.hpp"

namespace mirrorbake {

/// Samples that read a map at coordinates given at the vertices and interpolated over every triangle, as
/// graphics hardware does: texture coordinates of the surface ([PEM] figure 7), or lookups on a proxy,
/// computed once a vertex ([PEM] §5).
///
/// The result is to be read through an infinite proxy, which takes `reflection` as it is: it holds the
/// interpolated lookup, not a unit vector, and its differentials are those of the interpolation. All else
/// stays.
///
/// `positions`, `lookups`: one per vertex of the reflector, where it stood when the samples were taken; of
/// texture coordinates (u, v, 0). `triangles`: of the reflector. Along a triangle without area nothing
/// changes. Throws InvalidArgument for lengths and indices that do not fit.
SurfaceSamples with_vertex_lookups(const SurfaceSamples& samples, std::span<const glm::vec3> positions,
                                   std::span<const glm::uvec3> triangles, std::span<const glm::vec3> lookups);

}  // namespace mirrorbake
