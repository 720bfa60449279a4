#pragma once

#include <glm/vec3.hpp>

#include "irradiance_cache.hpp"
#include "lights.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "ray_scene.hpp"
#include "sample_stream.hpp"
#include "surface.hpp"

namespace mirrorbake::tracing {

struct World;

/// What limits a path, from TraceOptions.
struct PathLimits {
  int specular_depth = 8;  ///< mirror bounces after the first
  int diffuse_depth = 4;   ///< diffuse bounces of IndirectLight::path
};

/// Radiance that a diffuse body sends towards `surface.view` (plus what the surface emits), `bounce` mirror
/// bounces away from the eye. Shared by all integrators.
glm::vec3 body_radiance(const World& world, const Surface& surface, const PathLimits& limits,
                        const SampleStream& stream, int bounce);

/// The beauty integrator: radiance that arrives along `ray`, whose closest hit is `hit`, `bounce` mirror
/// bounces away from the eye. Follows mirrors up to the depth limit; mirrors beyond it are black.
glm::vec3 radiance(const World& world, const Ray& ray, const Hit& hit, const PathLimits& limits,
                   const SampleStream& stream, int bounce);

/// Irradiance from all lights on the surface's side, by one sample of next-event estimation. With
/// `share_with_cosine` it is weighted (power heuristic) for a partner that samples the cosine.
glm::vec3 direct_irradiance(const World& world, const Surface& surface, glm::vec2 u, bool share_with_cosine);

/// Radiance that a diffuse path finds which leaves `surface` in a random direction: an estimate of π⁻¹ ×
/// irradiance. Includes the partner of `direct_irradiance` with `share_with_cosine`.
glm::vec3 diffuse_path_radiance(const World& world, const Surface& surface, const PathLimits& limits,
                                const SampleStream& stream, int bounce);

}  // namespace mirrorbake::tracing
