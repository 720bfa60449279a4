#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <vector>

#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {

/// The channels of one texel or pixel, in one SIMD register; maps of fewer channels leave the rest zero.
using Channels = float __attribute__((vector_size(16)));
/// Of rows.
using Vector = std::vector<Channels>;
using ChannelSums = std::array<double, 4>;
using TwoDoubles = double __attribute__((vector_size(16)));
/// Of sums that are being made, in two SIMD registers of the least that a processor has.
struct ChannelDoubles {
  TwoDoubles low{}, high{};
};

inline constexpr std::size_t kVectorGrain = 8192;

inline Channels broadcast(float value) { return Channels{value, value, value, value}; }

inline const float* floats(const Channels* values) { return reinterpret_cast<const float*>(values); }
inline float* floats(Channels* values) { return reinterpret_cast<float*>(values); }

/// Of unknowns: three floats each, or four where there is a fourth channel. They are most of what a step of
/// the solver reads and writes.
class TexelVector {
 public:
  TexelVector() = default;
  /// All 0.
  TexelVector(std::size_t size, int stride)
      : size_(size), stride_(static_cast<std::size_t>(stride)), values_(size * stride_ + 1) {}

  std::size_t size() const { return size_; }
  std::size_t stride() const { return stride_; }
  float* data() { return values_.data(); }
  const float* data() const { return values_.data(); }
  float* at(std::size_t i) { return values_.data() + stride_ * i; }
  const float* at(std::size_t i) const { return values_.data() + stride_ * i; }

  /// The fourth channel of three is 0. While no thread writes, for it reads beyond.
  Channels operator[](std::size_t i) const {
    Channels value = with_next(i);
    if (stride_ == 3) value[3] = 0.0F;
    return value;
  }
  /// The same while other threads write others.
  Channels alone(std::size_t i) const {
    const float* from = at(i);
    return Channels{from[0], from[1], from[2], stride_ == 4 ? from[3] : 0.0F};
  }
  /// As [i], but the fourth channel of three is what lies behind, some finite number.
  Channels with_next(std::size_t i) const {
    Channels value;
    std::memcpy(&value, at(i), sizeof(value));
    return value;
  }
  void set(std::size_t i, Channels value) {
    // Not as twelve bytes: whoever reads the next one would wait for a store that ends within it.
    float* to = at(i);
    std::memcpy(to, &value, 2 * sizeof(float));
    to[2] = value[2];
    if (stride_ == 4) to[3] = value[3];
  }

 private:
  std::size_t size_ = 0, stride_ = 4;
  std::vector<float> values_;
};

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
