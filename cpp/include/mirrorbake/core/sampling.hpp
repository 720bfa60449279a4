#pragma once

#include <cstdint>

#include <glm/vec2.hpp>

/// Deterministic sample points: a value depends on its coordinates alone, never on call order or thread.
namespace mirrorbake {

/// Well-mixed 64-bit hash (the finaliser of SplitMix64: Steele, Lea, Flood, OOPSLA 2014).
constexpr std::uint64_t hash64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

constexpr std::uint64_t hash64(std::uint64_t a, std::uint64_t b) { return hash64(hash64(a) ^ b); }

/// Uniform in [0,1), 24 bits.
constexpr float unit_float(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24F; }

/// Sample `index` of the two-dimensional sequence number `sequence`: an Owen-scrambled, shuffled Sobol (0,2)
/// sequence, so that any first 2^k samples are stratified, in every elementary interval. Different sequences
/// are independent of each other (Burley, Practical Hash-based Owen Scrambling, JCGT 9(4), 2020).
glm::vec2 sobol_2d(std::uint32_t index, std::uint64_t sequence);

}  // namespace mirrorbake
