#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mirrorbake/envmap/envmap.hpp"

namespace mirrorbake {

/// An environment map in half the memory (spec E1): IEEE 754 binary16, in the order of EnvMapLayout. For
/// keeping and handing on; everything that computes takes float.
struct HalfEnvMap {
  EnvMapLayout layout;
  std::vector<std::uint16_t> values;
  std::vector<std::string> channels;  ///< names, layout.channels of them, or none
};

/// Rounds to nearest even; values beyond ±65504 are clamped to it and counted in `clamped`, NaN stays NaN.
/// Throws InvalidArgument for a map that is not valid.
HalfEnvMap half_from_float(const EnvMapView& map, std::size_t* clamped = nullptr);

/// Exact. Throws InvalidArgument if the number of values does not fit the layout.
EnvMap float_from_half(const HalfEnvMap& map);

}  // namespace mirrorbake
