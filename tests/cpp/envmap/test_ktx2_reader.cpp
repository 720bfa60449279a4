#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/image/color.hpp"
#include "mirrorbake/image/half.hpp"

namespace mirrorbake {
namespace {

using Buffer = std::vector<unsigned char>;

// A file as other writers make it.
struct Ktx2 {
  std::uint32_t vk_format = 43;  // R8G8B8A8_SRGB
  std::uint32_t width = 1, height = 1, depth = 0, layers = 0, faces = 6;
  std::uint32_t packing = 0;
  std::uint8_t model = 1, primaries = 1, transfer = 2, flags = 0;
  std::string keys = {};  // of the key/value data, as they stand in the file
  std::vector<Buffer> levels = {};

  Buffer bytes() const {
    Buffer out = {0xab, 'K', 'T', 'X', ' ', '2', '0', 0xbb, '\r', '\n', 0x1a, '\n'};
    const std::size_t index = 80;
    const std::size_t format = index + 24 * levels.size();
    const std::size_t words = format + 44;
    for (const std::uint32_t value : {vk_format, 1U, width, height, depth, layers, faces,
                                      static_cast<std::uint32_t>(levels.size()), packing}) {
      put(out, value);
    }
    put(out, static_cast<std::uint32_t>(format));
    put(out, 44U);
    put(out, static_cast<std::uint32_t>(words));
    put(out, static_cast<std::uint32_t>(keys.size()));
    put(out, std::uint64_t{0});
    put(out, std::uint64_t{0});
    std::size_t place = words + keys.size();
    for (const Buffer& level : levels) {
      put(out, std::uint64_t{place});
      put(out, std::uint64_t{packed(level).size()});
      put(out, std::uint64_t{level.size()});
      place += packed(level).size();
    }
    put(out, 44U);
    put(out, 0U);
    put(out, 2U | 40U << 16U);
    put(out, std::uint32_t{model} | std::uint32_t{primaries} << 8U | std::uint32_t{transfer} << 16U |
                 std::uint32_t{flags} << 24U);
    out.resize(words);
    out.insert(out.end(), keys.begin(), keys.end());
    for (const Buffer& level : levels) {
      const Buffer stored = packed(level);
      out.insert(out.end(), stored.begin(), stored.end());
    }
    return out;
  }

  void add_key(std::string_view key, std::string_view value) {
    const auto size = static_cast<std::uint32_t>(key.size() + value.size() + 2);
    keys.append(reinterpret_cast<const char*>(&size), 4);
    keys.append(key).push_back('\0');
    keys.append(value).push_back('\0');
    keys.resize((keys.size() + 3) / 4 * 4);
  }

 private:
  template <typename T>
  static void put(Buffer& out, T value) {
    const auto* raw = reinterpret_cast<const unsigned char*>(&value);
    out.insert(out.end(), raw, raw + sizeof value);
  }
  Buffer packed(const Buffer& level) const {
    if (packing == 0) return level;
    Buffer result(packing == 2 ? ZSTD_compressBound(level.size()) : compressBound(level.size()));
    if (packing == 2) {
      result.resize(ZSTD_compress(result.data(), result.size(), level.data(), level.size(), 3));
    } else {
      uLongf size = result.size();
      compress(result.data(), &size, level.data(), level.size());
      result.resize(size);
    }
    return result;
  }
};

EnvMap load(const Ktx2& file) { return decode_envmap("a.ktx2", file.bytes()); }

std::string refusal(const Ktx2& file) {
  try {
    load(file);
    return "";
  } catch (const FileError& error) {
    return error.what();
  }
}

Buffer noise(std::size_t size) {
  Buffer result(size);
  for (std::size_t i = 0; i < size; ++i) result[i] = static_cast<unsigned char>(hash64(i) & 255U);
  return result;
}

TEST(Ktx2Reader, AColourCubeOf8BitsWithItsLevelsIsDecodedHoweverItIsPacked) {
  for (const std::uint32_t packing : {0U, 2U, 3U}) {
    Ktx2 file;
    file.width = file.height = 4;
    file.packing = packing;
    for (std::size_t side = 4; side > 0; side /= 2) {
      Buffer level = noise(6 * side * side * 4);
      for (std::size_t i = 3; i < level.size(); i += 4) level[i] = 255;
      file.levels.push_back(level);
    }
    const EnvMap map = load(file);
    ASSERT_EQ(map.layout, (EnvMapLayout{parse_projection("cube"), 4, 4, 3, 4}));
    std::size_t i = 0;
    for (const Buffer& level : file.levels) {
      for (std::size_t byte = 0; byte < level.size(); ++byte, ++i) {
        const float value = static_cast<float>(level[byte]) / 255.0F;
        ASSERT_FLOAT_EQ(map.values[i], byte % 4 == 3 ? value : srgb_decode(value)) << packing << ' ' << i;
      }
    }
  }
}

// Blue first, linear, and with an alpha that is not multiplied in yet.
TEST(Ktx2Reader, OrderTransferAndAlphaOfIntegersAreThoseOfTheFile) {
  Ktx2 file;
  file.faces = 1;
  file.width = 2;
  file.transfer = 1;
  file.vk_format = 44;  // B8G8R8A8_UNORM
  file.levels = {{0, 51, 255, 255, 255, 102, 0, 51}};
  EXPECT_THAT(load(file).values,
              testing::Pointwise(testing::FloatEq(), {1.0F, 0.2F, 0.0F, 1.0F, 0.0F, 0.08F, 0.2F, 0.2F}));
  file.flags = 1;  // colours are premultiplied
  EXPECT_FLOAT_EQ(load(file).values[5], 0.4F);
  file.vk_format = 77;  // R16G16_UNORM
  file.levels = {{0, 0, 255, 255, 0, 128, 255, 127}};
  EXPECT_THAT(load(file).values,
              testing::Pointwise(testing::FloatEq(), {0.0F, 1.0F, 32768.0F / 65535.0F, 32767.0F / 65535.0F}));
  file.transfer = 2;
  file.vk_format = 37;  // the format says linear, its descriptor sRGB
  file.levels = {{188, 188, 188, 255, 0, 0, 0, 255}};
  EXPECT_NEAR(load(file).values[0], 0.5F, 0.005F);
}

TEST(Ktx2Reader, FloatsOfAllKindsAreTheNumbersThatTheyEncode) {
  Ktx2 file;
  file.faces = 1;
  file.width = 2;
  file.transfer = 1;
  file.packing = 2;
  // E5B9G9R9: the mantissas 256, 128 and 511 by 2^(16 − 24); 1 by 2^(31 − 24).
  const std::array<std::uint32_t, 2> shared = {16U << 27U | 511U << 18U | 128U << 9U | 256U, 31U << 27U | 1U};
  file.vk_format = 123;
  file.levels = {Buffer(8)};
  std::memcpy(file.levels[0].data(), shared.data(), 8);
  EXPECT_EQ(load(file).values, (std::vector<float>{1.0F, 0.5F, 511.0F / 256.0F, 128.0F, 0.0F, 0.0F}));
  // R11G11B10: 1.0 is the exponent 15 without a mantissa; 65024 and 64512 are the largest.
  const std::array<std::uint32_t, 2> small = {15U << 6U | 14U << 17U | 16U << 27U,
                                              0x7bfU | 0x7bfU << 11U | 0x3dfU << 22U};
  file.vk_format = 122;
  std::memcpy(file.levels[0].data(), small.data(), 8);
  EXPECT_EQ(load(file).values, (std::vector<float>{1.0F, 0.5F, 2.0F, 65024.0F, 65024.0F, 64512.0F}));
  const std::array<std::uint16_t, 2> halves = {half_from_float(3.5F), half_from_float(-60000.0F)};
  file.vk_format = 76;
  file.levels = {Buffer(4)};
  std::memcpy(file.levels[0].data(), halves.data(), 4);
  EXPECT_EQ(load(file).values, (std::vector<float>{3.5F, -60000.0F}));
  const std::array<float, 2> floats = {1e-30F, 3e38F};
  file.vk_format = 100;
  file.levels = {Buffer(8)};
  std::memcpy(file.levels[0].data(), floats.data(), 8);
  EXPECT_EQ(load(file).values, (std::vector<float>{1e-30F, 3e38F}));
}

// A block of mode 11 (ten bits an end point, no partition) whose end points are both 0 is black; four blocks
// cover faces of 6 texels.
TEST(Ktx2Reader, BlocksOfBc6hAreRead) {
  Ktx2 file;
  file.vk_format = 143;
  file.transfer = 1;
  file.width = file.height = 6;
  Buffer black(16);
  black[0] = 3;
  for (int block = 0; block < 24; ++block) {
    if (file.levels.empty()) file.levels.emplace_back();
    file.levels[0].insert(file.levels[0].end(), black.begin(), black.end());
  }
  const EnvMap map = load(file);
  EXPECT_EQ(map.layout, (EnvMapLayout{parse_projection("cube"), 6, 6, 1, 3}));
  EXPECT_EQ(map.values, std::vector<float>(map.values.size(), 0.0F));
}

TEST(Ktx2Reader, APictureOfOneFaceIsAPanoramaOrWhatItIsSaidToBe) {
  Ktx2 file;
  file.faces = 1;
  file.transfer = 1;
  file.vk_format = 9;  // R8_UNORM
  file.width = 4;
  file.height = 2;
  file.levels = {{0, 51, 102, 153, 204, 255, 0, 51}, {51, 102}};
  const EnvMap panorama = load(file);
  EXPECT_EQ(panorama.layout, (EnvMapLayout{parse_projection("latlong"), 4, 2, 2, 1}));
  EXPECT_FLOAT_EQ(panorama.values[9], 0.4F);
  file.add_key("KTXorientation", "lu");
  EXPECT_THAT(load(file).values, testing::Pointwise(testing::FloatEq(), {0.2F, 0.0F, 1.0F, 0.8F, 0.6F, 0.4F,
                                                                         0.2F, 0.0F, 0.4F, 0.2F}));
  file.keys.clear();
  file.width = 6;
  file.height = 1;
  file.levels = {noise(6)};
  EXPECT_EQ(load(file).layout, (EnvMapLayout{parse_projection("cube"), 1, 1, 1, 1}));
  file.height = 3;
  file.levels = {noise(18)};
  EXPECT_EQ(decode_envmap("a.ktx2", file.bytes(), parse_projection("angular")).layout.width, 6);
}

TEST(Ktx2Reader, SwizzlesAreFollowed) {
  Ktx2 file;
  file.faces = 1;
  file.width = 2;
  file.transfer = 1;
  file.vk_format = 16;  // R8G8_UNORM
  file.levels = {{51, 102, 153, 204}};
  file.add_key("KTXswizzle", "rrrg");  // luminance and alpha
  const EnvMap grey = load(file);
  EXPECT_THAT(grey.channels, testing::ElementsAre("Y", "A"));
  EXPECT_FLOAT_EQ(grey.values[3], 0.8F);
  file.keys.clear();
  file.add_key("KTXswizzle", "g0r1");
  EXPECT_THAT(load(file).values,
              testing::Pointwise(testing::FloatEq(), {0.4F, 0.0F, 0.2F, 0.8F, 0.0F, 0.6F}));
  file.keys.clear();
  file.add_key("KTXswizzle", "rg01");
  EXPECT_EQ(load(file).layout.channels, 2);
  file.keys.clear();
  file.add_key("KTXswizzle", "rgbx");
  EXPECT_THAT(refusal(file), testing::HasSubstr("swizzle 'rgbx'"));
}

// White is white; Display P3's red is Rec. 709's (1.2249, -0.0421, -0.0196), from the chromaticities of SMPTE
// EG 432-1 by the arithmetic of SMPTE RP 177, rounded to four digits.
TEST(Ktx2Reader, ColoursOfOtherPrimariesAreThoseOfRec709) {
  Ktx2 file;
  file.faces = 1;
  file.width = 2;
  file.transfer = 1;
  file.vk_format = 37;  // R8G8B8A8_UNORM
  file.primaries = 10;
  file.levels = {{255, 255, 255, 255, 255, 0, 0, 255}};
  const std::vector<float> expected = {1.0F, 1.0F, 1.0F, 1.0F, 1.2249F, -0.0421F, -0.0196F, 1.0F};
  EXPECT_THAT(load(file).values, testing::Pointwise(testing::FloatNear(1e-4F), expected));
  for (const std::uint8_t primaries : std::initializer_list<std::uint8_t>{2, 3, 4, 11}) {
    file.primaries = primaries;
    const EnvMap map = load(file);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(map.values[c], 1.0F, 1e-6F);
    EXPECT_EQ(map.values[7], 1.0F);
  }
}

TEST(Ktx2Reader, WhatIsNotReadIsRefusedByName) {
  const Ktx2 good{.levels = {noise(24)}};
  EXPECT_EQ(refusal(good), "");
  const auto with = [&](auto&& change) {
    Ktx2 file = good;
    change(file);
    return refusal(file);
  };
  using testing::HasSubstr;
  EXPECT_THAT(with([](Ktx2& f) {
                f.packing = 1;
                f.model = 163;
              }),
              HasSubstr("Basis Universal (ETC1S)"));
  EXPECT_THAT(with([](Ktx2& f) {
                f.vk_format = 0;
                f.model = 166;
              }),
              HasSubstr("Basis Universal (UASTC)"));
  EXPECT_THAT(with([](Ktx2& f) { f.packing = 7; }), HasSubstr("supercompression scheme 7"));
  EXPECT_THAT(with([](Ktx2& f) { f.vk_format = 146; }), HasSubstr("VkFormat 146, blocks of BC1 to BC7"));
  EXPECT_THAT(with([](Ktx2& f) { f.vk_format = 157; }), HasSubstr("blocks of ASTC"));
  EXPECT_THAT(with([](Ktx2& f) { f.vk_format = 97; }), HasSubstr("transfer function 2"));
  EXPECT_THAT(with([](Ktx2& f) { f.primaries = 6; }), HasSubstr("primaries 6"));
  EXPECT_THAT(with([](Ktx2& f) { f.layers = 3; }), HasSubstr("an array of 3 maps"));
  EXPECT_THAT(with([](Ktx2& f) { f.depth = 4; }), HasSubstr("depth 4"));
  EXPECT_THAT(with([](Ktx2& f) { f.height = 2; }), HasSubstr("faces of 1 x 2 texels"));
  EXPECT_THAT(with([](Ktx2& f) { f.add_key("KTXorientation", "ru"); }), HasSubstr("orientation 'ru'"));
  Buffer older = good.bytes();
  older[5] = older[6] = '1';
  EXPECT_THROW(decode_envmap("a.ktx", older), FileError);
}

// 4 GiB from a few bytes, and a stream that holds more or less than the file says.
TEST(Ktx2Reader, ClaimsBeyondWhatTheBytesCanHoldCostNoMemory) {
  Ktx2 file{.levels = {Buffer(24)}};
  file.packing = 2;
  Buffer bytes = file.bytes();
  const auto set = [&](std::size_t place, auto value) {
    std::memcpy(bytes.data() + place, &value, sizeof value);
  };
  set(20, 8192U);
  set(24, 8192U);
  set(96, std::uint64_t{6} * 8192 * 8192 * 4);
  EXPECT_THROW(decode_envmap("a.ktx2", bytes, std::nullopt, FaceLayout::automatic,
                             {.max_bytes = std::uint64_t{16} << 30}),
               FileError);
  for (const std::uint32_t side : {1U, 3U}) {
    Ktx2 other{.levels = {Buffer(6 * 4 * 4)}};
    other.packing = 2;
    other.width = other.height = 2;
    bytes = other.bytes();
    set(20, side);
    set(24, side);
    set(96, std::uint64_t{6} * side * side * 4);
    EXPECT_THROW(decode_envmap("a.ktx2", bytes), FileError) << side;
  }
}

}  // namespace
}  // namespace mirrorbake
