#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// Order of the texels of a cube map with all its mip levels.
namespace mirrorbake {

/// Levels one after the other, the finest first; in a level the six faces; in a face the rows from the top.
/// Level l has faces of max(1, size >> l) texels a side; there are floor(log2(size)) + 1 levels.
struct CubePyramidLayout {
  int size = 1;    ///< texels along a side of the finest level, 1…16384
  int levels = 1;  ///< how many of the levels exist, counted from the finest

  /// The full pyramid down to 1×1. Throws InvalidArgument for a size outside 1…16384.
  static CubePyramidLayout full(int size);

  int level_size(int level) const { return size >> level > 0 ? size >> level : 1; }
  std::size_t level_offset(int level) const;
  std::size_t level_texels(int level) const;
  std::size_t texels() const { return level_offset(levels); }
  std::size_t index(int level, int face, int row, int column) const {
    const std::size_t n = static_cast<std::size_t>(level_size(level));
    return level_offset(level) + (static_cast<std::size_t>(face) * n + static_cast<std::size_t>(row)) * n +
           static_cast<std::size_t>(column);
  }
};

/// The whole pyramid (texels × channels) of a cube map (6 × size × size × channels): the values that
/// build_mips makes with MipFilter::solid_angle. Throws InvalidArgument if `faces` has another size.
std::vector<float> build_cube_pyramid(std::span<const float> faces, const CubePyramidLayout& layout,
                                      int channels);

}  // namespace mirrorbake
