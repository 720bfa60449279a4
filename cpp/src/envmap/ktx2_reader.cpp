#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "cube_file.hpp"
#include "ktx2_file.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/image/primaries.hpp"
#include "texel_format.hpp"

namespace mirrorbake {
namespace {

// VkFormat numbers of the Vulkan specification, VK_FORMAT_R8_UNORM and so on.
constexpr std::array<std::pair<std::uint32_t, TexelFormat>, 28> kFormats = {{
    {9, {TexelCode::unorm8, 1}},
    {15, {TexelCode::unorm8, 1, true}},
    {16, {TexelCode::unorm8, 2}},
    {22, {TexelCode::unorm8, 2, true}},
    {23, {TexelCode::unorm8, 3}},
    {29, {TexelCode::unorm8, 3, true}},
    {30, {TexelCode::unorm8, 3, false, true}},
    {36, {TexelCode::unorm8, 3, true, true}},
    {37, {TexelCode::unorm8, 4}},
    {43, {TexelCode::unorm8, 4, true}},
    {44, {TexelCode::unorm8, 4, false, true}},
    {50, {TexelCode::unorm8, 4, true, true}},
    {51, {TexelCode::unorm8, 4}},  // A8B8G8R8 in a word: the same bytes
    {57, {TexelCode::unorm8, 4, true}},
    {70, {TexelCode::unorm16, 1}},
    {77, {TexelCode::unorm16, 2}},
    {84, {TexelCode::unorm16, 3}},
    {91, {TexelCode::unorm16, 4}},
    {76, {TexelCode::half, 1}},
    {83, {TexelCode::half, 2}},
    {90, {TexelCode::half, 3}},
    {97, {TexelCode::half, 4}},
    {100, {TexelCode::float32, 1}},
    {103, {TexelCode::float32, 2}},
    {106, {TexelCode::float32, 3}},
    {109, {TexelCode::float32, 4}},
    {122, {TexelCode::r11g11b10, 3}},
    {123, {TexelCode::rgb9e5, 3}},
}};
constexpr std::uint32_t kBc6hUnsigned = 143, kBc6hSigned = 144;

enum class Packing : std::uint32_t { none = 0, basis_lz = 1, zstandard = 2, zlib = 3 };

// Khronos Data Format Specification 1.3, basic descriptor block.
struct DataFormat {
  std::uint8_t model = 0;
  std::uint8_t primaries = 0;
  std::uint8_t transfer = 0;
  std::uint8_t flags = 0;
};
constexpr std::uint8_t kModelEtc1s = 163, kModelUastc = 166;
constexpr std::uint8_t kPrimariesRec709 = 1;  // 0 says nothing
constexpr std::uint8_t kTransferSrgb = 2;     // 1 is linear, 0 says nothing
constexpr std::uint8_t kPremultiplied = 1;

struct Header {
  TexelFormat format;
  EnvMapLayout layout;
  bool is_picture = false;
  bool is_premultiplied = false;
  std::uint8_t primaries = 0;
  Packing packing = Packing::none;
  std::string swizzle;
  std::string orientation;
};

// Chromaticities of the Khronos Data Format Specification 1.3, §14.1, all with the white D65.
std::optional<image_files::Primaries> known_primaries(std::uint8_t number) {
  constexpr glm::dvec2 d65(0.3127, 0.3290);
  switch (number) {
    case 2: return image_files::Primaries{{{0.640, 0.330}, {0.290, 0.600}, {0.150, 0.060}, d65}};
    case 3: return image_files::Primaries{{{0.630, 0.340}, {0.310, 0.595}, {0.155, 0.070}, d65}};
    case 4: return image_files::Primaries{{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, d65}};
    case 10: return image_files::Primaries{{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, d65}};
    case 11: return image_files::Primaries{{{0.640, 0.330}, {0.210, 0.710}, {0.150, 0.060}, d65}};
    default: return std::nullopt;
  }
}

// The same light by Rec. 709's numbers, which may be below 0. Grey is grey under the one white.
void convert_primaries(EnvMap& map, const image_files::Primaries& primaries) {
  const auto channels = static_cast<std::size_t>(map.layout.channels);
  if (channels < 3) return;
  const glm::dmat3 converted = image_files::rec709_from_xyz() * image_files::xyz_from_rgb(primaries);
  for (std::size_t i = 0; i < map.values.size(); i += channels) {
    const glm::dvec3 color = converted * glm::dvec3(map.values[i], map.values[i + 1], map.values[i + 2]);
    for (int c = 0; c < 3; ++c) map.values[i + static_cast<std::size_t>(c)] = static_cast<float>(color[c]);
  }
}

std::string name_of(std::uint32_t vk_format) {
  std::string number = "VkFormat " + std::to_string(vk_format);
  if (vk_format >= 131 && vk_format <= 146) return number + ", blocks of BC1 to BC7";
  if (vk_format >= 147 && vk_format <= 156) return number + ", blocks of ETC2";
  if (vk_format >= 157 && vk_format <= 184) return number + ", blocks of ASTC";
  return number;
}

DataFormat data_format(const FileBytes& in) {
  const std::uint64_t place = in.get<std::uint32_t>(48);
  if (in.get<std::uint32_t>(52) < 16) return {};
  return {in.get<std::uint8_t>(place + 12), in.get<std::uint8_t>(place + 13),
          in.get<std::uint8_t>(place + 14), in.get<std::uint8_t>(place + 15)};
}

TexelFormat texel_format(const std::string& name, std::uint32_t vk_format, const DataFormat& data) {
  if (data.model == kModelEtc1s || data.model == kModelUastc) {
    throw FileError(name, std::string("is compressed by Basis Universal (") +
                              (data.model == kModelUastc ? "UASTC" : "ETC1S") +
                              "), expected plain texels or BC6H: convert it by ktx transcode or ktx extract");
  }
  TexelFormat format;
  if (vk_format == kBc6hUnsigned || vk_format == kBc6hSigned) {
    format = {vk_format == kBc6hSigned ? TexelCode::bc6h_signed : TexelCode::bc6h_unsigned, 3};
  } else {
    const auto* known = std::find_if(kFormats.begin(), kFormats.end(),
                                     [&](const auto& entry) { return entry.first == vk_format; });
    if (known == kFormats.end()) {
      throw FileError(name, "has the pixel format " + name_of(vk_format) +
                                ", expected 8 or 16 bits, float16 or float32 of one to four channels, "
                                "RGB9E5, R11G11B10 or BC6H");
    }
    format = known->second;
  }
  if (data.transfer > kTransferSrgb || (data.transfer == kTransferSrgb && !format.is_integer())) {
    throw FileError(name, "has texels of the transfer function " + std::to_string(data.transfer) +
                              ", expected linear ones, or integers of sRGB");
  }
  if (data.primaries > kPrimariesRec709 && !known_primaries(data.primaries)) {
    throw FileError(name, "has colours of the primaries " + std::to_string(data.primaries) +
                              " of the Khronos Data Format, expected those of Rec. 709, Rec. 601, Rec. 2020, "
                              "Display P3 or Adobe RGB");
  }
  format.is_srgb = format.is_srgb || data.transfer == kTransferSrgb;
  return format;
}

// Value of a key of the file's key/value data without its terminating zero, which is there or not as its
// writer likes; empty if there is none.
std::string value_of(const FileBytes& in, const std::string& name, std::string_view key) {
  constexpr std::uint64_t kLongest = 64;
  std::uint64_t place = in.get<std::uint32_t>(56);
  const std::uint64_t end = place + in.get<std::uint32_t>(60);
  in.require(place, end - place);
  while (end - place >= sizeof(std::uint32_t)) {
    const std::uint64_t size = in.get<std::uint32_t>(place);
    place += sizeof(std::uint32_t);
    if (size < 2 || size > end - place) throw FileError(name, "has damaged key/value data");
    if (size > key.size() && size <= key.size() + kLongest) {
      std::vector<unsigned char> entry(size);
      in.read(place, entry);
      if (entry[key.size()] == 0 && std::equal(key.begin(), key.end(), entry.begin())) {
        std::string value(entry.begin() + static_cast<std::ptrdiff_t>(key.size()) + 1, entry.end());
        while (!value.empty() && value.back() == '\0') value.pop_back();
        return value;
      }
    }
    place = std::min(end, place + (size + 3) / 4 * 4);
  }
  return {};
}

// What the swizzle and the orientation may say; others are wrong.
void check_words(const std::string& name, const Header& header) {
  const std::string& swizzle = header.swizzle;
  if (!swizzle.empty() && (swizzle.size() != 4 || swizzle.find_first_not_of("rgba01") != std::string::npos)) {
    throw FileError(name, "has the swizzle '" + valid_utf8(swizzle) + "', expected four of r, g, b, a, 0, 1");
  }
  const std::string& way = header.orientation;
  const bool is_way = way.size() >= 2 && (way[0] == 'r' || way[0] == 'l') && (way[1] == 'd' || way[1] == 'u');
  if (!way.empty() && !(header.is_picture ? is_way : way == "rd")) {
    throw FileError(name, "has the orientation '" + valid_utf8(way) + "', expected " +
                              (header.is_picture ? "rd, ru, ld or lu" : "rd, as cubes have"));
  }
}

Header read_header(const FileBytes& in, const std::string& name, const ImageLimits& limits) {
  std::array<unsigned char, kKtx2Identifier.size()> identifier{};
  in.read(0, identifier);
  if (!std::equal(identifier.begin(), identifier.end(), kKtx2Identifier.begin())) {
    const bool is_older = identifier[5] == '1' &&
                          std::equal(identifier.begin(), identifier.begin() + 5, kKtx2Identifier.begin());
    throw FileError(name, is_older ? "is a KTX 1 file, expected KTX2" : "is not a KTX2 file");
  }
  Header header;
  const DataFormat data = data_format(in);
  header.format = texel_format(name, in.get<std::uint32_t>(12), data);
  header.is_premultiplied = (data.flags & kPremultiplied) != 0;
  header.primaries = data.primaries;
  const auto width = in.get<std::uint32_t>(20);
  const auto height = in.get<std::uint32_t>(24);
  const auto layers = in.get<std::uint32_t>(32);
  const auto faces = in.get<std::uint32_t>(36);
  const auto levels = std::max(in.get<std::uint32_t>(40), 1U);
  const auto packing = in.get<std::uint32_t>(44);
  header.is_picture = faces == 1;
  if (in.get<std::uint32_t>(28) > 1 || (faces != 1 && faces != 6)) {
    throw FileError(name, "is not a single cube map or picture: depth " +
                              std::to_string(in.get<std::uint32_t>(28)) + ", faces " + std::to_string(faces));
  }
  if (layers > 1) throw FileError(name, "is an array of " + std::to_string(layers) + " maps, expected one");
  if (packing > 3) {
    throw FileError(name, "has the supercompression scheme " + std::to_string(packing) +
                              ", expected none, Zstandard or ZLIB");
  }
  header.packing = static_cast<Packing>(packing);
  if (header.packing == Packing::basis_lz) {
    throw FileError(name, "is supercompressed by BasisLZ, expected none, Zstandard or ZLIB");
  }
  const auto most = static_cast<std::uint32_t>(std::min(limits.max_side, 65536));
  if (width < 1 || width > most || height < 1 || height > most || (faces == 6 && width != height)) {
    throw FileError(name, "has faces of " + std::to_string(width) + " x " + std::to_string(height) +
                              " texels, expected " + (faces == 6 ? "square ones of 1 to " : "1 to ") +
                              std::to_string(most));
  }
  const int w = static_cast<int>(width);
  const int h = static_cast<int>(height);
  if (levels > static_cast<std::uint32_t>(full_level_count(w, h))) {
    throw FileError(name, "has " + std::to_string(levels) + " levels, more than its size allows");
  }
  header.layout = {{header.is_picture ? ProjectionKind::latlong : ProjectionKind::cube},
                   w,
                   h,
                   static_cast<int>(levels),
                   header.format.channels};
  if (header.layout.size() > limits.max_bytes / sizeof(float)) throw FileError(name, "is too large");
  header.swizzle = value_of(in, name, kSwizzleKey);
  header.orientation = value_of(in, name, "KTXorientation");
  check_words(name, header);
  return header;
}

struct LevelPlace {
  std::uint64_t offset = 0;
  std::uint64_t stored = 0;
  std::uint64_t unpacked = 0;
};

// Bytes that one byte can become: of deflate 1032; of Zstandard a block of 128 KiB that repeats a byte takes
// four.
std::uint64_t most_expansion(Packing packing) {
  if (packing == Packing::none) return 1;
  return packing == Packing::zlib ? 1032 : std::uint64_t{1} << 15U;
}

// Whether the file holds what its header promises, known before memory is taken for it.
std::vector<LevelPlace> read_index(const FileBytes& in, const std::string& name, const Header& header) {
  std::vector<LevelPlace> index;
  const int faces = face_count(header.layout.projection);
  for (int level = 0; level < header.layout.levels; ++level) {
    const std::uint64_t entry = kKtx2HeaderBytes + kKtx2LevelBytes * static_cast<std::uint64_t>(level);
    const LevelPlace place{in.get<std::uint64_t>(entry), in.get<std::uint64_t>(entry + 8),
                           in.get<std::uint64_t>(entry + 16)};
    const std::uint64_t expected =
        static_cast<std::uint64_t>(faces) *
        stored_bytes(header.format, header.layout.level_width(level), header.layout.level_height(level));
    const bool is_whole =
        header.packing == Packing::none ? place.stored == expected : place.unpacked == expected;
    if (!is_whole) throw FileError(name, "has a damaged index: level " + std::to_string(level));
    in.require(place.offset, place.stored);
    if (expected / most_expansion(header.packing) > place.stored) {
      throw FileError(name, "level " + std::to_string(level) + " claims " + std::to_string(expected) +
                                " bytes, more than " + std::to_string(place.stored) + " can hold");
    }
    index.push_back({place.offset, place.stored, expected});
  }
  return index;
}

std::vector<unsigned char> unpack(const FileBytes& in, const std::string& name, Packing packing,
                                  const LevelPlace& place) {
  std::vector<unsigned char> stored(place.stored);
  in.read(place.offset, stored);
  if (packing == Packing::none) return stored;
  std::vector<unsigned char> result(place.unpacked);
  bool is_whole = false;
  if (packing == Packing::zstandard) {
    const std::size_t size = ZSTD_decompress(result.data(), result.size(), stored.data(), stored.size());
    is_whole = ZSTD_isError(size) == 0 && size == result.size();
  } else {
    // Four GiB are the limit of its index here: uLong has 64 bits, but not everywhere.
    uLongf size = static_cast<uLongf>(result.size());
    is_whole = uncompress(result.data(), &size, stored.data(), static_cast<uLong>(stored.size())) == Z_OK &&
               size == result.size();
  }
  if (!is_whole) {
    throw FileError(name, std::string("is damaged: its ") +
                              (packing == Packing::zstandard ? "Zstandard" : "ZLIB") +
                              " data cannot be unpacked");
  }
  return result;
}

// To the right and down, as images lie here.
void turn_upright(const std::string& orientation, EnvMap& map) {
  const auto channels = static_cast<std::ptrdiff_t>(map.layout.channels);
  for (int level = 0; level < map.layout.levels; ++level) {
    const int height = map.layout.level_height(level);
    const std::ptrdiff_t line = channels * map.layout.level_width(level);
    float* first = map.values.data() + map.layout.level_offset(level);
    if (orientation[1] == 'u') {
      for (int row = 0; row < height / 2; ++row) {
        std::swap_ranges(first + row * line, first + (row + 1) * line, first + (height - 1 - row) * line);
      }
    }
    if (orientation[0] != 'l') continue;
    for (int row = 0; row < height; ++row) {
      for (float *left = first + row * line, *right = left + line - channels; left < right;
           left += channels, right -= channels) {
        std::swap_ranges(left, left + channels, right);
      }
    }
  }
}

// The channels that the swizzle makes of those that are stored: grey where the three colours are one, and
// alpha unless it is always 1. What a file lacks is 0, and alpha 1.
EnvMap swizzled(EnvMap map, const std::string& swizzle) {
  constexpr std::string_view kLetters = "rgba";
  const auto stored = static_cast<std::size_t>(map.layout.channels);
  std::string sources = swizzle;
  for (char& letter : sources) {
    const std::size_t place = kLetters.find(letter);
    if (place != std::string_view::npos && place >= stored) letter = place == 3 ? '1' : '0';
  }
  if (sources == std::string(kLetters.substr(0, stored)) + std::string("0001").substr(stored)) return map;
  const bool is_grey = sources[0] == sources[1] && sources[1] == sources[2];
  std::string kept = is_grey ? sources.substr(0, 1) : sources.substr(0, 3);
  if (sources[3] != '1') kept += sources[3];
  EnvMapLayout layout = map.layout;
  layout.channels = static_cast<int>(kept.size());
  EnvMap result = make_envmap(layout, default_channels(layout.channels));
  for (std::size_t texel = 0; texel < map.values.size() / stored; ++texel) {
    for (std::size_t c = 0; c < kept.size(); ++c) {
      const std::size_t place = kLetters.find(kept[c]);
      result.values[texel * kept.size() + c] = place == std::string_view::npos
                                                   ? (kept[c] == '1' ? 1.0F : 0.0F)
                                                   : map.values[texel * stored + place];
    }
  }
  return result;
}

}  // namespace

MapFile read_ktx2(const std::string& name, const image_files::Bytes& bytes, const ImageLimits& limits) {
  const FileBytes in(name, bytes, limits);
  const Header header = read_header(in, name, limits);
  const EnvMapLayout& layout = header.layout;
  const std::vector<LevelPlace> index = read_index(in, name, header);
  MapFile file{make_envmap(layout, default_channels(layout.channels)), header.is_picture};
  const auto faces = static_cast<std::size_t>(face_count(layout.projection));
  for (int level = 0; level < layout.levels; ++level) {
    const std::vector<unsigned char> texels =
        unpack(in, name, header.packing, index[static_cast<std::size_t>(level)]);
    const std::size_t first = layout.level_offset(level);
    const std::size_t count = (layout.level_offset(level + 1) - first) / faces;
    const std::size_t face_bytes = texels.size() / faces;
    for (std::size_t face = 0; face < faces; ++face) {
      decode_texels(header.format, layout.level_width(level), layout.level_height(level),
                    std::span(texels).subspan(face * face_bytes, face_bytes),
                    std::span(file.map.values).subspan(first + face * count, count));
    }
  }
  if (header.is_picture && !header.orientation.empty()) turn_upright(header.orientation, file.map);
  if (!header.swizzle.empty()) file.map = swizzled(std::move(file.map), header.swizzle);
  if (const auto primaries = known_primaries(header.primaries)) convert_primaries(file.map, *primaries);
  // Floats with alpha are kept as they are, as save_ktx2 writes them.
  if (file.map.layout.channels == 4 && header.format.is_integer() && !header.is_premultiplied) {
    multiply_by_alpha(file.map.values);
  }
  return file;
}

}  // namespace mirrorbake
