#include "mirrorbake/envmap/dds.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "bc6h.hpp"
#include "cube_file.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/atomic_file.hpp"
#include "mirrorbake/image/half.hpp"
#include "texel_format.hpp"

namespace mirrorbake {
namespace {

constexpr std::uint32_t four(const char (&text)[5]) {
  std::uint32_t code = 0;
  for (int i = 3; i >= 0; --i) code = code << 8U | static_cast<std::uint8_t>(text[i]);
  return code;
}

constexpr std::uint32_t kMagic = four("DDS ");
constexpr std::uint32_t kDx10 = four("DX10");
constexpr std::uint64_t kHeaderBytes = 128;  // with the magic
constexpr std::uint64_t kDx10Bytes = 20;

// DDSD_CAPS | HEIGHT | WIDTH | PIXELFORMAT, PITCH or LINEARSIZE, and MIPMAPCOUNT.
constexpr std::uint32_t kFlags = 0x1 | 0x2 | 0x4 | 0x1000;
constexpr std::uint32_t kFlagPitch = 0x8, kFlagLinearSize = 0x80000;
constexpr std::uint32_t kFlagLevels = 0x20000;
constexpr std::uint32_t kFourCc = 0x4;                    // DDPF_FOURCC
constexpr std::uint32_t kCaps = 0x1000 | 0x8;             // TEXTURE | COMPLEX
constexpr std::uint32_t kCapsLevels = 0x400000;           // MIPMAP
constexpr std::uint32_t kCube = 0x200;                    // DDSCAPS2_CUBEMAP
constexpr std::uint32_t kAllFaces = 0xfc00;               // all six DDSCAPS2_CUBEMAP_…
constexpr std::uint32_t kTexture2d = 3, kMiscCube = 4;    // of the DX10 header
constexpr std::uint32_t kPremultiplied = 2, kOpaque = 3;  // its alpha modes

constexpr std::uint32_t kBc6hUnsigned = 95;  // DXGI_FORMAT_BC6H_UF16
constexpr std::uint32_t kBc6hSigned = 96;

// DXGI_FORMAT_R16_FLOAT and so on; `code` is the D3DFMT number that older writers put into the FourCC.
struct Format {
  std::uint32_t dxgi;
  std::uint32_t code;
  TexelFormat texels;
};
constexpr std::array<Format, 16> kFormats = {{
    {54, 111, {TexelCode::half, 1}},
    {34, 112, {TexelCode::half, 2}},
    {10, 113, {TexelCode::half, 4}},
    {41, 114, {TexelCode::float32, 1}},
    {16, 115, {TexelCode::float32, 2}},
    {6, 0, {TexelCode::float32, 3}},
    {2, 116, {TexelCode::float32, 4}},
    {28, 0, {TexelCode::unorm8, 4}},
    {29, 0, {TexelCode::unorm8, 4, true}},
    {87, 0, {TexelCode::unorm8, 4, false, true}},
    {91, 0, {TexelCode::unorm8, 4, true, true}},
    {11, 36, {TexelCode::unorm16, 4}},
    {26, 0, {TexelCode::r11g11b10, 3}},
    {67, 0, {TexelCode::rgb9e5, 3}},
    {kBc6hUnsigned, 0, {TexelCode::bc6h_unsigned, 3}},
    {kBc6hSigned, 0, {TexelCode::bc6h_signed, 3}},
}};

// Calls visit(level, face) in the order of the file: all levels of a face, one face after the other.
template <typename Visit>
void for_each_image(const EnvMapLayout& layout, Visit&& visit) {
  for (int face = 0; face < 6; ++face) {
    for (int level = 0; level < layout.levels; ++level) visit(level, face);
  }
}

std::size_t values_of_face(const EnvMapLayout& layout, int level) {
  return (layout.level_offset(level + 1) - layout.level_offset(level)) / 6;
}

std::size_t blocks_across(const EnvMapLayout& layout, int level) {
  return (static_cast<std::size_t>(layout.level_width(level)) + 3) / 4;
}

std::uint64_t bc6h_bytes(const EnvMapLayout& layout) {
  std::uint64_t bytes = 0;
  for_each_image(layout, [&](int level, int) {
    const std::uint64_t across = blocks_across(layout, level);
    bytes += across * across * kBc6hBytes;
  });
  return bytes;
}

// `bytes` of a line of texels or, of compressed ones, of the whole finest level.
void put_header(ByteWriter& out, const EnvMapLayout& layout, std::uint32_t dxgi, std::size_t bytes,
                bool is_compressed) {
  const bool levels = layout.levels > 1;
  const auto side = static_cast<std::uint32_t>(layout.width);
  const auto put = [&](std::initializer_list<std::uint32_t> values) {
    for (const std::uint32_t value : values) out.put(value);
  };
  const std::uint32_t size_kind = is_compressed ? kFlagLinearSize : kFlagPitch;
  put({kMagic, 124, kFlags | size_kind | (levels ? kFlagLevels : 0U), side, side});
  put({static_cast<std::uint32_t>(bytes), 0, static_cast<std::uint32_t>(layout.levels)});
  for (int i = 0; i < 11; ++i) put({0});
  put({32, kFourCc, kDx10, 0, 0, 0, 0, 0});
  put({kCaps | (levels ? kCapsLevels : 0U), kCube | kAllFaces, 0, 0, 0});
  put({dxgi, kTexture2d, kMiscCube, 1, layout.channels == 3 ? kOpaque : 0U});
}

}  // namespace

bool is_dds(const std::string& path) { return has_extension(path, ".dds"); }

void check_dds_path(const std::string& path, const Projection& projection, PixelFormat format) {
  if (projection.kind != ProjectionKind::cube) {
    throw InvalidArgument("map", to_string(projection), "a cube map: DDS is written of no other projection");
  }
  if (format == PixelFormat::uint8 || format == PixelFormat::uint16) {
    throw FileError(path, "its format cannot store these pixels, expected half or float32");
  }
  const AtomicFile checks_the_folder(path);
}

SaveReport save_dds(const std::string& path, const EnvMapView& map, PixelFormat pixels) {
  validate(map);
  check_dds_path(path, map.layout.projection, pixels);
  const EnvMapLayout& layout = map.layout;
  if (layout.channels > 4) {
    throw InvalidArgument("channels", std::to_string(layout.channels), "1 to 4 in a DDS file");
  }
  const bool whole = pixels == PixelFormat::float32;
  const int stored = layout.channels == 3 ? 4 : layout.channels;
  const Format& format = *std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& f) {
    return f.texels.channels == stored && f.texels.code == (whole ? TexelCode::float32 : TexelCode::half);
  });
  ByteWriter out;
  put_header(out, layout, format.dxgi, stored_bytes(format.texels, layout.width, 1), false);

  SaveReport report;
  const std::size_t channels = static_cast<std::size_t>(layout.channels);
  for_each_image(layout, [&](int level, int face) {
    const std::size_t count = values_of_face(layout, level);
    const std::span<const float> values =
        map.level(level).subspan(static_cast<std::size_t>(face) * count, count);
    for (std::size_t i = 0; i < count; i += channels) {
      for (std::size_t c = 0; c < static_cast<std::size_t>(stored); ++c) {
        const float v = c < channels ? values[i + c] : 1.0F;
        if (whole) {
          out.put(v);
        } else {
          out.put(half_from_float(clamp_to_half(v, report.clamped_to_half)));
        }
      }
    }
  });
  write_file(path, out.bytes);
  return report;
}

void save_dds_bc6h(const std::string& path, const EnvMapLayout& layout, std::span<const std::byte> blocks) {
  validate(layout);
  check_dds_path(path, layout.projection);
  if (layout.channels != 3) {
    throw InvalidArgument("channels", std::to_string(layout.channels), "3 in blocks of BC6H");
  }
  check_length("blocks", blocks.size(), bc6h_bytes(layout), "bytes of all faces and levels");
  ByteWriter out;
  const std::size_t across = blocks_across(layout, 0);
  put_header(out, layout, kBc6hUnsigned, across * across * kBc6hBytes, true);
  out.bytes.insert(out.bytes.end(), blocks.begin(), blocks.end());
  write_file(path, out.bytes);
}

namespace {

// Four letters, such as DXT5, or a number of Direct3D 9's.
std::string name_of_code(std::uint32_t code) {
  std::string letters;
  for (int shift = 0; shift < 32; shift += 8) letters += static_cast<char>(code >> shift & 0xffU);
  const bool is_text =
      std::all_of(letters.begin(), letters.end(), [](char letter) { return letter > ' ' && letter <= '~'; });
  return is_text ? letters : std::to_string(code);
}

}  // namespace

EnvMap load_dds(const std::string& path, const ImageLimits& limits) {
  return read_dds(path, *image_files::open_bytes(path), limits);
}

EnvMap read_dds(const std::string& path, const image_files::Bytes& bytes, const ImageLimits& limits) {
  const FileBytes in(path, bytes, limits);
  if (in.get<std::uint32_t>(0) != kMagic || in.get<std::uint32_t>(4) != 124 ||
      in.get<std::uint32_t>(76) != 32) {
    throw FileError(path, "is not a DDS file");
  }
  const bool has_code = (in.get<std::uint32_t>(80) & kFourCc) != 0;
  const auto code = in.get<std::uint32_t>(84);
  const bool dx10 = has_code && code == kDx10;
  const auto dxgi = dx10 ? in.get<std::uint32_t>(kHeaderBytes) : 0U;
  const auto format = std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& f) {
    return dx10 ? f.dxgi == dxgi : has_code && f.code != 0 && f.code == code;
  });
  if (format == kFormats.end()) {
    const std::string found = dx10       ? "the DXGI format " + std::to_string(dxgi)
                              : has_code ? "the format code " + name_of_code(code)
                                         : "pixels of integers";
    throw FileError(
        path,
        "has " + found + ", expected float16, float32, BC6H, RGB9E5, R11G11B10, or RGBA of 8 or 16 bits");
  }
  const bool cube = dx10 ? in.get<std::uint32_t>(kHeaderBytes + 4) == kTexture2d &&
                               (in.get<std::uint32_t>(kHeaderBytes + 8) & kMiscCube) != 0 &&
                               in.get<std::uint32_t>(kHeaderBytes + 12) == 1
                         : (in.get<std::uint32_t>(112) & (kCube | kAllFaces)) == (kCube | kAllFaces);
  if (!cube) throw FileError(path, "is not a single cube map of six faces");
  const auto height = in.get<std::uint32_t>(12);
  const auto width = in.get<std::uint32_t>(16);
  const auto most = static_cast<std::uint32_t>(std::min(limits.max_side, 65536));
  if (width < 1 || width > most || width != height) {
    throw FileError(path, "has faces of " + std::to_string(width) + " x " + std::to_string(height) +
                              " texels, expected square ones of 1 to " + std::to_string(most));
  }
  const int side = static_cast<int>(width);
  const auto levels = std::max(in.get<std::uint32_t>(28), 1U);
  if (levels > static_cast<std::uint32_t>(full_level_count(side, side))) {
    throw FileError(path, "has " + std::to_string(levels) + " levels, more than its size allows");
  }
  const EnvMapLayout layout{
      {ProjectionKind::cube}, side, side, static_cast<int>(levels), format->texels.channels};
  if (layout.size() > limits.max_bytes / sizeof(float)) throw FileError(path, "is too large");
  // Whether the file holds what its header promises is known before memory is taken for it.
  std::uint64_t place = kHeaderBytes + (dx10 ? kDx10Bytes : 0);
  std::uint64_t expected = 0;
  const auto face_bytes = [&](int level) {
    return stored_bytes(format->texels, layout.level_width(level), layout.level_height(level));
  };
  for_each_image(layout, [&](int level, int) { expected += face_bytes(level); });
  in.require(place, expected);
  const auto alpha = dx10 ? in.get<std::uint32_t>(kHeaderBytes + 16) & 7U : 0U;
  EnvMap map = make_envmap(layout, default_channels(layout.channels));
  std::vector<unsigned char> stored;
  for_each_image(layout, [&](int level, int face) {
    const std::size_t count = values_of_face(layout, level);
    const std::size_t first = layout.level_offset(level) + static_cast<std::size_t>(face) * count;
    stored.resize(face_bytes(level));
    in.read(place, stored);
    place += stored.size();
    decode_texels(format->texels, layout.level_width(level), layout.level_height(level), stored,
                  std::span(map.values).subspan(first, count));
  });
  if (layout.channels == 4 && alpha == kOpaque) return without_alpha(map);
  if (layout.channels == 4 && format->texels.is_integer() && alpha != kPremultiplied) {
    multiply_by_alpha(map.values);
  }
  return map;
}

}  // namespace mirrorbake
