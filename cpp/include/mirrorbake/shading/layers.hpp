#pragma once

#include <glm/vec3.hpp>

/// How reflectance F puts radiance layers together (spec F5). F is per channel, in [0,1].
namespace mirrorbake {

/// F·L_m + L_d: mirror radiance over an independent diffuse layer ([PEM] §3).
inline glm::vec3 combine_layers(glm::vec3 f, glm::vec3 mirror, glm::vec3 diffuse) {
  return f * mirror + diffuse;
}

/// F·L_m + (1 − F)·L_d: a diffuse base under a smooth coat, which gets what the coat lets through ([EMT] §3.1.1). With
/// a prefiltered Phong map as `mirror` and an irradiance map as `base` it is [AEM] eq. 8.
inline glm::vec3 combine_coated(glm::vec3 f, glm::vec3 mirror, glm::vec3 base) {
  return f * mirror + (glm::vec3(1.0F) - f) * base;
}

}  // namespace mirrorbake
