// Microsoft, "BC6H Format", Direct3D 11 documentation: the tables and every step below.
#include "bc6h.hpp"

#include <array>
#include <string_view>

namespace mirrorbake {
namespace {

// Bits of a block, the lowest of its first byte first.
class Bits {
 public:
  explicit Bits(std::span<const std::uint8_t, kBc6hBytes> block) : block_(block) {}
  int take(int count) {
    int value = 0;
    for (int i = 0; i < count; ++i, ++at_) value |= (block_[at_ / 8] >> (at_ % 8) & 1) << i;
    return value;
  }

 private:
  std::span<const std::uint8_t, kBc6hBytes> block_;
  std::size_t at_ = 0;
};

// In `fields`, in the order of the bits: channel (r, g, b), end point (w and x of the first region, y and z
// of the second), lowest bit, and how many follow: + upwards, r from the highest down.
struct Mode {
  int code;
  int bits;                  // of the first end point
  std::array<int, 3> delta;  // bits of the others, by channel
  bool is_delta;             // whether these are differences from the first
  std::string_view fields;
};

constexpr std::array<Mode, 14> kModes = {{
    {0,
     10,
     {5, 5, 5},
     true,
     "gy4+1 by4+1 bz4+1 rw0+10 gw0+10 bw0+10 rx0+5 gz4+1 gy0+4 gx0+5 bz0+1 gz0+4 bx0+5 bz1+1 by0+4 ry0+5 "
     "bz2+1 rz0+5 bz3+1"},
    {1,
     7,
     {6, 6, 6},
     true,
     "gy5+1 gz4+1 gz5+1 rw0+7 bz0+1 bz1+1 by4+1 gw0+7 by5+1 bz2+1 gy4+1 bw0+7 bz3+1 bz5+1 bz4+1 rx0+6 gy0+4 "
     "gx0+6 gz0+4 bx0+6 by0+4 ry0+6 rz0+6"},
    {2,
     11,
     {5, 4, 4},
     true,
     "rw0+10 gw0+10 bw0+10 rx0+5 rw10+1 gy0+4 gx0+4 gw10+1 bz0+1 gz0+4 bx0+4 bw10+1 bz1+1 by0+4 ry0+5 bz2+1 "
     "rz0+5 bz3+1"},
    {6,
     11,
     {4, 5, 4},
     true,
     "rw0+10 gw0+10 bw0+10 rx0+4 rw10+1 gz4+1 gy0+4 gx0+5 gw10+1 gz0+4 bx0+4 bw10+1 bz1+1 by0+4 ry0+4 bz0+1 "
     "bz2+1 rz0+4 gy4+1 bz3+1"},
    {10,
     11,
     {4, 4, 5},
     true,
     "rw0+10 gw0+10 bw0+10 rx0+4 rw10+1 by4+1 gy0+4 gx0+4 gw10+1 bz0+1 gz0+4 bx0+5 bw10+1 by0+4 ry0+4 bz1+1 "
     "bz2+1 rz0+4 bz4+1 bz3+1"},
    {14,
     9,
     {5, 5, 5},
     true,
     "rw0+9 by4+1 gw0+9 gy4+1 bw0+9 bz4+1 rx0+5 gz4+1 gy0+4 gx0+5 bz0+1 gz0+4 bx0+5 bz1+1 by0+4 ry0+5 bz2+1 "
     "rz0+5 bz3+1"},
    {18,
     8,
     {6, 5, 5},
     true,
     "rw0+8 gz4+1 by4+1 gw0+8 bz2+1 gy4+1 bw0+8 bz3+1 bz4+1 rx0+6 gy0+4 gx0+5 bz0+1 gz0+4 bx0+5 bz1+1 by0+4 "
     "ry0+6 rz0+6"},
    {22,
     8,
     {5, 6, 5},
     true,
     "rw0+8 bz0+1 by4+1 gw0+8 gy5+1 gy4+1 bw0+8 gz5+1 bz4+1 rx0+5 gz4+1 gy0+4 gx0+6 gz0+4 bx0+5 bz1+1 by0+4 "
     "ry0+5 bz2+1 rz0+5 bz3+1"},
    {26,
     8,
     {5, 5, 6},
     true,
     "rw0+8 bz1+1 by4+1 gw0+8 by5+1 gy4+1 bw0+8 bz5+1 bz4+1 rx0+5 gz4+1 gy0+4 gx0+5 bz0+1 gz0+4 bx0+6 by0+4 "
     "ry0+5 bz2+1 rz0+5 bz3+1"},
    {30,
     6,
     {6, 6, 6},
     false,
     "rw0+6 gz4+1 bz0+1 bz1+1 by4+1 gw0+6 gy5+1 by5+1 bz2+1 gy4+1 bw0+6 gz5+1 bz3+1 bz5+1 bz4+1 rx0+6 gy0+4 "
     "gx0+6 gz0+4 bx0+6 by0+4 ry0+6 rz0+6"},
    {3, 10, {10, 10, 10}, false, "rw0+10 gw0+10 bw0+10 rx0+10 gx0+10 bx0+10"},
    {7, 11, {9, 9, 9}, true, "rw0+10 gw0+10 bw0+10 rx0+9 rw10+1 gx0+9 gw10+1 bx0+9 bw10+1"},
    {11, 12, {8, 8, 8}, true, "rw0+10 gw0+10 bw0+10 rx0+8 rw10r2 gx0+8 gw10r2 bx0+8 bw10r2"},
    {15, 16, {4, 4, 4}, true, "rw0+10 gw0+10 bw0+10 rx0+4 rw10r6 gx0+4 gw10r6 bx0+4 bw10r6"},
}};

// Of two regions: which texels, row by row from the lowest bit, are in the second, and which of them has an
// index of one bit less.
struct Partition {
  std::uint16_t second;
  int anchor;
};
constexpr std::array<Partition, 32> kPartitions = {{
    {0xcccc, 15}, {0x8888, 15}, {0xeeee, 15}, {0xecc8, 15}, {0xc880, 15}, {0xfeec, 15}, {0xfec8, 15},
    {0xec80, 15}, {0xc800, 15}, {0xffec, 15}, {0xfe80, 15}, {0xe800, 15}, {0xffe8, 15}, {0xff00, 15},
    {0xfff0, 15}, {0xf000, 15}, {0xf710, 15}, {0x008e, 2},  {0x7100, 8},  {0x08ce, 2},  {0x008c, 2},
    {0x7310, 8},  {0x3100, 8},  {0x8cce, 15}, {0x088c, 2},  {0x3110, 8},  {0x6666, 2},  {0x366c, 2},
    {0x17e8, 8},  {0x0ff0, 8},  {0x718e, 2},  {0x399c, 2},
}};

constexpr std::array<int, 8> kWeights3 = {0, 9, 18, 27, 37, 46, 55, 64};
constexpr std::array<int, 16> kWeights4 = {0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64};

using EndPoints = std::array<std::array<int, 3>, 4>;

void read_fields(std::string_view fields, Bits& bits, EndPoints& points) {
  const auto number = [&](std::size_t& at) {
    int value = 0;
    for (; at < fields.size() && fields[at] >= '0' && fields[at] <= '9'; ++at) {
      value = 10 * value + (fields[at] - '0');
    }
    return value;
  };
  for (std::size_t at = 0; at < fields.size(); ++at) {
    const std::size_t channel = fields[at] == 'r' ? 0U : fields[at] == 'g' ? 1U : 2U;
    int& value = points[static_cast<std::size_t>(fields[at + 1] - 'w')][channel];
    at += 2;
    const int low = number(at);
    const bool reversed = fields[at++] == 'r';
    const int count = number(at);
    for (int i = 0; i < count; ++i) value |= bits.take(1) << (low + (reversed ? count - 1 - i : i));
  }
}

int sign_extended(int value, int bits) { return value - ((value >> (bits - 1) & 1) << bits); }

int unquantized(int value, int bits, bool is_signed) {
  if (!is_signed) {
    if (bits >= 15 || value == 0) return value;
    return value == (1 << bits) - 1 ? 0xffff : ((value << 16) + 0x8000) >> bits;
  }
  if (bits >= 16 || value == 0) return value;
  const int size = value < 0 ? -value : value;
  const int wide = size >= (1 << (bits - 1)) - 1 ? 0x7fff : ((size << 15) + 0x4000) >> (bits - 1);
  return value < 0 ? -wide : wide;
}

std::uint16_t finished(int value, bool is_signed) {
  if (!is_signed) return static_cast<std::uint16_t>(value * 31 >> 6);
  const int size = (value < 0 ? -value : value) * 31 >> 5;
  return static_cast<std::uint16_t>(value < 0 && size > 0 ? 0x8000 | size : size);
}

}  // namespace

void decode_bc6h(std::span<const std::uint8_t, kBc6hBytes> block, bool is_signed,
                 std::span<std::uint16_t, 48> halves) {
  Bits bits(block);
  int code = bits.take(2);
  if (code > 1) code |= bits.take(3) << 2;
  const Mode* mode = nullptr;
  for (const Mode& candidate : kModes) {
    if (candidate.code == code) mode = &candidate;
  }
  if (mode == nullptr) {
    for (std::uint16_t& half : halves) half = 0;
    return;
  }
  EndPoints points{};
  read_fields(mode->fields, bits, points);
  const bool two_regions = (code & 3) != 3;
  const Partition partition =
      two_regions ? kPartitions[static_cast<std::size_t>(bits.take(5))] : Partition{0, 0};
  for (std::size_t point = 0; point < 4; ++point) {
    for (std::size_t c = 0; c < 3; ++c) {
      int& value = points[point][c];
      if (point == 0) {
        if (is_signed) value = sign_extended(value, mode->bits);
        continue;
      }
      if (is_signed || mode->is_delta) value = sign_extended(value, mode->delta[c]);
      if (mode->is_delta) {
        value = (value + points[0][c]) & ((1 << mode->bits) - 1);
        if (is_signed) value = sign_extended(value, mode->bits);
      }
    }
  }
  for (auto& point : points) {
    for (int& value : point) value = unquantized(value, mode->bits, is_signed);
  }
  for (int texel = 0; texel < 16; ++texel) {
    const bool shorter = texel == 0 || (two_regions && texel == partition.anchor);
    const int index = bits.take((two_regions ? 3 : 4) - (shorter ? 1 : 0));
    const int weight =
        two_regions ? kWeights3[static_cast<std::size_t>(index)] : kWeights4[static_cast<std::size_t>(index)];
    const std::size_t first = 2U * (partition.second >> texel & 1U);
    for (std::size_t c = 0; c < 3; ++c) {
      const int between = (points[first][c] * (64 - weight) + points[first + 1][c] * weight + 32) >> 6;
      halves[3 * static_cast<std::size_t>(texel) + c] = finished(between, is_signed);
    }
  }
}

}  // namespace mirrorbake
