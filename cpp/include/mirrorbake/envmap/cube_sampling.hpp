#pragma once

#include <array>
#include <cstdint>

#include <glm/vec3.hpp>

#include "mirrorbake/envmap/cube_pyramid.hpp"

/// Which texels of a cube pyramid a lookup reads, and with what weights: the one definition of the filter from which
/// both the renderer and the rendering matrix are made (spec E2, I1).
namespace mirrorbake {

struct TexelWeight {
  std::uint32_t texel = 0;  ///< index into the pyramid
  float weight = 0.0F;
};

/// At most four texels on each of two levels.
struct CubeFootprint {
  std::array<TexelWeight, 8> texels;
  int count = 0;
};

/// Index of the texel at (row, column) of a face, where at most one of the two may lie one outside of the face: the
/// neighbouring face's texel across that edge.
std::uint32_t cube_texel_across_edges(const CubePyramidLayout& layout, int level, int face, int row,
                                      int column);

/// Four texels of `level` around `direction`, bilinear and seamless: beyond the edge of a face lie the texels of
/// its neighbour, and at a corner, where only three texels meet, the fourth is their mean, as in OpenGL
/// (GL_TEXTURE_CUBE_MAP_SEAMLESS), Vulkan and WebGL2. The weights sum to 1. Appends to `footprint`, scaled by `scale`.
void add_bilinear(const CubePyramidLayout& layout, int level, glm::vec3 direction, float scale,
                  CubeFootprint& footprint);

/// Level of detail of a lookup in `direction` whose differentials over a pixel are `ddx` and `ddy`, as graphics
/// hardware computes it (OpenGL 4.6 §8.14): log2 of the longer of the two differentials in texels of the finest
/// level, clamped to the levels that exist. `direction` may have any length > 0.
float cube_level_of_detail(const CubePyramidLayout& layout, glm::vec3 direction, glm::vec3 ddx,
                           glm::vec3 ddy);

/// Trilinear footprint: bilinear on the two levels next to `level_of_detail`, in proportion.
CubeFootprint trilinear_footprint(const CubePyramidLayout& layout, glm::vec3 direction,
                                  float level_of_detail);

}  // namespace mirrorbake
