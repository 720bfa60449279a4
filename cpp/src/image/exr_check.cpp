#include <array>
#include <cstdint>
#include <cstring>
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

class Walk {
 public:
  Walk(const std::string& name, const Bytes& bytes) : name_(name), bytes_(bytes) {}

  std::uint64_t place = kHeadersAt;

  /// Length of the name that stands here; moves past it.
  std::size_t take_name() {
    std::array<unsigned char, kLongestName + 1> raw{};
    const std::size_t size = bytes_.read(place, raw);
    const void* end = std::memchr(raw.data(), 0, size);
    if (end == nullptr) throw FileError(name_, "is damaged: a name in its header does not end");
    const std::size_t length = static_cast<std::size_t>(static_cast<const unsigned char*>(end) - raw.data());
    place += length + 1;
    return length;
  }

  void take_value() {
    std::array<unsigned char, 4> raw{};
    if (bytes_.read(place, raw) != raw.size()) throw FileError(name_, "is truncated");
    place += raw.size();
    std::int32_t size = 0;
    std::memcpy(&size, raw.data(), sizeof size);
    if (size < 0 || static_cast<std::uint64_t>(size) > bytes_.size() - place) {
      throw FileError(name_, "is damaged: an attribute of its header claims " + std::to_string(size) +
                                 " bytes, more than the file has");
    }
    place += static_cast<std::uint64_t>(size);
  }

 private:
  const std::string& name_;
  const Bytes& bytes_;
};

}  // namespace

void check_exr(const std::string& name, const Bytes& bytes) {
  std::array<unsigned char, kHeadersAt> head{};
  if (bytes.read(0, head) != head.size()) throw FileError(name, "is truncated");
  const bool several = (head[5] & kMultiPart) != 0;
  Walk walk(name, bytes);
  for (;;) {
    std::size_t attributes = 0;
    while (walk.take_name() > 0) {
      walk.take_name();
      walk.take_value();
      ++attributes;
    }
    if (!several || attributes == 0) return;
  }
}

}  // namespace mirrorbake::image_files
