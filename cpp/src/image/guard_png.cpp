#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "guard.hpp"
#include "mirrorbake/core/error.hpp"

namespace mirrorbake::image_files {
namespace {

using Word = std::array<unsigned char, 4>;

std::uint32_t big_endian(const unsigned char* bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         std::uint32_t{bytes[3]};
}

Word big_endian_bytes(std::uint32_t value) {
  return {static_cast<unsigned char>(value >> 24), static_cast<unsigned char>(value >> 16),
          static_cast<unsigned char>(value >> 8), static_cast<unsigned char>(value)};
}

bool is_letter(unsigned char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

// Chunks that change what the pixels mean, of those that a decoder may skip.
bool is_wanted(std::string_view type) { return type == "tRNS" || type == "gAMA" || type == "sRGB"; }

// A type of no meaning, which decoders skip: small first letter.
constexpr Word kSkipped = {'s', 'k', 'I', 'p'};

// PNG (ISO/IEC 15948) 11.2.2: channels of the colour types 0, 2, 3, 4 and 6.
std::size_t pixel_bits(const std::array<unsigned char, 13>& header) {
  const std::size_t depth = header[8];
  switch (header[9]) {
    case 2: return 3 * depth;
    case 4: return 2 * depth;
    case 6: return 4 * depth;
    default: return depth;
  }
}

}  // namespace

Guard guard_png(const std::string& name, const Bytes& bytes) {
  Guard guard;
  std::uint64_t place = 8;  // after the signature
  const auto take = [&](std::span<unsigned char> to) {
    if (bytes.read(place, to) != to.size()) throw FileError(name, "is truncated");
    place += to.size();
  };
  std::array<unsigned char, 8> head{};  // length and name of a chunk
  std::vector<unsigned char> buffer(std::size_t{1} << 16);
  for (bool first = true;; first = false) {
    const std::uint64_t type_place = place + 4;
    take(head);
    const std::string_view type(reinterpret_cast<const char*>(head.data()) + 4, 4);
    if (!std::all_of(head.begin() + 4, head.end(), is_letter) || (first && type != "IHDR")) {
      throw FileError(name, "is damaged: its chunks cannot be told apart");
    }
    uLong crc = crc32(0, head.data() + 4, 4);
    uLong crc_if_skipped = crc32(0, kSkipped.data(), 4);
    const std::uint32_t length = big_endian(head.data());
    // A small first letter marks what decoders may skip, and skip if it is damaged.
    const bool is_critical = head[4] <= 'Z';
    const bool is_skipped = !is_critical && !is_wanted(type);
    for (std::size_t left = length; left > 0;) {
      const std::span<unsigned char> part = std::span(buffer).first(std::min(left, buffer.size()));
      take(part);
      crc = crc32(crc, part.data(), static_cast<uInt>(part.size()));
      if (is_skipped) crc_if_skipped = crc32(crc_if_skipped, part.data(), static_cast<uInt>(part.size()));
      left -= part.size();
    }
    if (first && length == 13) {
      std::array<unsigned char, 13> header{};
      std::copy_n(buffer.begin(), header.size(), header.begin());
      guard.pixel_bits = pixel_bits(header);
    }
    const std::uint64_t crc_place = place;
    Word stored{};
    take(stored);
    if (is_critical && big_endian(stored.data()) != crc) {
      throw FileError(name, "is damaged: the checksum of its chunk " + std::string(type) + " is wrong");
    }
    if (is_skipped) {
      guard.patches.push_back({type_place, {kSkipped.begin(), kSkipped.end()}});
      const Word replaced = big_endian_bytes(static_cast<std::uint32_t>(crc_if_skipped));
      guard.patches.push_back({crc_place, {replaced.begin(), replaced.end()}});
    }
    if (type == "IEND") return guard;
  }
}

}  // namespace mirrorbake::image_files
