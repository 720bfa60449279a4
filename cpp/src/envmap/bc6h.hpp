#pragma once

#include <cstdint>
#include <span>

/// Blocks of BC6H: 4 × 4 texels of three half floats in 16 bytes.
namespace mirrorbake {

constexpr std::size_t kBc6hBytes = 16;

/// Half floats of the texels, row by row, three for each. Every pattern of bits is a block: those that are
/// reserved are black, and no pattern makes NaN or infinity. `is_signed`: DXGI_FORMAT_BC6H_SF16.
void decode_bc6h(std::span<const std::uint8_t, kBc6hBytes> block, bool is_signed,
                 std::span<std::uint16_t, 48> halves);

}  // namespace mirrorbake
