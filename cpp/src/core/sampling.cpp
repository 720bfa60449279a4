#include "mirrorbake/core/sampling.hpp"

namespace mirrorbake {
namespace {

std::uint32_t reverse_bits(std::uint32_t x) {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
  x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
  return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

// Laine-Karras permutation with the constants of Burley's listing: every bit is flipped depending on the
// bits below it only, which on reversed bits is a nested uniform (Owen) scramble.
std::uint32_t laine_karras_permutation(std::uint32_t x, std::uint32_t seed) {
  x += seed;
  x ^= x * 0x6c50b47cu;
  x ^= x * 0xb82f1e52u;
  x ^= x * 0xc7afe638u;
  x ^= x * 0x8d22f6e6u;
  return x;
}

// The second Sobol dimension of an index, its bits reversed. The generator matrix is Pascal's triangle mod 2,
// the Kronecker power of ((1, 1), (0, 1)), and so takes one step per factor.
std::uint32_t reversed_sobol_second_dimension(std::uint32_t index) {
  index ^= index >> 16;
  index ^= (index & 0xff00ff00u) >> 8;
  index ^= (index & 0xf0f0f0f0u) >> 4;
  index ^= (index & 0xccccccccu) >> 2;
  return index ^ ((index & 0xaaaaaaaau) >> 1);
}

}  // namespace

glm::vec2 sobol_2d(std::uint32_t index, std::uint64_t sequence) {
  const std::uint64_t seeds = hash64(sequence);
  const std::uint64_t more_seeds = hash64(seeds);
  // An Owen scramble is the permutation between two reversals. Those that cancel are left out: of the first
  // Sobol dimension, which is the index reversed, and of the second.
  const std::uint32_t shuffled =
      reverse_bits(laine_karras_permutation(reverse_bits(index), static_cast<std::uint32_t>(seeds)));
  const std::uint32_t x =
      reverse_bits(laine_karras_permutation(shuffled, static_cast<std::uint32_t>(seeds >> 32)));
  const std::uint32_t y = reverse_bits(laine_karras_permutation(reversed_sobol_second_dimension(shuffled),
                                                                static_cast<std::uint32_t>(more_seeds)));
  return {unit_float(x), unit_float(y)};
}

}  // namespace mirrorbake
