#pragma once

#include <cmath>
#include <cstdint>

namespace mirrorbake {

/// IEEE 754 binary16 bits of a value, rounded to nearest even; beyond ±65504 (after rounding) infinity, NaN
/// stays NaN.
std::uint16_t half_from_float(float value);

/// The value, or ±65504 if it is beyond that, the largest half; `clamped` counts those that are. NaN stays
/// NaN.
inline float clamp_to_half(float value, std::uint64_t& clamped) {
  constexpr float kLargest = 65504.0F;
  if (!(std::abs(value) > kLargest)) return value;
  ++clamped;
  return std::copysign(kLargest, value);
}

/// Exact.
float float_from_half(std::uint16_t bits);

}  // namespace mirrorbake
