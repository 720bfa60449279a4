#include "mirrorbake/image/color.hpp"

#include <cmath>

namespace mirrorbake {

float srgb_encode(float linear) {
  if (!(linear > 0.0F)) return 0.0F;
  if (linear >= 1.0F) return 1.0F;
  return linear <= 0.0031308F ? 12.92F * linear : 1.055F * std::pow(linear, 1.0F / 2.4F) - 0.055F;
}

float srgb_decode(float encoded) {
  return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}

}  // namespace mirrorbake
