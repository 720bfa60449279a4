#pragma once

#include "mirrorbake/envmap/envmap.hpp"

namespace mirrorbake {

/// How two maps differ, all channels together, texels weighted by their solid angle.
struct Comparison {
  double max_error = 0.0;      ///< largest |a − b|
  double mean_error = 0.0;     ///< mean |a − b| over the sphere
  double rms_error = 0.0;      ///< √ mean (a − b)²
  double relative_l2 = 0.0;    ///< rms_error over √ mean b²; 0 if both are 0, infinite if only b is
  double psnr = 0.0;           ///< 20 log10(largest |b| / rms_error), in dB; infinite for equal maps
  double flux_ratio = 1.0;     ///< ∫a dω / ∫b dω
  std::size_t not_finite = 0;  ///< texel values that are NaN or infinite in either map, left out of the rest
};

/// The finest level of `a` against the reference `b`. Throws InvalidArgument unless projection, size and
/// channels agree.
Comparison compare(const EnvMapView& a, const EnvMapView& b);

}  // namespace mirrorbake
