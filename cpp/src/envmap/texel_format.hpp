#pragma once

#include <cstdint>
#include <span>

/// How files of maps with their levels store texels, and what they are as radiance.
namespace mirrorbake {

enum class TexelCode { half, float32, unorm8, unorm16, rgb9e5, r11g11b10, bc6h_unsigned, bc6h_signed };

struct TexelFormat {
  TexelCode code = TexelCode::float32;
  int channels = 0;
  bool is_srgb = false;        ///< what is stored of colours is their sRGB code
  bool blue_is_first = false;  ///< B, G, R and A

  bool is_integer() const { return code == TexelCode::unorm8 || code == TexelCode::unorm16; }
};

/// Bytes of an image of width × height texels, of blocks those that it takes.
std::uint64_t stored_bytes(const TexelFormat& format, int width, int height);

/// Texels of an image from the bytes that hold it, width × height × format.channels values. Alpha is left as
/// it is. Every pattern of bits is a value; of floats it may be NaN or infinite.
void decode_texels(const TexelFormat& format, int width, int height, std::span<const unsigned char> stored,
                   std::span<float> values);

/// Multiplies the colours of texels of four channels by their alpha.
void multiply_by_alpha(std::span<float> values);

}  // namespace mirrorbake
