#pragma once

#include <array>
#include <optional>
#include <vector>

#include <glm/mat3x3.hpp>

#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/envmap/texel_lookup.hpp"

/// Turns and mirrors of the axes that take the texels of a map to texels of it.
namespace mirrorbake {

/// Where a symmetry takes the texels of one face: rows and columns of `face` are sums of whole multiples (0,
/// 1 or −1) of the row and the column before, and of an offset. Columns of a panorama count on across its
/// seam.
struct FaceMap {
  int face = 0;
  int row_per_row = 1;
  int row_per_column = 0;
  int row_offset = 0;
  int column_per_row = 0;
  int column_per_column = 1;
  int column_offset = 0;
};

/// Where a symmetry takes the texels of a map.
struct TexelMap {
  std::array<FaceMap, 6> faces;
  int width = 1;  ///< columns are taken modulo this

  FaceTexel operator()(const FaceTexel& texel) const {
    const FaceMap& map = faces[static_cast<std::size_t>(texel.face)];
    int column = map.column_per_row * texel.row + map.column_per_column * texel.column + map.column_offset;
    column += column < 0 ? width : 0;
    column -= column >= width ? width : 0;
    return {map.face, map.row_per_row * texel.row + map.row_per_column * texel.column + map.row_offset,
            column};
  }
};

/// What a signed permutation of the axes does to the texels of a map; nothing if it does not take every texel
/// to a texel.
std::optional<TexelMap> texel_map(const EnvMapLayout& layout, const glm::dmat3& axes);

/// A symmetry that a resampling has: what it does to the texels of the target, it does to those that they are
/// made from.
struct SharedSymmetry {
  TexelMap target;
  TexelMap source;
};

/// All of them, a group, the identity first: 16 between a panorama and a cube, 1 for most rotations.
std::vector<SharedSymmetry> shared_symmetries(const EnvMapLayout& source, const EnvMapLayout& target,
                                              const glm::mat3& source_from_target);

}  // namespace mirrorbake
