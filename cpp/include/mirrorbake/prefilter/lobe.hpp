#pragma once

#include <string_view>
#include <vector>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/projection/projection.hpp"

/// Radially symmetric lobes (spec B1–B3): weights of light that arrives at an angle γ from the direction of a
/// texel.
namespace mirrorbake {

/// `lambert`: max(0, cos γ), of irradiance ([EMT] eq. 15, [AEM] eq. 4). `phong`: max(0, cos γ)^exponent
/// ([EMT] eq. 17, [AEM] eq. 7). `ggx`: D(h) max(0, cos γ) for a viewer along the normal, the first of the two
/// sums of Karis, "Real Shading in Unreal Engine 4", 2013: D by Walter et al., EGSR 2007 eq. 33, h half-way
/// to the light. `table`: any.
enum class LobeKind { lambert, phong, ggx, table };

template <>
struct EnumNames<LobeKind> {
  static constexpr std::string_view what = "kind";
  static constexpr auto names = enum_names("lambert", "phong", "ggx", "table");
};

struct Lobe {
  LobeKind kind = LobeKind::lambert;
  double exponent = 1.0;  ///< of `phong`, 1…1e6; infinite: the mirror
  double alpha = 1.0;     ///< of `ggx`, 0.01…1, the square of what renderers call roughness; 0: the mirror
  /// Of `table`: weights ≥ 0 at equal steps of γ from 0 to `table_angle`, interpolated by monotone cubics
  /// (Fritsch and Carlson, SIAM J. Numer. Anal. 17, 1980) that are flat at 0; none beyond.
  std::vector<double> table = {};
  double table_angle = 180.0;  ///< degrees, above 0 and up to 180
};

/// `parameter` is the exponent of `phong`, α of `ggx` and the angle of `table`. Throws InvalidArgument as
/// validate.
Lobe make_lobe(LobeKind kind, double parameter, std::vector<double> table = {});

/// Throws InvalidArgument for an exponent, alpha or table outside of these ranges, or a table that is all 0.
void validate(const Lobe& lobe);

/// Whether the lobe is a single direction.
bool is_mirror(const Lobe& lobe);

/// The weight at an angle with this cosine; D without its factor 1/(π α²), so that it is 1 at γ = 0.
double lobe_weight(const Lobe& lobe, double cosine);

/// ∫ weight dω over the sphere, to a relative 1e-7 if the weight has no step; of Phong 2π/(exponent + 1). A
/// mirror's is 0.
double lobe_integral(const Lobe& lobe);

/// α of the microfacets whose highlight is as wide as Phong's: √(2/(exponent + 2)) (Walter et al., after eq.
/// 31).
double alpha_from_exponent(double exponent);
double exponent_from_alpha(double alpha);

/// Weights at one angle.
struct LobeDerivatives {
  double weight = 0.0;
  double first = 0.0;   ///< d weight / d cos γ
  double second = 0.0;  ///< d² weight / (d cos γ)²
};

/// By sin(γ/2), which is exact where the cosine has lost all digits.
LobeDerivatives lobe_derivatives(const Lobe& lobe, double sine_of_half);

}  // namespace mirrorbake
