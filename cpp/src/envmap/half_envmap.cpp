#include "mirrorbake/envmap/half_envmap.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/image/half.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kChunk = std::size_t{1} << 15;

}  // namespace

HalfEnvMap half_from_float(const EnvMapView& map, std::size_t* clamped) {
  validate(map);
  HalfEnvMap result{
      map.layout, std::vector<std::uint16_t>(map.values.size()), {map.channels.begin(), map.channels.end()}};
  std::atomic<std::uint64_t> total{0};
  parallel_for(map.values.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::uint64_t count = 0;
    for (std::size_t i = begin; i < end; ++i) {
      result.values[i] = half_from_float(clamp_to_half(map.values[i], count));
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
