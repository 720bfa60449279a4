#include "mirrorbake/envmap/ktx2.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string_view>
#include <vector>

#include "cube_file.hpp"
#include "ktx2_file.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/version.hpp"
#include "mirrorbake/image/atomic_file.hpp"
#include "mirrorbake/image/half.hpp"

namespace mirrorbake {
namespace {

// VkFormat numbers of the Vulkan specification, VK_FORMAT_R16_SFLOAT and so on.
struct Format {
  std::uint32_t vk_format;
  int channels;
  std::size_t bytes;  // of a channel
};
constexpr std::array<Format, 8> kFormats = {{
    {76, 1, 2},
    {83, 2, 2},
    {90, 3, 2},
    {97, 4, 2},
    {100, 1, 4},
    {103, 2, 4},
    {106, 3, 4},
    {109, 4, 4},
}};

// Basic descriptor block of the Khronos Data Format Specification 1.3: linear BT.709 RGBA, signed floats.
void put_data_format(ByteWriter& out, int channels, std::size_t bytes) {
  const std::uint32_t block = 24u + 16u * static_cast<std::uint32_t>(channels);
  out.put<std::uint32_t>(block + 4u);
  out.put<std::uint32_t>(0);  // vendor Khronos, basic type
  out.put<std::uint16_t>(2);  // version 1.3
  out.put<std::uint16_t>(static_cast<std::uint16_t>(block));
  out.put<std::uint32_t>(0x00010101);  // RGBSDA, BT.709, linear, straight alpha
  out.put<std::uint32_t>(0);           // blocks of one texel
  out.put<std::uint64_t>(static_cast<std::uint64_t>(channels) * bytes);  // of plane 0
  for (int c = 0; c < channels; ++c) {
    out.put<std::uint16_t>(static_cast<std::uint16_t>(8 * bytes * static_cast<std::size_t>(c)));
    out.put<std::uint8_t>(static_cast<std::uint8_t>(8 * bytes - 1));             // bits less one
    out.put<std::uint8_t>(static_cast<std::uint8_t>((c == 3 ? 15 : c) | 0xc0));  // channel; float and signed
    out.put<std::uint32_t>(0);
    out.put<float>(-1.0F);
    out.put<float>(1.0F);
  }
}

void put_key(ByteWriter& out, std::string_view key, std::string_view value) {
  out.put<std::uint32_t>(static_cast<std::uint32_t>(key.size() + value.size() + 2));
  out.put_text(key);
  out.put<std::uint8_t>(0);
  out.put_text(value);
  out.put<std::uint8_t>(0);
  out.pad(4);
}

constexpr std::string_view kOpaque = "rgb1";

}  // namespace

bool is_ktx2(const std::string& path) { return has_extension(path, ".ktx2"); }

void check_ktx2_path(const std::string& path, const Projection& projection, PixelFormat format) {
  if (projection.kind != ProjectionKind::cube) {
    throw InvalidArgument("map", to_string(projection), "a cube map: KTX2 stores no other projection");
  }
  if (format == PixelFormat::uint8 || format == PixelFormat::uint16) {
    throw FileError(path, "its format cannot store these pixels, expected half or float32");
  }
  const AtomicFile checks_the_folder(path);
}

SaveReport save_ktx2(const std::string& path, const EnvMapView& map, PixelFormat pixels) {
  validate(map);
  check_ktx2_path(path, map.layout.projection, pixels);
  const bool whole = pixels == PixelFormat::float32;
  const EnvMapLayout& layout = map.layout;
  if (layout.channels > 4)
    throw InvalidArgument("channels", std::to_string(layout.channels), "1 to 4 in a KTX2 file");
  const int stored = layout.channels == 3 ? 4 : layout.channels;
  const Format& format = *std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& f) {
    return f.channels == stored && f.bytes == (whole ? 4u : 2u);
  });
  ByteWriter out;
  for (const std::uint8_t v : kKtx2Identifier) out.put(v);
  out.put(format.vk_format);
  out.put(static_cast<std::uint32_t>(format.bytes));
  out.put(static_cast<std::uint32_t>(layout.width));
  out.put(static_cast<std::uint32_t>(layout.height));
  for (const std::uint32_t v : {0u, 0u, 6u}) out.put(v);  // no depth, no array, six faces
  out.put(static_cast<std::uint32_t>(layout.levels));
  out.put<std::uint32_t>(0);  // not supercompressed
  const std::size_t index = out.bytes.size();
  out.bytes.resize(kKtx2HeaderBytes + kKtx2LevelBytes * static_cast<std::size_t>(layout.levels));
  const std::size_t data_format = out.bytes.size();
  put_data_format(out, stored, format.bytes);
  const std::size_t keys = out.bytes.size();
  put_key(out, "KTXorientation", "rd");
  if (layout.channels == 3) put_key(out, kSwizzleKey, kOpaque);
  put_key(out, "KTXwriter", std::string("mirrorbake ") + version());
  out.overwrite(index, static_cast<std::uint32_t>(data_format));
  out.overwrite(index + 4, static_cast<std::uint32_t>(keys - data_format));
  out.overwrite(index + 8, static_cast<std::uint32_t>(keys));
  out.overwrite(index + 12, static_cast<std::uint32_t>(out.bytes.size() - keys));

  SaveReport report;
  const std::size_t texel_bytes = format.bytes * static_cast<std::size_t>(stored);
  // The coarsest level comes first in the file, so that a viewer can show something early.
  for (int level = layout.levels - 1; level >= 0; --level) {
    out.pad(std::lcm(texel_bytes, std::size_t{4}));
    const std::size_t begin = out.bytes.size();
    const std::span<const float> values = map.level(level);
    out.bytes.reserve(begin + values.size() / static_cast<std::size_t>(layout.channels) * texel_bytes);
    for (std::size_t i = 0; i < values.size(); i += static_cast<std::size_t>(layout.channels)) {
      for (std::size_t c = 0; c < static_cast<std::size_t>(stored); ++c) {
        const float v = c < static_cast<std::size_t>(layout.channels) ? values[i + c] : 1.0F;
        if (whole) {
          out.put(v);
          continue;
        }
        out.put(half_from_float(clamp_to_half(v, report.clamped_to_half)));
      }
    }
    const std::size_t entry = kKtx2HeaderBytes + kKtx2LevelBytes * static_cast<std::size_t>(level);
    const std::uint64_t bytes = out.bytes.size() - begin;
    out.overwrite(entry, static_cast<std::uint64_t>(begin));
    out.overwrite(entry + 8, bytes);
    out.overwrite(entry + 16, bytes);
  }
  write_file(path, out.bytes);
  return report;
}

EnvMap load_ktx2(const std::string& path, const ImageLimits& limits) {
  return unpacked(path, read_ktx2(path, *image_files::open_bytes(path), limits), std::nullopt,
                  FaceLayout::automatic);
}

}  // namespace mirrorbake
