#pragma once

#include <span>
#include <string_view>

#include <glm/vec3.hpp>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/shading/fresnel.hpp"

/// Metals from measured optical constants: spectra, their colour, and the models of fresnel.hpp closest to
/// it.
namespace mirrorbake {

enum class Metal { aluminium, silver, gold, copper, chromium, titanium };

/// "aluminium", "silver", …
std::string_view to_string(Metal metal);

/// The metal of that name or chemical symbol ("gold", "Au"). Throws InvalidArgument for any other.
Metal parse_metal(std::string_view name);

/// All metals, in the order of the enum.
std::span<const Metal> all_metals();

/// Measured complex refractive index η + ik in air at rising wavelengths that enclose 380 to 780 nm; linear
/// between.
struct OpticalConstants {
  struct Entry {
    double wavelength;  ///< nm
    double eta;
    double k;
  };
  std::span<const Entry> entries;
  std::string_view source;  ///< publication
};

OpticalConstants optical_constants(Metal metal);

/// Light in which a colour is seen: CIE standard illuminant D65 or the equal-energy illuminant E.
enum class Illuminant { d65, e };

template <>
struct EnumNames<Illuminant> {
  static constexpr std::string_view what = "illuminant";
  static constexpr auto names = enum_names("D65", "E");
};

/// Reflectance at cosine `c` as linear Rec.709: R, G, B of the reflected light over those of the light
/// itself, CIE 1931 2° observer, 380 to 780 nm in steps of 5 nm. A mirror of reflectance 1 is (1, 1, 1) under
/// either illuminant. A saturated metal may leave the gamut: gold's red is 1.04.
glm::dvec3 metal_reflectance(Metal metal, double c, Illuminant illuminant = Illuminant::d65);

/// Models of three channels that stand for the spectral curve, each with its largest deviation from
/// metal_reflectance over all c, per channel.
struct MetalFit {
  Fresnel schlick;  ///< least squares over c; r0 in [0,1]
  glm::dvec3 schlick_error{0.0};
  Fresnel conductor;  ///< effective η + ik per channel, least squares over c
  glm::dvec3 conductor_error{0.0};
};

MetalFit fit_metal(Metal metal, Illuminant illuminant = Illuminant::d65);

}  // namespace mirrorbake
