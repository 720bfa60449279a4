#include <algorithm>
#include <array>
#include <string_view>

#include "guard.hpp"
#include "mirrorbake/core/error.hpp"

namespace mirrorbake::image_files {
namespace {

// A decoder makes up what a truncated file lacks and carries on. Every complete file ends with an
// end-of-image marker, possibly followed by a few bytes that programs append.
bool is_complete(const Bytes& bytes) {
  constexpr std::uint64_t kTail = 4096;
  constexpr std::array<unsigned char, 2> kEnd = {0xff, 0xd9};
  const std::uint64_t count = std::min(bytes.size(), kTail);
  std::vector<unsigned char> tail(count);
  tail.resize(bytes.read(bytes.size() - count, tail));
  return std::search(tail.begin(), tail.end(), kEnd.begin(), kEnd.end()) != tail.end();
}

constexpr unsigned char kStartOfScan = 0xda;
constexpr unsigned char kComment = 0xfe;
constexpr unsigned char kApp0 = 0xe0;   // JFIF
constexpr unsigned char kApp1 = 0xe1;   // EXIF, XMP
constexpr unsigned char kApp11 = 0xeb;  // nothing that OpenImageIO or libjpeg reads
constexpr unsigned char kApp14 = 0xee;  // Adobe, which says how colours are encoded
constexpr unsigned char kApp15 = 0xef;

}  // namespace

Guard guard_jpeg(const std::string& name, const Bytes& bytes) {
  if (!is_complete(bytes)) throw FileError(name, "is truncated");
  Guard guard;
  std::uint64_t place = 2;  // after the start of the image
  bool has_exif = false;
  std::array<unsigned char, 4> head{};
  while (bytes.read(place, head) == head.size() && head[0] == 0xff) {
    const unsigned char marker = head[1];
    if (marker == 0xff) {  // a marker may be preceded by fill bytes
      ++place;
      continue;
    }
    if (marker == kStartOfScan) break;
    const std::uint64_t length = std::uint64_t{head[2]} << 8 | head[3];  // with itself
    if (length < 2) break;
    const bool is_application = marker >= kApp0 && marker <= kApp15;
    if (marker == kComment || (is_application && marker != kApp0 && marker != kApp14)) {
      constexpr std::string_view kExif("Exif\0\0", 6);
      std::vector<unsigned char> segment(length - 2);
      segment.resize(bytes.read(place + 4, segment));
      if (!has_exif && marker == kApp1 && segment.size() > kExif.size() &&
          std::equal(kExif.begin(), kExif.end(), segment.begin(),
                     [](char a, unsigned char b) { return static_cast<unsigned char>(a) == b; })) {
        has_exif = true;
        guard.orientation = exif_orientation({segment.begin() + kExif.size(), segment.end()});
      }
      guard.patches.push_back({place + 1, {kApp11}});
    }
    place += 2 + length;
  }
  return guard;
}

}  // namespace mirrorbake::image_files
