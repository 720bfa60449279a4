#pragma once

#include <vector>

#include "mirrorbake/prefilter/convolve.hpp"

namespace mirrorbake {

/// What a GGX surface reflects of a white world, by the angle of view and roughness: the second of the two
/// sums of Karis, "Real Shading in Unreal Engine 4", 2013, with the height-correlated masking of Heitz, JCGT
/// 2014.
struct SplitSum {
  double scale = 0.0;  ///< of the reflectance r₀ at normal incidence
  double bias = 0.0;   ///< r₀ · scale + bias is reflected
};

/// By Schlick's Fresnel. For cos θ = n·v in (0, 1] and α in (0, 1]. Throws InvalidArgument.
SplitSum split_sum(double cosine, double alpha);

/// size × size × 3: rows by perceptual roughness or α as `roughness` says, columns by n·v, both at (i +
/// ½)/size: scale, bias, and their sum E, from which the term for multiple scattering is 1 + r₀ (1/E − 1)
/// (Fdez-Agüera, JCGT 2019, in Filament's form). Throws InvalidArgument for sizes outside of 1…4096.
std::vector<float> split_sum_table(int size, RoughnessScale roughness = RoughnessScale::squared);

}  // namespace mirrorbake
