#include "png_check.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake::image_files {
namespace {

std::uint32_t big_endian(std::span<const unsigned char, 4> bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         std::uint32_t{bytes[3]};
}

bool is_letter(unsigned char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

}  // namespace

void check_png(const std::string& name, const std::function<std::size_t(std::span<unsigned char>)>& read) {
  const auto take = [&](std::span<unsigned char> to) {
    if (read(to) != to.size()) throw FileError(name, "is truncated");
  };
  std::array<unsigned char, 8> head{};  // the signature, then length and name of every chunk
  take(head);
  std::vector<unsigned char> buffer(std::size_t{1} << 16);
  for (bool first = true;; first = false) {
    take(head);
    const std::span<const unsigned char> type = std::span(head).last<4>();
    const std::string text(type.begin(), type.end());
    if (!std::all_of(type.begin(), type.end(), is_letter) || (first && text != "IHDR")) {
      throw FileError(name, "is damaged: its chunks cannot be told apart");
    }
    uLong crc = crc32(0, type.data(), static_cast<uInt>(type.size()));
    for (std::size_t left = big_endian(std::span(head).first<4>()); left > 0;) {
      const std::span<unsigned char> part = std::span(buffer).first(std::min(left, buffer.size()));
      take(part);
      crc = crc32(crc, part.data(), static_cast<uInt>(part.size()));
      left -= part.size();
    }
    std::array<unsigned char, 4> stored{};
    take(stored);
    // A small first letter marks what decoders may skip, and skip if it is damaged.
    const bool critical = type[0] <= 'Z';
    if (critical && big_endian(stored) != crc) {
      throw FileError(name, "is damaged: the checksum of its chunk " + text + " is wrong");
    }
    if (text == "IEND") return;
  }
}

}  // namespace mirrorbake::image_files
