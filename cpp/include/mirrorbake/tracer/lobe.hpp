#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/scene/scene.hpp"

/// Rough specular lobes without their Fresnel term. Directions are unit vectors in a frame whose z is the
/// surface's normal; `view` points to the eye and `light` to where the light comes from, both away from the
/// surface.
///
/// `ggx`: microfacets with normals after Trowbridge and Reitz, masked and shadowed independently by Smith's
/// terms, G₁(v)·G₁(l) (Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007).
/// Light is reflected once: what the facets hide is lost, at normal incidence 1 % for α = 0.1 and ln 2 for α
/// = 1.
/// `phong`: (N+1)/(2π)·(r·l)^N per solid angle, the cosine to the surface's normal included; what falls below
/// the horizon is lost. It is the filter of prefiltered Phong maps ([EMT] §3.2), and not reciprocal.
namespace mirrorbake {

struct LobeShape {
  SpecularLobe lobe = SpecularLobe::ggx;  ///< not `mirror`, which has no density
  float roughness = 0.1F;                 ///< α of `ggx`, in (0,1]
  float exponent = 100.0F;                ///< N of `phong`, in [1, 1e6]
};

/// Reflected per incident radiance, times the cosine of `light` to the normal, for F = 1 (sr⁻¹). 0 below the
/// horizon.
float lobe_response(const LobeShape& shape, glm::vec3 view, glm::vec3 light);

/// A direction with the density lobe_density: from the visible normals (Heitz, "Sampling the GGX distribution
/// of visible normals", JCGT 7(4), 2018) or from (r·l)^N. It may lie below the horizon. `u` in [0,1)².
glm::vec3 sample_lobe(const LobeShape& shape, glm::vec3 view, glm::vec2 u);

/// Density per solid angle of sample_lobe. The response is never more than the density.
float lobe_density(const LobeShape& shape, glm::vec3 view, glm::vec3 light);

/// Cosine at which the lobe's facets reflect `light` to `view`, the argument of their Fresnel term: that of
/// the half vector for `ggx`, that of the normal for `phong`.
float lobe_fresnel_cosine(const LobeShape& shape, glm::vec3 view, glm::vec3 light);

}  // namespace mirrorbake
