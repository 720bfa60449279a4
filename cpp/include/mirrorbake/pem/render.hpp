#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "mirrorbake/envmap/cube_pyramid.hpp"
#include "mirrorbake/image/image.hpp"
#include "mirrorbake/inference/rendering_matrix.hpp"
#include "mirrorbake/proxy/proxy.hpp"
#include "mirrorbake/surface/surface_samples.hpp"

/// The run time in software: the reflector drawn from its environment maps, without tracing reflections
/// ([PEM] §4–5; spec R2).
namespace mirrorbake {

/// Maps of one part of the reflector; views into memory of the caller.
struct PartMaps {
  Proxy local_proxy;
  std::span<const float> local;  ///< texels × 4, premultiplied RGBA; empty: the part has no local layer
  Proxy distant_proxy;
  std::span<const float> distant;  ///< texels × 3
  /// One entry per triangle of the reflector: 0 for those that the local layer leaves out, since they lie on the convex hull
  /// and cannot reflect the object ([PEM] §4, spec G5). Empty: it covers all.
  std::span<const std::uint8_t> local_triangles = {};
};

/// Composites `(L_local + (1−α) L_distant) F + D` for every sample and averages over the pixel. `parts[p]` belongs to part p of
/// the samples, `diffuse` holds D of every sample or is empty (black). Channels R, G, B, A: light from the reflector times coverage, and
/// coverage, so that an image over another is `RGB + (1−A) · background`. Throws InvalidArgument when a part or a length does not fit.
Image render_reflector(const SurfaceSamples& samples, std::span<const PartMaps> parts,
                       const CubePyramidLayout& layout, std::span<const glm::vec3> diffuse,
                       const LookupOptions& options = {});

/// D of every sample from irradiance baked per vertex: albedo/π times the irradiance interpolated over the triangle.
std::vector<glm::vec3> diffuse_from_irradiance(const SurfaceSamples& samples,
                                               std::span<const glm::uvec3> triangles,
                                               std::span<const glm::vec3> vertex_irradiance);

}  // namespace mirrorbake
