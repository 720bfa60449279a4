#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {

/// The channels of one texel or pixel, in one SIMD register; maps of fewer channels leave the rest zero.
using Channels = float __attribute__((vector_size(16)));
/// Of unknowns or rows.
using Vector = std::vector<Channels>;
using ChannelSums = std::array<double, 4>;
using TwoDoubles = double __attribute__((vector_size(16)));
/// Of sums that are being made, in two SIMD registers of the least that a processor has.
struct ChannelDoubles {
  TwoDoubles low{}, high{};
};

inline constexpr std::size_t kVectorGrain = 8192;

inline Channels broadcast(float value) { return Channels{value, value, value, value}; }

inline void add(ChannelSums& sums, const ChannelSums& more) {
  for (std::size_t k = 0; k < 4; ++k) sums[k] += more[k];
}

/// Sum of `body(begin, end)` over chunks, per channel, added up in the order of the chunks.
template <typename Body>
ChannelSums parallel_channel_sums(std::size_t count, const Body& body) {
  std::vector<ChannelSums> partial((count + kVectorGrain - 1) / kVectorGrain);
  parallel_for(count, kVectorGrain,
               [&](std::size_t begin, std::size_t end) { partial[begin / kVectorGrain] = body(begin, end); });
  ChannelSums sums{};
  for (const ChannelSums& part : partial) add(sums, part);
  return sums;
}

inline void add_product(ChannelDoubles& sums, Channels a, Channels b) {
  sums.low += TwoDoubles{static_cast<double>(a[0]), static_cast<double>(a[1])} *
              TwoDoubles{static_cast<double>(b[0]), static_cast<double>(b[1])};
  sums.high += TwoDoubles{static_cast<double>(a[2]), static_cast<double>(a[3])} *
               TwoDoubles{static_cast<double>(b[2]), static_cast<double>(b[3])};
}

inline ChannelSums to_sums(const ChannelDoubles& sums) {
  return {sums.low[0], sums.low[1], sums.high[0], sums.high[1]};
}

}  // namespace mirrorbake
