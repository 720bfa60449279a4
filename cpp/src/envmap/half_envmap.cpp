#include "mirrorbake/envmap/half_envmap.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/image/half.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 15;
// From here on rounding to nearest gives infinity.
constexpr float kFirstInfinite = 65520.0F;
constexpr float kLargest = 65504.0F;

}  // namespace

HalfEnvMap half_from_float(const EnvMapView& map, std::size_t* clamped) {
  validate(map);
  HalfEnvMap result{
      map.layout, std::vector<std::uint16_t>(map.values.size()), {map.channels.begin(), map.channels.end()}};
  std::atomic<std::size_t> total{0};
  parallel_for(map.values.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::size_t count = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const float v = map.values[i];
      const bool too_large = std::abs(v) >= kFirstInfinite;
      count += too_large ? 1 : 0;
      result.values[i] = half_from_float(too_large ? std::copysign(kLargest, v) : v);
    }
    total += count;
  });
  if (clamped != nullptr) *clamped = total;
  return result;
}

EnvMap float_from_half(const HalfEnvMap& map) {
  EnvMap result{map.layout, std::vector<float>(map.values.size()), map.channels};
  validate(EnvMapView(result));
  parallel_for(map.values.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) result.values[i] = float_from_half(map.values[i]);
  });
  return result;
}

}  // namespace mirrorbake
