#pragma once

#include <span>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/surface/surface_samples.hpp"

namespace mirrorbake {

/// A surface as its texture sees it: the image is a map of `size`² texels (1…4096) on the texture
/// coordinates, u to the right and v up, and the samples of a texel are the points of the surface at
/// `per_side`² (1…8) places of it, where a triangle has any. What places on several triangles show is the
/// first one's.
///
/// Like the result of `with_vertex_lookups` they are to be read through an infinite proxy: `reflection` holds
/// the coordinates from the top left, (u, 1 − v, 0), without differentials. All are of part 0, and have no
/// normals, Fresnel terms and albedos.
///
/// `positions`, `uvs`: one per vertex. Throws InvalidArgument for sizes, lengths and indices that do not fit,
/// and for coordinates that are not finite.
SurfaceSamples texture_samples(std::span<const glm::vec3> positions, std::span<const glm::uvec3> triangles,
                               std::span<const glm::vec2> uvs, int size, int per_side);

}  // namespace mirrorbake
