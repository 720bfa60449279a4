#pragma once

#include <glm/vec3.hpp>

/// Fresnel reflectance. `c` is always the cosine n·v on the incident side.
namespace mirrorbake {

/// Schlick's approximation r0 + (1 − r0)(1 − c)⁵ ([PEM] §5; spec F1).
float fresnel_schlick(float c, float r0);

/// Unpolarised reflectance of a dielectric of relative index `ior` = n_transmitted / n_incident
/// ([EMT] eq. 13; spec F2). 1 on total internal reflection.
float fresnel_dielectric(float c, float ior);

/// Unpolarised reflectance of a conductor of complex index eta + i k (spec F3).
float fresnel_conductor(float c, float eta, float k);

/// Which Fresnel model a material uses, with its parameters per colour channel.
enum class FresnelModel { constant, schlick, dielectric, conductor };

struct Fresnel {
  FresnelModel model = FresnelModel::constant;
  glm::vec3 r0{0.0F};   ///< constant: reflectance; schlick: reflectance at normal incidence, in [0,1]
  glm::vec3 eta{1.5F};  ///< dielectric and conductor: real part of the relative index, > 0
  glm::vec3 k{0.0F};    ///< conductor: extinction coefficient, ≥ 0
};

/// Reflectance per channel, each in [0,1].
glm::vec3 evaluate(const Fresnel& fresnel, float c);

}  // namespace mirrorbake
