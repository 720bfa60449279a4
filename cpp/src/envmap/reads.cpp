#include "mirrorbake/envmap/reads.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <glm/vec2.hpp>

#include "map_kinds.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/texel_lookup.hpp"

namespace mirrorbake {
namespace {

// Up to this elongation a footprint is round enough for one tap.
constexpr float kRound = 1.25F;

FacePoint face_point(TopologyKind kind, glm::vec3 d) {
  return for_kind(kind, [&]<typename Maps>(Maps) { return Maps::point(d); });
}

void add_nearest(const TexelTopology& topology, glm::vec3 direction, TexelReads& reads) {
  const FacePoint p = face_point(topology.kind(), direction);
  const auto texel = [](float s, int count) {
    return std::clamp(static_cast<int>(s * static_cast<float>(count)), 0, count - 1);
  };
  reads.add(topology.index({0, p.face, texel(p.t, topology.height(0)), texel(p.s, topology.width(0))}), 1.0F);
}

}  // namespace

TapPattern tap_pattern(float major, float minor, int max_taps, int levels) {
  TapPattern pattern;
  const float coarsest = static_cast<float>(levels - 1);
  if (!(major > 1.0F)) {
    // Also for lengths that are not numbers.
    pattern.level = std::isnan(major) ? coarsest : 0.0F;
    pattern.weights[0] = 1.0F;
    return pattern;
  }
  const float most = static_cast<float>(max_taps);
  const float elongation = std::clamp(major / std::max(minor, 1.0F), 1.0F, most);
  const float n = std::isfinite(elongation) ? elongation : 1.0F;
  pattern.level = std::clamp(std::log2(major / n), 0.0F, coarsest);
  if (n <= kRound) {
    pattern.weights[0] = 1.0F;
    return pattern;
  }
  const int pairs = static_cast<int>(std::ceil(0.5F * n));
  pattern.taps = 2 * pairs;
  for (int pair = 0; pair < pairs; ++pair) {
    // The outermost pair takes the middles of what the others leave of the differential.
    const float inner = static_cast<float>(pair);
    const bool outermost = pair + 1 == pairs;
    const float share = outermost ? 0.5F * n - inner : 1.0F;
    const float offset = pairs == 1  ? 0.25F * (n - kRound) / (2.0F - kRound)
                         : outermost ? 0.5F * (inner / n + 0.5F)
                                     : (inner + 0.5F) / n;
    for (int side = 0; side < 2; ++side) {
      const auto tap = static_cast<std::size_t>(2 * pair + side);
      pattern.offsets[tap] = side == 0 ? offset : -offset;
      pattern.weights[tap] = share / n;
    }
  }
  return pattern;
}

TexelLengths texel_lengths(const TexelTopology& topology, const Footprint& footprint) {
  const glm::vec2 sides(topology.width(0), topology.height(0));
  const glm::vec3 d = footprint.direction;
  return for_kind(topology.kind(), [&]<typename Maps>(Maps) {
    return TexelLengths{Maps::length(d, footprint.ddx, sides), Maps::length(d, footprint.ddy, sides)};
  });
}

void add_bilinear(const TexelTopology& topology, int level, glm::vec3 direction, float scale,
                  TexelReads& reads) {
  const int width = topology.width(level);
  const int height = topology.height(level);
  const FacePoint p = face_point(topology.kind(), direction);
  const BilinearCell<float> cell = bilinear_cell(std::clamp(p.s, 0.0F, 1.0F) * static_cast<float>(width),
                                                 std::clamp(p.t, 0.0F, 1.0F) * static_cast<float>(height));
  if (cell.inside(width, height)) {
    const std::uint32_t first = topology.index({level, p.face, cell.row, cell.column});
    const std::uint32_t below = first + static_cast<std::uint32_t>(width);
    const std::array<float, 4> weights = cell.weights();
    reads.add(first, scale * weights[0]);
    reads.add(first + 1, scale * weights[1]);
    reads.add(below, scale * weights[2]);
    reads.add(below + 1, scale * weights[3]);
    return;
  }
  const bool seamless = topology.beyond_edges() == BeyondEdges::neighbour;
  add_face_bilinear(cell, width, height, seamless, scale, [&](int row, int column, float weight) {
    reads.add(seamless ? topology.texel_at({level, p.face, row, column})
                       : topology.index({level, p.face, std::clamp(row, 0, height - 1),
                                         std::clamp(column, 0, width - 1)}),
              weight);
  });
}

void add_trilinear(const TexelTopology& topology, float level, glm::vec3 direction, float scale,
                   TexelReads& reads) {
  const auto [finer, fraction] = level_pair(level, topology.levels());
  add_bilinear(topology, finer, direction, scale * (1.0F - fraction), reads);
  if (fraction > 0.0F) add_bilinear(topology, finer + 1, direction, scale * fraction, reads);
}

TexelReads reads(const TexelTopology& topology, const Footprint& footprint, const ReadFilter& filter) {
  TexelReads result;
  if (filter.kind == LookupFilter::nearest) {
    add_nearest(topology, footprint.direction, result);
    return result;
  }
  if (filter.kind == LookupFilter::bilinear) {
    add_bilinear(topology, 0, footprint.direction, 1.0F, result);
    return result;
  }
  const TexelLengths lengths = texel_lengths(topology, footprint);
  const bool along_y = lengths.ddy > lengths.ddx;
  const float major = along_y ? lengths.ddy : lengths.ddx;
  const float minor = along_y ? lengths.ddx : lengths.ddy;
  const int most = filter.kind == LookupFilter::trilinear ? 1 : filter.max_taps;
  const TapPattern pattern = tap_pattern(major, minor, most, topology.levels());
  const glm::vec3 longer = along_y ? footprint.ddy : footprint.ddx;
  for (std::size_t tap = 0; tap < static_cast<std::size_t>(pattern.taps); ++tap) {
    const glm::vec3 direction =
        pattern.taps == 1 ? footprint.direction : footprint.direction + pattern.offsets[tap] * longer;
    add_trilinear(topology, pattern.level, direction, pattern.weights[tap], result);
  }
  return result;
}

}  // namespace mirrorbake
