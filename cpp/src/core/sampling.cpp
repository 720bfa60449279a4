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

std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) {
  return reverse_bits(laine_karras_permutation(reverse_bits(x), seed));
}

// The second Sobol dimension: generator matrix of Pascal's triangle mod 2, column by column.
std::uint32_t sobol_second_dimension(std::uint32_t index) {
  std::uint32_t result = 0;
  for (std::uint32_t column = 0x80000000u; index != 0; index >>= 1, column ^= column >> 1) {
    if (index & 1u) result ^= column;
  }
  return result;
}

}  // namespace

glm::vec2 sobol_2d(std::uint32_t index, std::uint64_t sequence) {
  const std::uint64_t seeds = hash64(sequence);
  const std::uint64_t more_seeds = hash64(seeds);
  const std::uint32_t shuffled = owen_scramble(index, static_cast<std::uint32_t>(seeds));
  const std::uint32_t x = owen_scramble(reverse_bits(shuffled), static_cast<std::uint32_t>(seeds >> 32));
  const std::uint32_t y =
      owen_scramble(sobol_second_dimension(shuffled), static_cast<std::uint32_t>(more_seeds));
  return {unit_float(x), unit_float(y)};
}

}  // namespace mirrorbake
