#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <glm/vec3.hpp>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/envmap/footprint.hpp"
#include "mirrorbake/envmap/texel_topology.hpp"

/// Which texels a lookup reads, and with what weights: the one definition of a lookup from which renderers
/// and rendering matrices are made (spec E2, I1).
namespace mirrorbake {

/// What a lookup reads of the map. `nearest` and `bilinear` read the finest level; `trilinear` the two levels
/// next to its level of detail; `anisotropic` several trilinear taps along the longer differential.
enum class LookupFilter { nearest, bilinear, trilinear, anisotropic };

template <>
struct EnumNames<LookupFilter> {
  static constexpr std::string_view what = "filter";
  static constexpr auto names = enum_names("nearest", "bilinear", "trilinear", "anisotropic");
};

struct ReadFilter {
  LookupFilter kind = LookupFilter::anisotropic;
  int max_taps = 4;  ///< of `anisotropic`: 1, or an even number up to 16
};

struct TexelWeight {
  std::uint32_t texel = 0;  ///< index into the map
  float weight = 0.0F;
};

/// At most four texels on each of two levels, for each tap. The weights sum to 1.
struct TexelReads {
  std::array<TexelWeight, 16 * 8> texels;
  int count = 0;

  void add(std::uint32_t texel, float weight) { texels[static_cast<std::size_t>(count++)] = {texel, weight}; }
  const TexelWeight* begin() const { return texels.data(); }
  const TexelWeight* end() const { return texels.data() + count; }
};

/// Where along the longer differential a lookup takes its taps, and on which level. Every graphics card
/// computes the same: no level and no tap is left to a driver.
///
/// Let P and Q be the lengths of the longer and the shorter differential in texels of the finest level, and N
/// = P / max(Q, 1) the elongation, clamped to [1, max_taps]. All taps are trilinear, at level log2(P / N).
/// The longer differential is cut into cells of length P/N from its middle to both sides, p = ⌈N/2⌉ pairs of
/// them, the outermost two shorter; there is a tap in the middle of every cell, which weighs its share of the
/// length: 1/N, those of the outermost pair ½ − (p − 1)/N. So a pair fades in from weight 0 as N grows, and
/// rounding of N never changes the result by more than rounding. Below N = 2 the single pair moves apart
/// instead, from the middle at N = 1¼ (up to there one tap does) to ±¼ P.
struct TapPattern {
  float level = 0.0F;
  int taps = 1;
  std::array<float, 16> offsets{};  ///< of the taps, in lengths of the longer differential
  std::array<float, 16> weights{};  ///< sum to 1
  bool along_y = false;             ///< the longer differential is ddy
};

/// `major`, `minor`: P and Q above, ≥ 0. `levels` clamps the level.
TapPattern tap_pattern(float major, float minor, int max_taps, int levels);

/// Lengths of the two differentials in texels of the finest level.
struct TexelLengths {
  float ddx = 0.0F, ddy = 0.0F;
};
TexelLengths texel_lengths(const TexelTopology& topology, const Footprint& footprint);

/// Four texels of `level` around a direction of any length > 0, bilinear. On a cube it is seamless: beyond
/// the edge of a face lie the texels of its neighbour, and at a corner, where only three texels meet, the
/// fourth is their mean, as in OpenGL (GL_TEXTURE_CUBE_MAP_SEAMLESS), Vulkan and WebGL2. A paraboloid reads
/// the hemisphere of the direction alone, whose texels go on beyond the rim. An atlas takes (u, v) as the
/// direction's x and y. Appends with weights that sum to `scale`.
void add_bilinear(const TexelTopology& topology, int level, glm::vec3 direction, float scale,
                  TexelReads& reads);

/// Bilinear on the two levels next to `level`, clamped to those that exist, in proportion. Appends like
/// add_bilinear.
void add_trilinear(const TexelTopology& topology, float level, glm::vec3 direction, float scale,
                   TexelReads& reads);

/// What a lookup in the footprint's direction, of any length > 0, reads. Differentials that are not finite
/// count as endless: the coarsest level.
TexelReads reads(const TexelTopology& topology, const Footprint& footprint, const ReadFilter& filter);

}  // namespace mirrorbake
