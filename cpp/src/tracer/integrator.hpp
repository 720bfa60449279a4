#pragma once

#include <glm/vec3.hpp>

#include "caustic_guide.hpp"
#include "irradiance_cache.hpp"
#include "lights.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "ray_scene.hpp"
#include "sample_stream.hpp"
#include "surface.hpp"

namespace mirrorbake::tracing {

struct World;
struct LitWorld;

/// What limits a path, from TraceOptions.
struct PathLimits {
  int specular_depth = 8;  ///< specular bounces after the first
  int diffuse_depth = 4;   ///< diffuse bounces of IndirectLight::path
};

/// Light that a surface sends towards `surface.view`, of that which does not arrive by a ray in its specular
/// lobe.
struct ScatteredLight {
  glm::vec3 body{0.0F};  ///< radiance that the diffuse body reflects
  /// What next-event estimation finds of the lights for a rough lobe, to be multiplied with
  /// `surface.fresnel`.
  glm::vec3 lobe{0.0F};
};

/// At the surface that is `bounce` specular bounces away from the eye. Shared by all integrators. `lobe` is 0
/// unless the path goes on with a specular bounce.
ScatteredLight scattered_light(const LitWorld& lit, const Surface& surface, const PathLimits& limits,
                               const SampleStream& stream, int bounce);

/// A direction in the specular lobe. The radiance from there is multiplied with `weight` and
/// `surface.fresnel`.
struct SpecularBounce {
  glm::vec3 direction{0.0F};  ///< unit
  glm::vec3 weight{0.0F};     ///< 0 where the lobe reaches below the surface
  float pdf = 0.0F;           ///< density per solid angle; 0: a mirror
};
SpecularBounce specular_bounce(const Surface& surface, glm::vec2 u);
/// With the numbers for the surface `bounce` specular bounces away from the eye.
SpecularBounce specular_bounce(const Surface& surface, const SampleStream& stream, int bounce);

/// Emission of a light, of the sky or of `surface`, which the hit is on, towards the ray's origin. Where
/// next-event estimation could have found it too it is weighted for a direction of density `pdf`; 0: it could
/// not. `how` next-event estimation was done where the ray starts.
glm::vec3 emitted_light(const World& world, const Ray& ray, const Hit& hit, float pdf, NextEvent how);
glm::vec3 emitted_light(const World& world, const Ray& ray, const Hit& hit, const Surface& surface, float pdf,
                        Effort effort);

/// The beauty integrator: radiance that arrives along `ray`, whose closest hit is `hit`, `bounce` specular
/// bounces away from the eye, `pdf` the density of the ray's direction in a rough lobe (0: from the eye or a
/// mirror). Reflections beyond the depth limit are black.
glm::vec3 radiance(const LitWorld& lit, const Ray& ray, const Hit& hit, const PathLimits& limits,
                   const SampleStream& stream, int bounce, float pdf);

/// Irradiance from all lights on the surface's side, by one sample of next-event estimation. With
/// `share_with_cosine` it is weighted (power heuristic) for a partner that samples the cosine.
glm::vec3 direct_irradiance(const World& world, const Surface& surface, glm::vec2 u, bool share_with_cosine);

/// Irradiance that the lights send by way of specular surfaces alone, where the guide knows of any, by one
/// ray.
glm::vec3 caustic_irradiance(const World& world, const CausticGuide& guide, const Surface& surface,
                             const SampleStream& stream);

/// Radiance that a diffuse path finds which leaves `surface` in a random direction: an estimate of π⁻¹ ×
/// irradiance. Includes the partner of next-event estimation of some `effort` at `surface`.
glm::vec3 diffuse_path_radiance(const LitWorld& lit, const Surface& surface, const PathLimits& limits,
                                const SampleStream& stream, int bounce, Effort effort);

}  // namespace mirrorbake::tracing
