#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <set>

#include "guard.hpp"
#include "mirrorbake/core/error.hpp"

namespace mirrorbake::image_files {
namespace {

constexpr std::uint64_t kTooLong = std::numeric_limits<std::uint64_t>::max();

// Tags that decoding takes (TIFF 6.0, and the supplements for floats and JPEG), and those of MIP-mapped
// textures. What is not here is metadata: XMP, IPTC, EXIF, Photoshop's, ICC profiles.
constexpr std::array<std::uint16_t, 43> kWanted = {254, 255, 256, 257, 258, 259, 262, 263, 264, 265,  266,
                                                   273, 277, 278, 279, 280, 281, 284, 292, 293, 301,  317,
                                                   318, 319, 320, 322, 323, 324, 325, 332, 333, 334,  336,
                                                   338, 339, 340, 341, 347, 529, 530, 531, 532, 33302};

constexpr std::uint16_t kBitsPerSample = 258;
constexpr std::uint16_t kCompression = 259;
constexpr std::uint16_t kPhotometric = 262;
constexpr std::uint16_t kOrientation = 274;
constexpr std::uint16_t kSamplesPerPixel = 277;
constexpr std::uint16_t kTileWidth = 322;

class TiffBytes {
 public:
  explicit TiffBytes(const Bytes& bytes) : bytes_(bytes) {
    std::array<unsigned char, 8> head{};
    if (bytes.read(0, head) != head.size()) return;
    is_big_endian_ = head[0] == 'M';
    is_big_ = number(head.data() + 2, 2) == 43;
    is_good_ = true;
  }

  bool is_good() const { return is_good_; }
  bool is_big() const { return is_big_; }
  std::size_t count_bytes() const { return is_big_ ? 8 : 2; }
  std::size_t entry_bytes() const { return is_big_ ? 20 : 12; }
  std::size_t offset_bytes() const { return is_big_ ? 8 : 4; }

  std::uint64_t number(const unsigned char* from, std::size_t size) const {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value = value << 8 | from[is_big_endian_ ? i : size - 1 - i];
    return value;
  }
  void put(unsigned char* to, std::size_t size, std::uint64_t value) const {
    for (std::size_t i = 0; i < size; ++i) {
      to[is_big_endian_ ? size - 1 - i : i] = static_cast<unsigned char>(value >> (8 * i));
    }
  }
  std::optional<std::uint64_t> number_at(std::uint64_t place, std::size_t size) const {
    std::array<unsigned char, 8> raw{};
    if (bytes_.read(place, std::span(raw).first(size)) != size) return std::nullopt;
    return number(raw.data(), size);
  }
  std::optional<std::uint64_t> first_directory() const { return number_at(is_big_ ? 8 : 4, offset_bytes()); }

  std::vector<unsigned char> bytes_at(std::uint64_t place, std::uint64_t count) const {
    if (count > bytes_.size()) return {};
    std::vector<unsigned char> result(count);
    result.resize(bytes_.read(place, result));
    return result;
  }

 private:
  const Bytes& bytes_;
  bool is_good_ = false;
  bool is_big_endian_ = false;
  bool is_big_ = false;
};

// An entry of a directory: tag, type, count, and the values or where they are.
class Entry {
 public:
  Entry(const TiffBytes& tiff, const unsigned char* raw) : tiff_(tiff), raw_(raw) {}
  std::uint16_t tag() const { return static_cast<std::uint16_t>(tiff_.number(raw_, 2)); }

  /// The first value of a SHORT or a LONG.
  std::uint64_t value() const {
    const std::uint64_t type = tiff_.number(raw_ + 2, 2);
    const std::size_t size = type == 3 ? 2 : type == 4 ? 4 : 0;
    const std::uint64_t count = tiff_.number(raw_ + 4, tiff_.offset_bytes());
    const unsigned char* inlined = raw_ + 4 + tiff_.offset_bytes();
    if (size == 0 || count == 0) return 0;
    if (count <= tiff_.offset_bytes() / size) return tiff_.number(inlined, size);
    return tiff_.number_at(tiff_.number(inlined, tiff_.offset_bytes()), size).value_or(0);
  }

 private:
  const TiffBytes& tiff_;
  const unsigned char* raw_;
};

struct Directory {
  std::uint64_t entries = 0;
  std::vector<unsigned char> raw;  // the entries, and the place of the next directory
};

std::optional<Directory> read_directory(const TiffBytes& tiff, std::uint64_t place) {
  const std::optional<std::uint64_t> count = tiff.number_at(place, tiff.count_bytes());
  if (!count || *count == 0 || *count > 65535) return std::nullopt;
  Directory result{
      *count, tiff.bytes_at(place + tiff.count_bytes(), *count * tiff.entry_bytes() + tiff.offset_bytes())};
  if (result.raw.size() != *count * tiff.entry_bytes() + tiff.offset_bytes()) return std::nullopt;
  return result;
}

int orientation_from(std::uint64_t value) { return value >= 1 && value <= 8 ? static_cast<int>(value) : 1; }

// What the first directory says of the pixels.
void describe(const std::string& name, const TiffBytes& tiff, const Directory& directory, Guard& guard) {
  std::uint64_t bits = 1;
  std::uint64_t samples = 1;
  std::uint64_t photometric = kTooLong;
  bool is_tiled = false;
  for (std::uint64_t i = 0; i < directory.entries; ++i) {
    const Entry entry(tiff, directory.raw.data() + i * tiff.entry_bytes());
    switch (entry.tag()) {
      case kBitsPerSample: bits = entry.value(); break;
      case kCompression: guard.is_fax = entry.value() >= 2 && entry.value() <= 4; break;
      case kPhotometric: photometric = entry.value(); break;
      case kOrientation: guard.orientation = orientation_from(entry.value()); break;
      case kSamplesPerPixel: samples = entry.value(); break;
      case kTileWidth: is_tiled = true; break;
      default: break;
    }
  }
  constexpr std::uint64_t kSeparated = 5;
  if (is_tiled && photometric == kSeparated) {
    throw FileError(
        name, "is a TIFF of CMYK inks in tiles, which OpenImageIO cannot read safely; expected RGB or grey");
  }
  guard.pixel_bits =
      static_cast<std::size_t>(std::min<std::uint64_t>(bits, 64) * std::min<std::uint64_t>(samples, 65535));
}

}  // namespace

Guard guard_tiff(const std::string& name, const Bytes& bytes) {
  const TiffBytes tiff(bytes);
  Guard guard;
  std::set<std::uint64_t> seen;
  std::optional<std::uint64_t> place = tiff.is_good() ? tiff.first_directory() : std::nullopt;
  constexpr std::size_t kMostDirectories = 64;  // more than levels of a texture
  while (place && *place != 0) {
    const std::optional<Directory> directory = read_directory(tiff, *place);
    if (!directory) {
      if (seen.empty()) break;
      throw FileError(name, "is damaged: its directory " + std::to_string(seen.size()) + " cannot be read");
    }
    if (seen.empty()) describe(name, tiff, *directory, guard);
    seen.insert(*place);
    const std::size_t next_place = directory->entries * tiff.entry_bytes();
    const std::uint64_t next = tiff.number(directory->raw.data() + next_place, tiff.offset_bytes());
    const bool goes_on = next != 0 && !seen.contains(next) && seen.size() < kMostDirectories;
    // The directory again, with what is wanted of it.
    Patch patch{*place, std::vector<unsigned char>(tiff.count_bytes())};
    std::uint64_t kept = 0;
    for (std::uint64_t i = 0; i < directory->entries; ++i) {
      const unsigned char* raw = directory->raw.data() + i * tiff.entry_bytes();
      const std::uint16_t tag = Entry(tiff, raw).tag();
      if (std::find(kWanted.begin(), kWanted.end(), tag) == kWanted.end()) continue;
      patch.bytes.insert(patch.bytes.end(), raw, raw + tiff.entry_bytes());
      ++kept;
    }
    if (kept == 0) break;
    tiff.put(patch.bytes.data(), tiff.count_bytes(), kept);
    const std::size_t end = patch.bytes.size();
    patch.bytes.resize(end + tiff.offset_bytes());
    tiff.put(patch.bytes.data() + end, tiff.offset_bytes(), goes_on ? next : 0);
    guard.patches.push_back(std::move(patch));
    if (!goes_on) break;
    place = next;
  }
  if (guard.patches.empty()) throw FileError(name, "is damaged or truncated: it has no readable directory");
  std::sort(guard.patches.begin(), guard.patches.end(),
            [](const Patch& a, const Patch& b) { return a.offset < b.offset; });
  for (std::size_t i = 0; i + 1 < guard.patches.size(); ++i) {
    if (guard.patches[i].offset + guard.patches[i].bytes.size() > guard.patches[i + 1].offset) {
      throw FileError(name, "is damaged: its directories overlap");
    }
  }
  return guard;
}

int exif_orientation(const std::vector<unsigned char>& block) {
  const auto bytes = bytes_in(block);
  const TiffBytes tiff(*bytes);
  const std::optional<std::uint64_t> place = tiff.is_good() ? tiff.first_directory() : std::nullopt;
  const std::optional<Directory> directory = place ? read_directory(tiff, *place) : std::nullopt;
  if (!directory) return 1;
  for (std::uint64_t i = 0; i < directory->entries; ++i) {
    const Entry entry(tiff, directory->raw.data() + i * tiff.entry_bytes());
    if (entry.tag() == kOrientation) return orientation_from(entry.value());
  }
  return 1;
}

}  // namespace mirrorbake::image_files
