#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/repair.hpp"

namespace mirrorbake {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

EnvMap plain(const char* projection, int width, int height, int levels = 1) {
  EnvMap map = make_envmap({parse_projection(projection), width, height, levels, 2});
  for (std::size_t i = 0; i < map.values.size(); ++i) map.values[i] = i % 2 == 0 ? 3.0F : 5.0F;
  return map;
}

TEST(Repair, AHoleInAPlainMapIsAsPlainWhereverItIsAndOtherValuesKeepTheirBits) {
  for (const char* projection :
       {"latlong", "cube", "dual_paraboloid", "sphere_map", "angular", "equal_area"}) {
    const EnvMap whole = plain(projection, projection[0] == 'l' || projection[0] == 'e' ? 16 : 8, 8, 2);
    EnvMap map = whole;
    // The first row and column of a face, across its edges, and a block inside.
    for (int i = 0; i < 8; ++i) {
      map.values[map.layout.index(0, 0, 0, i)] = kNan;
      map.values[map.layout.index(0, 0, i, 0) + 1] = -kInfinity;
      map.values[map.layout.index(0, 0, 2 + i % 4, 3 + i / 4)] = kInfinity;
    }
    map.values[map.layout.index(1, 0, 1, 1)] = kNan;
    const std::size_t bad = count_not_finite(map);
    EXPECT_EQ(repair_not_finite("a.exr", map), bad) << projection;
    EXPECT_EQ(map.values, whole.values) << projection;
    EXPECT_EQ(repair_not_finite("a.exr", map), 0U);
  }
}

// The first ring holds the values beside it, and the middle of three the mean of both sides.
TEST(Repair, AHoleIsFilledFromItsRimInwards) {
  EnvMap map = make_envmap({parse_projection("sphere_map"), 5, 5, 1, 1});
  for (int row = 0; row < 5; ++row) {
    for (int column = 0; column < 5; ++column) {
      const bool is_hole = column > 0 && column < 4;
      map.values[map.layout.index(0, 0, row, column)] = is_hole ? kNan : column == 0 ? 1.0F : 3.0F;
    }
  }
  EXPECT_EQ(repair_not_finite("a.exr", map), 15U);
  for (int row = 0; row < 5; ++row) {
    EXPECT_FLOAT_EQ(map.values[map.layout.index(0, 0, row, 1)], 1.0F);
    EXPECT_FLOAT_EQ(map.values[map.layout.index(0, 0, row, 2)], 2.0F);
    EXPECT_FLOAT_EQ(map.values[map.layout.index(0, 0, row, 3)], 3.0F);
  }
}

TEST(Repair, AWholeFaceIsFilledFromTheOthersAndAMapWithoutValuesIsAnError) {
  EnvMap cube = plain("cube", 64, 64);
  const EnvMap whole = cube;
  for (std::size_t i = 0; i < cube.values.size() / 6; ++i) cube.values[i] = kNan;
  repair_not_finite("a.exr", cube);
  EXPECT_EQ(cube.values, whole.values);
  for (std::size_t i = 1; i < cube.values.size(); i += 2) cube.values[i] = kNan;
  EXPECT_THROW(repair_not_finite("a.exr", cube), FileError);
}

}  // namespace
}  // namespace mirrorbake
