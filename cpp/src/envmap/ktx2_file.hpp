#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

/// What the reader and the writer of KTX2 files share ("KTX File Format Specification" version 2.0).
namespace mirrorbake {

constexpr std::array<std::uint8_t, 12> kKtx2Identifier = {0xab, 'K',  'T',  'X',  ' ',  '2',
                                                          '0',  0xbb, '\r', '\n', 0x1a, '\n'};
constexpr std::size_t kKtx2HeaderBytes = 80;
constexpr std::size_t kKtx2LevelBytes = 24;  ///< of its index: offset, bytes, bytes when unpacked

constexpr std::string_view kSwizzleKey = "KTXswizzle";

}  // namespace mirrorbake
