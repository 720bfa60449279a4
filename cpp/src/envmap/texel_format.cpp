#include "texel_format.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "bc6h.hpp"
#include "mirrorbake/image/color.hpp"
#include "mirrorbake/image/half.hpp"

namespace mirrorbake {
namespace {

bool is_of_blocks(TexelCode code) {
  return code == TexelCode::bc6h_unsigned || code == TexelCode::bc6h_signed;
}

std::size_t bytes_of_texel(const TexelFormat& format) {
  const std::size_t channels = static_cast<std::size_t>(format.channels);
  switch (format.code) {
    case TexelCode::unorm8: return channels;
    case TexelCode::half:
    case TexelCode::unorm16: return 2 * channels;
    case TexelCode::float32: return 4 * channels;
    case TexelCode::rgb9e5:
    case TexelCode::r11g11b10: return 4;
    case TexelCode::bc6h_unsigned:
    case TexelCode::bc6h_signed: break;
  }
  return 0;
}

template <typename T>
T load(const unsigned char* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

// Vulkan, "Unsigned 11-Bit and 10-Bit Floating-Point Numbers": a half float without its sign and last bits.
float small_float(std::uint32_t bits, unsigned int dropped) {
  return float_from_half(static_cast<std::uint16_t>(bits << dropped));
}

// Vulkan, "Shared Exponent to RGB": 9 bits of each channel, the common exponent in the upper 5.
void decode_rgb9e5(std::uint32_t bits, float* to) {
  const int exponent = static_cast<int>(bits >> 27U) - 15 - 9;
  for (unsigned int c = 0; c < 3; ++c) {
    to[c] = std::ldexp(static_cast<float>(bits >> 9U * c & 0x1ffU), exponent);
  }
}

void decode_r11g11b10(std::uint32_t bits, float* to) {
  to[0] = small_float(bits & 0x7ffU, 4);
  to[1] = small_float(bits >> 11U & 0x7ffU, 4);
  to[2] = small_float(bits >> 22U, 5);
}

// Blocks of 4 × 4 texels; those of the last ones that lie beyond the image are left out.
void decode_blocks(bool is_signed, std::size_t width, std::size_t height,
                   std::span<const unsigned char> stored, std::span<float> values) {
  const std::size_t across = (width + 3) / 4;
  std::array<std::uint16_t, 48> halves{};
  for (std::size_t block = 0; block < stored.size() / kBc6hBytes; ++block) {
    decode_bc6h(stored.subspan(block * kBc6hBytes).first<kBc6hBytes>(), is_signed, halves);
    for (std::size_t texel = 0; texel < 16; ++texel) {
      const std::size_t row = block / across * 4 + texel / 4;
      const std::size_t column = block % across * 4 + texel % 4;
      if (row >= height || column >= width) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        values[(row * width + column) * 3 + c] = float_from_half(halves[3 * texel + c]);
      }
    }
  }
}

// One value per channel, `bytes` each, by read(place).
template <typename Read>
void decode_channels(const TexelFormat& format, std::size_t bytes, std::span<const unsigned char> stored,
                     std::span<float> values, const Read& read) {
  const std::size_t channels = static_cast<std::size_t>(format.channels);
  for (std::size_t i = 0; i < values.size(); i += channels) {
    for (std::size_t c = 0; c < channels; ++c) {
      const std::size_t from = format.blue_is_first && c < 3 ? 2 - c : c;
      const bool is_colour = channels == 2 || c < 3;
      values[i + c] = read(stored.data() + (i + from) * bytes, format.is_srgb && is_colour);
    }
  }
}

}  // namespace

std::uint64_t stored_bytes(const TexelFormat& format, int width, int height) {
  const auto w = static_cast<std::uint64_t>(width);
  const auto h = static_cast<std::uint64_t>(height);
  if (is_of_blocks(format.code)) return (w + 3) / 4 * ((h + 3) / 4) * kBc6hBytes;
  return w * h * bytes_of_texel(format);
}

void decode_texels(const TexelFormat& format, int width, int height, std::span<const unsigned char> stored,
                   std::span<float> values) {
  switch (format.code) {
    case TexelCode::half:
      decode_channels(format, 2, stored, values,
                      [](const unsigned char* p, bool) { return float_from_half(load<std::uint16_t>(p)); });
      return;
    case TexelCode::float32:
      decode_channels(format, 4, stored, values, [](const unsigned char* p, bool) { return load<float>(p); });
      return;
    case TexelCode::unorm8: {
      std::array<float, 256> linear{};
      std::array<float, 256> decoded{};
      for (std::size_t i = 0; i < linear.size(); ++i) {
        linear[i] = static_cast<float>(i) / 255.0F;
        decoded[i] = srgb_decode(linear[i]);
      }
      decode_channels(format, 1, stored, values, [&](const unsigned char* p, bool is_srgb) {
        return is_srgb ? decoded[*p] : linear[*p];
      });
      return;
    }
    case TexelCode::unorm16:
      decode_channels(format, 2, stored, values, [](const unsigned char* p, bool is_srgb) {
        const float value = static_cast<float>(load<std::uint16_t>(p)) / 65535.0F;
        return is_srgb ? srgb_decode(value) : value;
      });
      return;
    case TexelCode::rgb9e5:
    case TexelCode::r11g11b10:
      for (std::size_t i = 0; i < values.size() / 3; ++i) {
        const auto bits = load<std::uint32_t>(stored.data() + 4 * i);
        (format.code == TexelCode::rgb9e5 ? decode_rgb9e5 : decode_r11g11b10)(bits, values.data() + 3 * i);
      }
      return;
    case TexelCode::bc6h_unsigned:
    case TexelCode::bc6h_signed:
      decode_blocks(format.code == TexelCode::bc6h_signed, static_cast<std::size_t>(width),
                    static_cast<std::size_t>(height), stored, values);
      return;
  }
}

void multiply_by_alpha(std::span<float> values) {
  for (std::size_t i = 0; i + 3 < values.size(); i += 4) {
    for (std::size_t c = 0; c < 3; ++c) values[i + c] *= values[i + 3];
  }
}

}  // namespace mirrorbake
