#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "mirrorbake/core/bilinear.hpp"
#include "mirrorbake/envmap/envmap.hpp"

/// Texels by their place in the plane of a face, on it or beyond it.
namespace mirrorbake {

struct FaceTexel {
  int face = 0;
  int row = 0;
  int column = 0;

  bool operator==(const FaceTexel&) const = default;
};

/// The texel at a place whose row or column may lie outside of a face of width × height texels: the one whose
/// area holds the direction that lies there when the projection is continued, i.e. a texel of the
/// neighbouring face, hemisphere or side. Where nothing lies beyond, as with the sphere map, the edge is
/// repeated.
FaceTexel continued(const Projection& projection, int width, int height, FaceTexel texel);

/// The same as an index: of the texel's first value.
std::size_t texel_at(const EnvMapLayout& layout, int level, int face, int row, int column);

/// The four texels of a cell on a face of width × height texels, and their weights times `scale`, in the
/// cell's order: calls add(row, column, weight), with places that may lie one beyond the face. At a corner of
/// a cube only three texels meet, so where `corners_are_shared`, there are three, each with a third of what
/// the fourth would weigh: it is their mean, as in OpenGL (GL_TEXTURE_CUBE_MAP_SEAMLESS), Vulkan and WebGL2.
template <typename T, typename Add>
void add_face_bilinear(const BilinearCell<T>& cell, int width, int height, bool corners_are_shared, T scale,
                       Add&& add) {
  std::array<T, 4> weights = cell.weights();
  for (T& weight : weights) weight *= scale;
  std::size_t missing = weights.size();
  const bool at_side = cell.column < 0 || cell.column + 1 >= width;
  if (corners_are_shared && at_side && (cell.row < 0 || cell.row + 1 >= height)) {
    missing = (cell.row < 0 ? 0U : 2U) + (cell.column < 0 ? 0U : 1U);
    const T third = weights[missing] / 3;
    for (T& weight : weights) weight += third;
  }
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (i == missing) continue;
    add(cell.row + static_cast<int>(i / 2), cell.column + static_cast<int>(i % 2), weights[i]);
  }
}

/// The two levels around a level of detail, clamped to those that exist.
template <typename T>
struct LevelPair {
  int finer = 0;
  T fraction = 0;  ///< weight of the next coarser level, in [0, 1); the finer one weighs the rest
};

template <typename T>
LevelPair<T> level_pair(T level, int levels) {
  const T last = static_cast<T>(levels - 1);
  const T clamped = level > 0 ? (level < last ? level : last) : T(0);
  const int finer = static_cast<int>(clamped);
  return {finer, clamped - static_cast<T>(finer)};
}

/// Bilinear interpolation at (column, row), in texels from the top left corner of the face, so that centres
/// are at halves; seamless by texel_at and add_face_bilinear. Writes map.layout.channels values.
void interpolate(const EnvMapView& map, int level, int face, double column, double row,
                 std::span<double> result);

}  // namespace mirrorbake
