#include "mirrorbake/envmap/dds.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/envmap/mipmap.hpp"
#include "mirrorbake/image/atomic_file.hpp"
#include "mirrorbake/image/color.hpp"
#include "mirrorbake/image/half.hpp"

namespace mirrorbake {
namespace {

class Dds : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("mirrorbake_dds_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::vector<std::byte> bytes_of(const std::string& name) const {
    std::ifstream in(path(name), std::ios::binary);
    const std::vector<char> text((std::istreambuf_iterator<char>(in)), {});
    std::vector<std::byte> bytes(text.size());
    std::transform(text.begin(), text.end(), bytes.begin(), [](char c) { return static_cast<std::byte>(c); });
    return bytes;
  }

 private:
  std::filesystem::path folder_;
};

EnvMap noise(int side, int channels) {
  EnvMap map = make_envmap({parse_projection("cube"), side, side, 1, channels});
  for (std::size_t i = 0; i < map.values.size(); ++i) {
    map.values[i] = static_cast<float>(hash64(i) % 10000) * 0.01F;
  }
  return map;
}

std::uint32_t word(const std::vector<std::byte>& bytes, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

void set_word(std::vector<std::byte>& bytes, std::size_t offset, std::uint32_t value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

TEST_F(Dds, ReturnsEveryLevelInTheFormatAskedFor) {
  for (int channels = 1; channels <= 4; ++channels) {
    for (const PixelFormat format : {PixelFormat::automatic, PixelFormat::half, PixelFormat::float32}) {
      const EnvMap mips = build_mips(noise(20, channels), MipFilter::seamless);
      EXPECT_EQ(save_envmap(path("a.DDS"), mips, FaceLayout::automatic, format).clamped_to_half, 0u);
      const EnvMap again = load_envmap(path("a.DDS"));
      ASSERT_EQ(again.layout, mips.layout);
      for (std::size_t i = 0; i < mips.values.size(); ++i) {
        const float exact = mips.values[i];
        ASSERT_EQ(again.values[i],
                  format == PixelFormat::float32 ? exact : float_from_half(half_from_float(exact)));
      }
    }
  }
}

// Offsets and numbers as the Programming Guide for DDS has them.
TEST_F(Dds, HeaderIsThatOfACubeOfHalfFloats) {
  save_dds(path("a.dds"), build_mips(noise(4, 3), MipFilter::box));
  const std::vector<std::byte> bytes = bytes_of("a.dds");
  EXPECT_EQ(bytes.size(), 148u + 6u * (16u + 4u + 1u) * 8u);
  EXPECT_EQ(word(bytes, 0), 0x20534444u);  // "DDS "
  EXPECT_EQ(word(bytes, 4), 124u);
  EXPECT_EQ(word(bytes, 12), 4u);  // height, width
  EXPECT_EQ(word(bytes, 16), 4u);
  EXPECT_EQ(word(bytes, 28), 3u);            // levels
  EXPECT_EQ(word(bytes, 76), 32u);           // size of the pixel format
  EXPECT_EQ(word(bytes, 84), 0x30315844u);   // "DX10"
  EXPECT_EQ(word(bytes, 108), 0x00401008u);  // texture, complex, mipmap
  EXPECT_EQ(word(bytes, 112), 0x0000fe00u);  // cube of all faces
  EXPECT_EQ(word(bytes, 128), 10u);          // DXGI_FORMAT_R16G16B16A16_FLOAT
  EXPECT_EQ(word(bytes, 132), 3u);           // two dimensions
  EXPECT_EQ(word(bytes, 136), 4u);           // cube
  EXPECT_EQ(word(bytes, 140), 1u);           // one of them
  EXPECT_EQ(word(bytes, 144), 3u);           // opaque
}

// All levels of a face lie together, unlike in KTX2.
TEST_F(Dds, LevelsOfAFaceFollowEachOther) {
  EnvMap mips = build_mips(noise(2, 1), MipFilter::box);
  save_dds(path("a.dds"), mips, PixelFormat::float32);
  const std::vector<std::byte> bytes = bytes_of("a.dds");
  for (std::size_t face = 0; face < 6; ++face) {
    float stored[5];
    std::memcpy(stored, bytes.data() + 148 + face * sizeof stored, sizeof stored);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(stored[i], mips.values[4 * face + i]);
    EXPECT_EQ(stored[4], mips.values[24 + face]);
  }
}

TEST_F(Dds, OlderHeadersAreReadAndOtherPixelsAreNamed) {
  const EnvMap map = noise(4, 4);
  save_dds(path("a.dds"), map, PixelFormat::float32);
  std::vector<std::byte> old = bytes_of("a.dds");
  old.erase(old.begin() + 128, old.begin() + 148);
  set_word(old, 84, 116);  // D3DFMT_A32B32G32R32F
  write_file(path("old.dds"), old);
  EXPECT_EQ(load_envmap(path("old.dds")).values, map.values);

  for (const auto& [code, words] :
       {std::pair(0x35545844U, "format code DXT5"), std::pair(117U, "format code 117")}) {
    set_word(old, 84, code);
    write_file(path("code.dds"), old);
    try {
      load_dds(path("code.dds"));
      ADD_FAILURE() << words << " was read";
    } catch (const FileError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(words));
    }
  }

  std::vector<std::byte> compressed = bytes_of("a.dds");
  set_word(compressed, 128, 98);  // DXGI_FORMAT_BC7_UNORM
  write_file(path("bc7.dds"), compressed);
  try {
    load_dds(path("bc7.dds"));
    ADD_FAILURE() << "BC7 was read";
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("DXGI format 98"));
  }
}

TEST_F(Dds, ColoursOf8BitsAreDecoded) {
  const EnvMap map = noise(2, 4);
  save_dds(path("a.dds"), map, PixelFormat::half);
  std::vector<std::byte> bytes = bytes_of("a.dds");
  bytes.resize(148 + (bytes.size() - 148) / 2);
  for (std::size_t i = 148; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::byte>(i % 4 == 3 ? 255 : i % 251);
  for (const auto& [dxgi, is_srgb, blue_first] :
       {std::tuple(28U, false, false), {29U, true, false}, {87U, false, true}, {91U, true, true}}) {
    set_word(bytes, 128, dxgi);
    write_file(path("b.dds"), bytes);
    const EnvMap read = load_dds(path("b.dds"));
    ASSERT_EQ(read.layout.channels, 4);
    // The first texel; levels of a face lie together in the file.
    for (std::size_t c = 0; c < 4; ++c) {
      const std::size_t from = blue_first && c < 3 ? 2 - c : c;
      const float value = static_cast<float>(std::to_integer<int>(bytes[148 + from])) / 255.0F;
      EXPECT_FLOAT_EQ(read.values[c], is_srgb && c < 3 ? srgb_decode(value) : value) << dxgi << ' ' << c;
    }
  }
}

// One block for every level of every face: of 6 texels a side there are four, of which half lie beyond it.
TEST_F(Dds, BlocksOfBc6hAreWrittenAndRead) {
  const EnvMapLayout layout{parse_projection("cube"), 6, 6, 3, 3};
  std::vector<std::byte> blocks(6 * (4 + 1 + 1) * 16);
  // The mode of one region with 10 bits: red of both end points is 0x1ff, the rest is 0.
  for (std::size_t at = 0; at < blocks.size(); at += 16) {
    blocks[at] = std::byte{0xe3};
    blocks[at + 1] = std::byte{0x3f};
    blocks[at + 4] = std::byte{0xf8};
    blocks[at + 5] = std::byte{0x0f};
  }
  save_dds_bc6h(path("a.dds"), layout, blocks);
  EXPECT_EQ(word(bytes_of("a.dds"), 128), 95u);
  EXPECT_EQ(word(bytes_of("a.dds"), 20), 4u * 16u);  // bytes of a face
  const EnvMap map = load_envmap(path("a.dds"));
  ASSERT_EQ(map.layout, layout);
  // ((0x1ff · 65536 + 32768) / 1024 · 31) / 64 as the bits of a half float.
  const float red = float_from_half(((0x1ff * 0x10000 + 0x8000) >> 10) * 31 >> 6);
  for (std::size_t i = 0; i < map.values.size(); ++i) EXPECT_EQ(map.values[i], i % 3 == 0 ? red : 0.0F) << i;
  EXPECT_THROW(save_dds_bc6h(path("b.dds"), layout, std::span(blocks).first(16)), InvalidArgument);
  std::vector<std::byte> bytes = bytes_of("a.dds");
  write_file(path("short.dds"), std::span(bytes).first(bytes.size() - 1));
  EXPECT_THROW(load_dds(path("short.dds")), FileError);
}

struct Example {
  unsigned mode;
  bool is_signed;
  std::uint32_t hash;  // FNV-1a of the 48 half floats
};

// What bcdec 0.98 (Sergii Kudlai, another decoder) makes of blocks of arbitrary bits in every mode.
constexpr std::array<Example, 30> kExamples = {{
    {0, false, 0x1d4225efU},  {1, false, 0x19142e31U},  {2, false, 0x14354299U},  {6, false, 0x6ca6006bU},
    {10, false, 0x382f270fU}, {14, false, 0x1688d98cU}, {18, false, 0x0a0ed529U}, {22, false, 0x9a8db9b9U},
    {26, false, 0xc1337f66U}, {30, false, 0xfe2ea472U}, {3, false, 0xc5912861U},  {7, false, 0x4509a810U},
    {11, false, 0xfd40aaabU}, {15, false, 0xd73b926fU}, {19, false, 0xc655ff85U}, {0, true, 0x45507ce2U},
    {1, true, 0xa032571aU},   {2, true, 0xbe937bd5U},   {6, true, 0x687a2210U},   {10, true, 0x76ce7924U},
    {14, true, 0x3ab2e405U},  {18, true, 0x0f2b522bU},  {22, true, 0x207bde58U},  {26, true, 0xc419db39U},
    {30, true, 0x96e05011U},  {3, true, 0x239bfe40U},   {7, true, 0x49ed0e99U},   {11, true, 0x41a0f176U},
    {15, true, 0x268fec5eU},  {19, true, 0xc655ff85U},
}};

TEST_F(Dds, EveryModeOfBc6hIsDecodedAsByAnotherDecoder) {
  const EnvMapLayout layout{parse_projection("cube"), 4, 4, 1, 3};
  for (const Example& example : kExamples) {
    std::vector<std::byte> blocks(6 * 16);
    for (unsigned i = 0; i < blocks.size(); ++i) {
      blocks[i] = static_cast<std::byte>((37U * (i % 16) + 101U * example.mode + 59U) * 2654435761U >> 13U);
    }
    const unsigned mask = example.mode < 2 ? 3U : 31U;
    for (std::size_t face = 0; face < 6; ++face) {
      blocks[16 * face] =
          static_cast<std::byte>((static_cast<unsigned>(blocks[16 * face]) & ~mask) | example.mode);
    }
    save_dds_bc6h(path("a.dds"), layout, blocks);
    std::vector<std::byte> bytes = bytes_of("a.dds");
    set_word(bytes, 128, example.is_signed ? 96 : 95);
    write_file(path("a.dds"), bytes);
    const EnvMap map = load_dds(path("a.dds"));
    for (std::size_t face = 0; face < 6; ++face) {
      std::uint32_t hash = 2166136261U;
      for (std::size_t i = 0; i < 48; ++i)
        hash = (hash ^ half_from_float(map.values[48 * face + i])) * 16777619U;
      EXPECT_EQ(hash, example.hash) << example.mode << (example.is_signed ? " signed" : "");
    }
  }
}

TEST_F(Dds, NoBlockOfBc6hIsInfiniteOrNan) {
  const EnvMapLayout layout{parse_projection("cube"), 64, 64, 1, 3};
  std::vector<std::byte> blocks(6 * 256 * 16);
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i] = static_cast<std::byte>(hash64(i));
  save_dds_bc6h(path("a.dds"), layout, blocks);
  std::vector<std::byte> bytes = bytes_of("a.dds");
  for (const std::uint32_t dxgi : {95U, 96U}) {
    set_word(bytes, 128, dxgi);
    write_file(path("a.dds"), bytes);
    EXPECT_EQ(count_not_finite(load_dds(path("a.dds"))), 0U);
  }
}

TEST_F(Dds, ClampsAndCountsAndStoresNothingButCubes) {
  EnvMap map = make_envmap({parse_projection("cube"), 1, 1, 1, 1});
  map.values = {1e6F, -1e6F, std::numeric_limits<float>::infinity(), 65504.0F, 0.0F, 1.0F};
  EXPECT_EQ(save_dds(path("a.dds"), map).clamped_to_half, 3u);
  const EnvMap panorama = make_envmap({parse_projection("latlong"), 4, 2, 1, 3});
  EXPECT_THROW(save_dds(path("b.dds"), panorama), InvalidArgument);
  EXPECT_THROW(save_dds(path("b.dds"), map, PixelFormat::uint8), FileError);
  EXPECT_THROW(save_envmap(path("b.dds"), map, FaceLayout::cross), InvalidArgument);
}

TEST_F(Dds, DamagedFilesAreErrorsAndNeverCrash) {
  save_dds(path("whole.dds"), build_mips(noise(8, 3), MipFilter::box));
  const std::vector<std::byte> bytes = bytes_of("whole.dds");
  for (std::size_t length = 0; length < bytes.size(); length += 37) {
    write_file(path("broken.dds"), std::span(bytes).first(length));
    EXPECT_THROW(load_envmap(path("broken.dds")), FileError) << length;
  }
  int loaded = 0;
  for (std::uint64_t trial = 0; trial < 500; ++trial) {
    std::vector<std::byte> changed = bytes;
    for (std::uint64_t i = 0; i < 1 + trial % 3; ++i) {
      changed[hash64(trial, 2 * i) % 148] = static_cast<std::byte>(hash64(trial, 2 * i + 1) & 255u);
    }
    write_file(path("broken.dds"), changed);
    try {
      const EnvMap map = load_dds(path("broken.dds"), {.max_bytes = 1 << 24});
      EXPECT_EQ(map.values.size(), map.layout.size());
      ++loaded;
    } catch (const FileError&) {
    }
  }
  EXPECT_GT(loaded, 0);
  EXPECT_LT(loaded, 500);
}

}  // namespace
}  // namespace mirrorbake
