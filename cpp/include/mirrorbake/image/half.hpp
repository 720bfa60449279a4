#pragma once

#include <cstdint>

namespace mirrorbake {

/// IEEE 754 binary16 bits of a value, rounded to nearest even; beyond ±65504 (after rounding) infinity, NaN stays NaN.
std::uint16_t half_from_float(float value);

/// Exact.
float float_from_half(std::uint16_t bits);

}  // namespace mirrorbake
