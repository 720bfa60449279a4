#include "mirrorbake/envmap/cube_sampling.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "mirrorbake/projection/cube.hpp"

namespace mirrorbake {

std::uint32_t cube_texel_across_edges(const CubePyramidLayout& layout, int level, int face, int row,
                                      int column) {
  const int n = layout.level_size(level);
  if (row >= 0 && row < n && column >= 0 && column < n) {
    return static_cast<std::uint32_t>(layout.index(level, face, row, column));
  }
  // The direction of the missing texel's centre, seen from the neighbouring face, is shifted along the edge by less
  // than half a texel, so that it still falls into the texel across the edge.
  const float scale = 1.0F / static_cast<float>(n);
  const CubeCoordinates c = cube_from_direction(direction_from_cube(
      face, (static_cast<float>(column) + 0.5F) * scale, (static_cast<float>(row) + 0.5F) * scale));
  const auto texel = [n](float s) { return std::min(static_cast<int>(s * static_cast<float>(n)), n - 1); };
  return static_cast<std::uint32_t>(layout.index(level, c.face, texel(c.t), texel(c.s)));
}

void add_bilinear(const CubePyramidLayout& layout, int level, glm::vec3 direction, float scale,
                  CubeFootprint& footprint) {
  const int n = layout.level_size(level);
  const CubeCoordinates c = cube_from_direction(direction);
  const float x = c.s * static_cast<float>(n) - 0.5F;
  const float y = c.t * static_cast<float>(n) - 0.5F;
  const int column = static_cast<int>(std::floor(x));
  const int row = static_cast<int>(std::floor(y));
  const float fx = x - static_cast<float>(column);
  const float fy = y - static_cast<float>(row);
  const float weights[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  const auto append = [&](std::size_t texel, float weight) {
    footprint.texels[static_cast<std::size_t>(footprint.count++)] = {static_cast<std::uint32_t>(texel),
                                                                     scale * weight};
  };

  if (row >= 0 && column >= 0 && row + 1 < n && column + 1 < n) {
    const std::size_t first = layout.index(level, c.face, row, column);
    const std::size_t below = first + static_cast<std::size_t>(n);
    append(first, weights[0]);
    append(first + 1, weights[1]);
    append(below, weights[2]);
    append(below + 1, weights[3]);
    return;
  }

  const int first = footprint.count;
  float missing = 0.0F;  // weight of the texel that a corner of the cube lacks
  for (int i = 0; i < 4; ++i) {
    const int r = row + i / 2;
    const int k = column + i % 2;
    const bool row_outside = r < 0 || r >= n;
    const bool column_outside = k < 0 || k >= n;
    if (row_outside && column_outside) {
      missing = weights[i];
    } else {
      append(cube_texel_across_edges(layout, level, c.face, r, k), weights[i]);
    }
  }
  if (missing > 0.0F) {
    for (int i = first; i < footprint.count; ++i) {
      footprint.texels[static_cast<std::size_t>(i)].weight += scale * missing / 3.0F;
    }
  }
}

float cube_level_of_detail(const CubePyramidLayout& layout, glm::vec3 direction, glm::vec3 ddx,
                           glm::vec3 ddy) {
  const glm::vec3 a = glm::abs(direction);
  int axis = 0;
  if (a.y > a.x) axis = 1;
  if (a.z > a[axis]) axis = 2;
  const float major = a[axis];
  const float coarsest = static_cast<float>(layout.levels - 1);
  if (!(major > 0.0F)) return coarsest;
  // Derivative of the face coordinates ½ + ½ d/|major|, by the quotient rule.
  const float sign = direction[axis] < 0.0F ? -1.0F : 1.0F;
  const glm::vec3 on_cube = direction / major;
  const auto squared_length = [&](glm::vec3 dd) {
    glm::vec3 change = (dd - on_cube * (sign * dd[axis])) / major;
    change[axis] = 0.0F;
    return glm::dot(change, change);
  };
  const float texels = 0.5F * static_cast<float>(layout.size);
  const float rho2 = texels * texels * std::max(squared_length(ddx), squared_length(ddy));
  if (!(rho2 > 1.0F)) return 0.0F;
  return std::min(0.5F * std::log2(rho2), coarsest);
}

CubeFootprint trilinear_footprint(const CubePyramidLayout& layout, glm::vec3 direction,
                                  float level_of_detail) {
  const float clamped = std::clamp(level_of_detail, 0.0F, static_cast<float>(layout.levels - 1));
  const int level = static_cast<int>(clamped);
  const float fraction = clamped - static_cast<float>(level);
  CubeFootprint footprint;
  add_bilinear(layout, level, direction, 1.0F - fraction, footprint);
  if (fraction > 0.0F) add_bilinear(layout, level + 1, direction, fraction, footprint);
  return footprint;
}

}  // namespace mirrorbake
