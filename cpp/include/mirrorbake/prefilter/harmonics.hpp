#pragma once

#include <span>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/prefilter/convolve.hpp"

/// Light as spherical harmonics (spec B1; [AEM] eqs. 9–12; Ramamoorthi and Hanrahan, SIGGRAPH 2001).
namespace mirrorbake {

/// Coefficients (order + 1)² × channels, Y(l, m) at l² + l + m: real, orthonormal, polynomials of x, y and z
/// in the order of [AEM] eq. 9 (y, z, x, xy, yz, 3z² − 1, xz, x² − y² …), without the factor (−1)^m of Condon
/// and Shortley.
struct Harmonics {
  static constexpr int kLargestOrder = 8;

  int order = 2;
  int channels = 3;
  std::vector<double> coefficients;
};

/// Throws InvalidArgument for an order outside of 0…8, or another number of coefficients.
void validate(const Harmonics& harmonics);

/// All (order + 1)² functions in a unit direction.
void harmonic_basis(const glm::dvec3& direction, int order, std::span<double> values);

/// ∫ L Y dω, every texel by its middle and its solid angle ([AEM] eq. 11). Throws InvalidArgument for an
/// order outside of 0…8 and for NaN and infinite values, with their number.
Harmonics project_harmonics(const EnvMapView& map, int order);

/// What a cosine lobe multiplies band l by: π, 2π/3, π/4, 0, −π/24 … ([AEM] eq. 12, whose sum ends at 8).
double lambert_factor(int band);

/// Of irradiance, from those of radiance.
Harmonics lambert_harmonics(const Harmonics& radiance);

/// Against ringing. `hanning`: band l by (1 + cos(π l / (order + 1)))/2. `sloan`: by 1/(1 + λ l² (l + 1)²),
/// the least squares fit with a penalty on the Laplacian, with the least λ for which no value on the sphere
/// is below 0 (Sloan, "Stupid Spherical Harmonics Tricks", GDC 2008); λ = 0 if none is.
enum class HarmonicWindow { none, hanning, sloan };

template <>
struct EnumNames<HarmonicWindow> {
  static constexpr std::string_view what = "window";
  static constexpr auto names = enum_names("none", "hanning", "sloan");
};

Harmonics windowed(const Harmonics& harmonics, HarmonicWindow window);

/// What happens to sums below 0, which light cannot have.
enum class NegativeLight { clamp, keep };

template <>
struct EnumNames<NegativeLight> {
  static constexpr std::string_view what = "negative";
  static constexpr auto names = enum_names("clamp", "keep");
};

/// The sums of the harmonics in the directions of the texels.
EnvMap evaluate_harmonics(const Harmonics& harmonics, const PrefilterTarget& target,
                          NegativeLight negative = NegativeLight::clamp);

/// The nine constants of a shader that computes radiance reflected by a white surface, E/π, as c₀ + c₁ y + c₂
/// z + c₃ x + c₄ xy + c₅ yz + c₆ (3z² − 1) + c₇ xz + c₈ (x² − y²): Filament's order. 9 × channels. Throws
/// InvalidArgument for harmonics of an order below 2.
std::vector<double> shader_constants(const Harmonics& radiance);

}  // namespace mirrorbake
