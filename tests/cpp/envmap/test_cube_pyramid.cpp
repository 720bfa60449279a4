#include "mirrorbake/envmap/cube_pyramid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/projection/cube.hpp"

namespace mirrorbake {
namespace {

TEST(CubePyramid, LayoutNumbersEveryTexelOnce) {
  for (int size : {1, 2, 5, 8}) {
    const CubePyramidLayout layout = CubePyramidLayout::full(size);
    std::set<std::size_t> seen;
    for (int level = 0; level < layout.levels; ++level) {
      const int n = layout.level_size(level);
      for (int face = 0; face < 6; ++face) {
        for (int row = 0; row < n; ++row) {
          for (int column = 0; column < n; ++column) seen.insert(layout.index(level, face, row, column));
        }
      }
    }
    EXPECT_EQ(seen.size(), layout.texels());
    EXPECT_EQ(*seen.rbegin(), layout.texels() - 1);
    EXPECT_EQ(layout.level_size(layout.levels - 1), 1);
  }
}

TEST(CubePyramid, LayoutRejectsSizesOutOfRange) {
  EXPECT_THROW(CubePyramidLayout::full(0), InvalidArgument);
  EXPECT_THROW(CubePyramidLayout::full(16385), InvalidArgument);
}

TEST(CubePyramid, EveryLevelKeepsTheMeanRadiance) {
  for (int size : {32, 12}) {
    const CubePyramidLayout layout = CubePyramidLayout::full(size);
    std::vector<float> faces(layout.level_texels(0));
    for (std::size_t i = 0; i < faces.size(); ++i)
      faces[i] = unit_float(static_cast<std::uint32_t>(hash64(i)));
    const std::vector<float> pyramid = build_cube_pyramid(faces, layout, 1);
    const auto integral = [&](int level) {
      const int n = layout.level_size(level);
      double sum = 0;
      for (int face = 0; face < 6; ++face) {
        for (int row = 0; row < n; ++row) {
          for (int column = 0; column < n; ++column) {
            sum += static_cast<double>(pyramid[layout.index(level, face, row, column)]) *
                   cube_texel_solid_angle(n, column, row);
          }
        }
      }
      return sum;
    };
    for (int level = 1; level < layout.levels; ++level)
      EXPECT_NEAR(integral(level) / integral(0), 1.0, 1e-6) << size << ' ' << level;
  }
}

}  // namespace
}  // namespace mirrorbake
