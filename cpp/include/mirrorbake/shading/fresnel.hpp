#pragma once

#include <span>
#include <string_view>
#include <glm/vec3.hpp>

#include "mirrorbake/core/enum_names.hpp"

/// Fresnel reflectance of smooth surfaces, unpolarised. In every function `c` is the cosine n·v on the side
/// the light comes from. It is clamped to [0,1] and may be anything; a NaN gives NaN. The answer is in [0,1].
///
/// Accuracy, over the whole domain, against 50 digits (docs/reference/fresnel.md): float within 4 ulp + 1e-7,
/// double within 4 ulp + 1e-15. The functions of one value and those of arrays with the same parameters for
/// all give the same bits, on every instruction set and number of threads.
namespace mirrorbake {

/// Schlick's approximation r0 + (1 − r0)(1 − c)⁵ (Schlick 1994; spec F1), r0 in [0,1].
float fresnel_schlick(float c, float r0);
double fresnel_schlick(double c, double r0);

/// Dielectric of relative index `ior` = n_transmitted / n_incident > 0 ([EMT] eq. 13; spec F2). 1 on total
/// internal reflection; 0 for ior = 1, where there is no interface. In double, ior in [1e-100, 1e100].
float fresnel_dielectric(float c, float ior);
double fresnel_dielectric(double c, double ior);

/// What a dielectric lets through, 1 − F, with full relative accuracy where F is close to 1.
float fresnel_dielectric_transmittance(float c, float ior);
double fresnel_dielectric_transmittance(double c, double ior);

/// Conductor of complex relative index eta + i k, eta > 0, k ≥ 0 (spec F3). k = 0 is fresnel_dielectric. In
/// double, eta and k up to 1e40, and a k below 1e-100 counts as 0.
float fresnel_conductor(float c, float eta, float k);
double fresnel_conductor(double c, double eta, double k);

/// The same for arrays: `f[i]` from `c[i]`, on several threads where it pays. `f` has the size of `c` and
/// does not overlap any input. Throw InvalidArgument when sizes differ, arrays overlap or a parameter is out
/// of the range above (unlike the functions of one value, which check nothing).
void fresnel_schlick(std::span<const float> c, float r0, std::span<float> f);
void fresnel_schlick(std::span<const double> c, double r0, std::span<double> f);
void fresnel_dielectric(std::span<const float> c, float ior, std::span<float> f);
void fresnel_dielectric(std::span<const double> c, double ior, std::span<double> f);
void fresnel_conductor(std::span<const float> c, float eta, float k, std::span<float> f);
void fresnel_conductor(std::span<const double> c, double eta, double k, std::span<double> f);

/// The same with parameters per element, all arrays of one size. They compute in double, so float
/// results may differ from those above in the last places.
void fresnel_schlick(std::span<const float> c, std::span<const float> r0, std::span<float> f);
void fresnel_schlick(std::span<const double> c, std::span<const double> r0, std::span<double> f);
void fresnel_dielectric(std::span<const float> c, std::span<const float> ior, std::span<float> f);
void fresnel_dielectric(std::span<const double> c, std::span<const double> ior, std::span<double> f);
void fresnel_conductor(std::span<const float> c, std::span<const float> eta, std::span<const float> k,
                       std::span<float> f);
void fresnel_conductor(std::span<const double> c, std::span<const double> eta, std::span<const double> k,
                       std::span<double> f);

/// Which Fresnel model a material uses, with its parameters per colour channel.
enum class FresnelModel { constant, schlick, dielectric, conductor };

template <>
struct EnumNames<FresnelModel> {
  static constexpr std::string_view what = "model";
  static constexpr auto names = enum_names("constant", "schlick", "dielectric", "conductor");
};

struct Fresnel {
  FresnelModel model = FresnelModel::constant;
  glm::vec3 r0{0.0F};   ///< constant: reflectance; schlick: reflectance at normal incidence, in [0,1]
  glm::vec3 eta{1.5F};  ///< dielectric and conductor: real part of the relative index, > 0
  glm::vec3 k{0.0F};    ///< conductor: extinction coefficient, ≥ 0
};

/// Reflectance per channel, each in [0,1].
glm::vec3 evaluate(const Fresnel& fresnel, float c);

/// Reflectance per channel for every cosine: `f[i]` has the bits of evaluate(fresnel, c[i]). Throws
/// InvalidArgument as the functions of arrays above.
void evaluate(const Fresnel& fresnel, std::span<const float> c, std::span<glm::vec3> f);

}  // namespace mirrorbake
