#include "mirrorbake/envmap/mipmap.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/envmap/texel_lookup.hpp"

namespace mirrorbake {
namespace {

EnvMap noise(const char* projection, int width, int height) {
  EnvMap map = make_envmap({parse_projection(projection), width, height, 1, 3});
  for (std::size_t i = 0; i < map.values.size(); ++i) {
    map.values[i] = unit_float(static_cast<std::uint32_t>(hash64(i)));
    if (hash64(i, 1) % 500 == 0) map.values[i] = 1e4F;
  }
  return map;
}

TEST(Mipmap, WeightedLevelsKeepTheMeanRadianceOfEveryProjectionAndSize) {
  for (const char* projection :
       {"cube", "latlong", "dual_paraboloid", "sphere_map", "angular", "equal_area"}) {
    for (const int size : {1, 6, 13, 64}) {
      const EnvMap map = noise(projection, size, size);
      for (const MipFilter filter : {MipFilter::solid_angle, MipFilter::seamless}) {
        const EnvMap mips = build_mips(map, filter);
        ASSERT_EQ(mips.layout.levels, full_level_count(size, size));
        const std::vector<double> whole = integrate(mips, 0);
        for (int level = 1; level < mips.layout.levels; ++level) {
          for (std::size_t c = 0; c < 3; ++c) {
            EXPECT_NEAR(integrate(mips, level)[c] / whole[c], 1.0, 1e-6)
                << projection << ' ' << size << ' ' << level;
          }
        }
      }
    }
  }
}

// A light in the corner of a face, where texels are small, weighs too much in plain means: 2.3 times at the
// end.
TEST(Mipmap, TheBoxFilterDoesNotKeepTheMeanRadiance) {
  EnvMap map = make_envmap({parse_projection("cube"), 64, 64, 1, 1});
  map.values[map.layout.index(0, 2, 1, 1)] = 100.0F;
  const EnvMap mips = build_mips(map, MipFilter::box);
  EXPECT_GT(integrate(mips, 6)[0] / integrate(mips, 0)[0], 2.0);
}

// [AEM] figure 4: with plain mips the faces differ at their edges up to the last level, where a face is one
// texel and nothing changes inside of it. A smooth sky with a sun shows it.
TEST(Mipmap, SeamsShowWithTheBoxFilterAndVanishWithTheSeamlessOne) {
  EnvMap map = make_envmap({parse_projection("cube"), 128, 128, 1, 1});
  for (int face = 0; face < 6; ++face) {
    for (int row = 0; row < 128; ++row) {
      for (int column = 0; column < 128; ++column) {
        const glm::dvec3 d = direction_from_point(map.layout.projection, face, column_center(column, 128),
                                                  row_center(row, 128));
        map.values[map.layout.index(0, face, row, column)] = static_cast<float>(
            1.0 + d.y + 50.0 * std::exp(40.0 * (glm::dot(d, glm::dvec3(0.36, 0.8, 0.48)) - 1.0)));
      }
    }
  }
  const EnvMap box = build_mips(map, MipFilter::box);
  const EnvMap seamless = build_mips(map, MipFilter::seamless);
  bool box_fails = false;
  for (int level = 0; level < box.layout.levels; ++level) {
    const SeamReport with_box = measure_seam(box, level);
    const SeamReport with_sharing = measure_seam(seamless, level);
    box_fails = box_fails || with_box.across > with_box.inside;
    EXPECT_LE(with_sharing.across, with_sharing.inside) << "level " << level;
    if (level > 0) {
      EXPECT_EQ(with_sharing.across, 0.0F) << "level " << level;
    }
  }
  EXPECT_TRUE(box_fails);
}

TEST(Mipmap, AConstantMapStaysConstant) {
  for (const char* projection : {"cube", "latlong", "dual_paraboloid", "angular", "equal_area"}) {
    EnvMap map = make_envmap({parse_projection(projection), 21, 21, 1, 1});
    std::fill(map.values.begin(), map.values.end(), 0.3F);
    for (const MipFilter filter : {MipFilter::box, MipFilter::solid_angle, MipFilter::seamless}) {
      for (const float v : build_mips(map, filter).values) EXPECT_NEAR(v, 0.3F, 1e-6F) << projection;
    }
  }
}

TEST(Border, HoldsTheNeighboursTexels) {
  for (const char* projection :
       {"cube", "latlong", "dual_paraboloid", "angular", "sphere_map", "fisheye:180", "equal_area"}) {
    constexpr int kSize = 16;
    constexpr int kBorder = 3;
    constexpr int kWide = kSize + 2 * kBorder;
    EnvMap map = make_envmap({parse_projection(projection), kSize, kSize, 1, 3});
    for (int face = 0; face < face_count(map.layout.projection); ++face) {
      for (int row = 0; row < kSize; ++row) {
        for (int column = 0; column < kSize; ++column) {
          const glm::vec3 d(direction_from_point(map.layout.projection, face, column_center(column, kSize),
                                                 row_center(row, kSize)));
          for (int c = 0; c < 3; ++c) {
            map.values[map.layout.index(0, face, row, column) + static_cast<std::size_t>(c)] = d[c];
          }
        }
      }
    }
    const std::vector<float> wide = add_border(map, 0, kBorder);
    ASSERT_EQ(wide.size(), static_cast<std::size_t>(face_count(map.layout.projection) * kWide * kWide * 3));
    const bool repeats = std::string(projection) == "sphere_map" || std::string(projection) == "fisheye:180";
    for (int face = 0; face < face_count(map.layout.projection); ++face) {
      for (int row = -kBorder; row < kSize + kBorder; ++row) {
        for (int column = -kBorder; column < kSize + kBorder; ++column) {
          const std::size_t i = 3 * (static_cast<std::size_t>(face * kWide * kWide) +
                                     static_cast<std::size_t>((row + kBorder) * kWide + column + kBorder));
          const glm::dvec3 found(wide[i], wide[i + 1], wide[i + 2]);
          const glm::dvec3 expected = direction_from_point(
              map.layout.projection, face, column_center(column, kSize), row_center(row, kSize));
          const bool inside = row >= 0 && row < kSize && column >= 0 && column < kSize;
          if (repeats && !inside) continue;
          // Within the texel that holds it: a texel is at most 0.4 rad across here (the corners of the
          // angular map).
          EXPECT_LT(glm::length(found - expected), inside ? 1e-6 : 0.3)
              << projection << ' ' << row << ' ' << column;
        }
      }
    }
  }
}

TEST(Border, RejectsWidthsThatMakeNoSense) {
  const EnvMap map = noise("cube", 4, 4);
  EXPECT_THROW(add_border(map, 0, -1), InvalidArgument);
  EXPECT_THROW(add_border(map, 0, 5), InvalidArgument);
  EXPECT_THROW(add_border(map, 1, 1), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
