#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mirrorbake/envmap/texel_topology.hpp"
#include "mirrorbake/image/image.hpp"
#include "mirrorbake/proxy/proxy.hpp"
#include "mirrorbake/surface/run_time_model.hpp"
#include "mirrorbake/surface/surface_samples.hpp"

/// The run time in software: the reflector drawn from its environment maps, without tracing reflections
/// ([PEM] §4–5; spec R2).
namespace mirrorbake {

/// The map of one shell, as a part reads it; views into memory of the caller.
struct ShellMap {
  Proxy proxy;
  TexelTopology topology;
  /// texels × 4, premultiplied RGBA, or texels × 3, which is opaque: nothing behind it shows.
  std::span<const float> texels;
  /// One entry per triangle of the reflector: 0 for those that the shell leaves out, since they lie on the
  /// convex hull and cannot reflect what it holds ([PEM] §4, spec G5). Empty: it covers all.
  std::span<const std::uint8_t> triangles = {};
};

/// Front to back.
using PartShells = std::vector<ShellMap>;

/// Composites `(L₀ + (1 − α₀)(L₁ + …)) F + D` for every sample and averages over the pixel. `parts[p]`
/// belongs to part p of the samples, which lie where `model` looks up; `diffuse` holds D of every sample or
/// is empty (black). Channels R, G, B, A: light from the reflector times coverage, and coverage, so that an
/// image over another is `RGB + (1−A) · background`. Throws InvalidArgument when a part or a length does not
/// fit.
Image render_reflector(const SurfaceSamples& samples, std::span<const PartShells> parts,
                       std::span<const glm::vec3> diffuse, const RunTimeModel& model = reference_run_time());

/// What every sample reads of one shell's map: premultiplied light, not yet times F, and α, which is 0 where
/// the shell leaves the sample's triangle out. For renderers that put the layers together by themselves.
/// Throws as render_reflector does.
std::vector<glm::vec4> shell_light(const SurfaceSamples& samples, const ShellMap& map,
                                   const RunTimeModel& model = reference_run_time());

/// D of every sample from irradiance baked per vertex: albedo/π times the irradiance interpolated over the
/// triangle. Samples that see the back of theirs take `back_irradiance`, unless it is empty.
std::vector<glm::vec3> diffuse_from_irradiance(const SurfaceSamples& samples,
                                               std::span<const glm::uvec3> triangles,
                                               std::span<const glm::vec3> vertex_irradiance,
                                               std::span<const glm::vec3> back_irradiance = {});

/// The same from a lightmap: irradiance in `size`² texels (1…4096) on the texture coordinates `uvs` of the
/// vertices, rows from the top, v up, read bilinearly. Beyond its edge the texels there go on.
std::vector<glm::vec3> diffuse_from_lightmap(const SurfaceSamples& samples,
                                             std::span<const glm::uvec3> triangles,
                                             std::span<const glm::vec2> uvs, int size,
                                             std::span<const glm::vec3> lightmap,
                                             std::span<const glm::vec3> back_lightmap = {});

}  // namespace mirrorbake
