#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "exr_file.hpp"
#include "mirrorbake/core/error.hpp"

namespace mirrorbake::image_files {
namespace {

// "OpenEXR File Layout": magic number and version; headers of attributes, each a name, the name of its type,
// its size and its value; an empty name ends a header, an empty header those of several parts.
constexpr std::uint64_t kHeadersAt = 8;
constexpr unsigned char kMultiPart = 0x10;  // in the second byte of the version
constexpr std::size_t kLongestName = 255;

struct FixedSize {
  std::string_view type;
  std::uint64_t bytes;
};

// "Predefined Attribute Types" whose values have one size: OpenEXR reads so much of them, whatever the file
// says.
constexpr FixedSize kFixedSizes[] = {
    {"box2f", 16},
    {"box2i", 16},
    {"chromaticities", 32},
    {"compression", 1},
    {"deepImageState", 1},
    {"double", 8},
    {"envmap", 1},
    {"float", 4},
    {"int", 4},
    {"keycode", 28},
    {"lineOrder", 1},
    {"m33d", 72},
    {"m33f", 36},
    {"m44d", 128},
    {"m44f", 64},
    {"rational", 8},
    {"tiledesc", 9},
    {"timecode", 8},
    {"v2d", 16},
    {"v2f", 8},
    {"v2i", 8},
    {"v3d", 24},
    {"v3f", 12},
    {"v3i", 12},
};
constexpr std::uint64_t kOfAChannel = 16;       // pixel type, linearity, sampling
constexpr std::uint64_t kMostInflation = 1032;  // of deflate: RFC 1951 stores 258 bytes in 2 bits

class Walk {
 public:
  Walk(const std::string& name, const Bytes& bytes) : name_(name), bytes_(bytes) {}

  /// The name that stands here; moves past it.
  std::string take_name() {
    std::array<unsigned char, kLongestName + 1> raw{};
    const std::size_t size = bytes_.read(place_, raw);
    const void* end = std::memchr(raw.data(), 0, size);
    if (end == nullptr) throw FileError(name_, "is damaged: a name in its header does not end");
    const auto length = static_cast<std::size_t>(static_cast<const unsigned char*>(end) - raw.data());
    place_ += length + 1;
    return {reinterpret_cast<const char*>(raw.data()), length};
  }

  /// Moves past the size and the value of an attribute. OpenEXR follows what the value says of its own length
  /// and would read on elsewhere, and make room for what it finds there, where the two differ.
  void take_value(const std::string& type) {
    const std::uint64_t size = take_count("an attribute of its header");
    const std::uint64_t end = place_ + size;
    if (size != size_by_type(type, size)) {
      throw FileError(name_, "is damaged: an attribute of its header has " + std::to_string(size) +
                                 " bytes, not the size of its type");
    }
    place_ = end;
  }

 private:
  /// A number of bytes that follow; FileError if the file has fewer.
  std::uint64_t take_count(const char* what) {
    const std::int32_t count = take_int();
    if (count < 0 || static_cast<std::uint64_t>(count) > bytes_.size() - place_) {
      throw FileError(name_, "is damaged: " + std::string(what) + " claims " + std::to_string(count) +
                                 " bytes, more than the file has");
    }
    return static_cast<std::uint64_t>(count);
  }

  std::int32_t take_int() {
    std::array<unsigned char, 4> raw{};
    if (bytes_.read(place_, raw) != raw.size()) throw FileError(name_, "is truncated");
    place_ += raw.size();
    std::int32_t value = 0;
    std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }

  /// Length of the value that stands here as OpenEXR reads it, which is given `size` for it.
  std::uint64_t size_by_type(const std::string& type, std::uint64_t size) {
    for (const FixedSize& fixed : kFixedSizes) {
      if (type == fixed.type) return fixed.bytes;
    }
    const std::uint64_t start = place_;
    if (type == "chlist") {
      while (!take_name().empty()) place_ += kOfAChannel;
      return place_ - start;
    }
    if (type == "preview" && size >= 8) {
      const auto width = static_cast<std::uint32_t>(take_int());
      const auto height = static_cast<std::uint32_t>(take_int());
      return width > size || height > size ? size + 1 : 8 + 4 * std::uint64_t{width} * height;
    }
    if (type == "stringvector") {
      while (place_ < start + size) place_ += take_count("a text of its header");
      return place_ - start;
    }
    if (type == "idmanifest" && size >= 4) {
      return static_cast<std::uint32_t>(take_int()) > kMostInflation * size ? size + 1 : size;
    }
    return size;
  }

  const std::string& name_;
  const Bytes& bytes_;
  std::uint64_t place_ = kHeadersAt;
};

}  // namespace

void check_exr(const std::string& name, const Bytes& bytes) {
  std::array<unsigned char, kHeadersAt> head{};
  if (bytes.read(0, head) != head.size()) throw FileError(name, "is truncated");
  const bool several = (head[5] & kMultiPart) != 0;
  Walk walk(name, bytes);
  for (bool first = true;; first = false) {
    std::size_t attributes = 0;
    while (!walk.take_name().empty()) {
      walk.take_value(walk.take_name());
      ++attributes;
    }
    // OpenEXR reads on after an empty first header, where no size has been checked.
    if (first && attributes == 0) throw FileError(name, "is damaged: its header is empty");
    if (!several || attributes == 0) return;
  }
}

}  // namespace mirrorbake::image_files
