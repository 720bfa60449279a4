#include "mirrorbake/projection/cube.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

namespace mirrorbake {
namespace {

TEST(Projection, CubeRoundTripsEveryTexel) {
  for (int face = 0; face < 6; ++face) {
    for (int row = 0; row < 64; ++row) {
      for (int column = 0; column < 64; ++column) {
        const float s = (static_cast<float>(column) + 0.5F) / 64;
        const float t = (static_cast<float>(row) + 0.5F) / 64;
        const CubeCoordinates c = cube_from_direction(direction_from_cube(face, s, t));
        EXPECT_EQ(c.face, face);
        EXPECT_NEAR(c.s, s, 1e-7F);
        EXPECT_NEAR(c.t, t, 1e-7F);
      }
    }
  }
}

TEST(Projection, CubeSolidAnglesSumToTheSphere) {
  for (int size : {1, 2, 3, 31, 32, 100, 512}) {
    double sum = 0;
    for (int row = 0; row < size; ++row) {
      for (int column = 0; column < size; ++column) sum += cube_texel_solid_angle(size, column, row);
    }
    EXPECT_NEAR(6.0 * sum / (4.0 * std::numbers::pi), 1.0, 1e-12) << size;
  }
}

// The texel's solid angle is its area times the density (1+x²+y²)^(−3/2), here by long double midpoint and
// Simpson.
TEST(Projection, CubeSolidAngleKeepsItsDigitsAt16384) {
  constexpr int kSize = 16384;
  const long double step = 2.0L / kSize;
  for (int column : {0, 1, 8191, 8192, 12345, 16383}) {
    for (int row : {0, 5000, 8192, 16383}) {
      const auto density = [&](int i, int j) {
        const long double x =
            -1.0L + step * (static_cast<long double>(column) + 0.5L * static_cast<long double>(i));
        const long double y =
            -1.0L + step * (static_cast<long double>(row) + 0.5L * static_cast<long double>(j));
        return std::pow(1.0L + x * x + y * y, -1.5L);
      };
      const long double weights[3] = {1.0L / 6, 4.0L / 6, 1.0L / 6};
      long double expected = 0;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) expected += weights[i] * weights[j] * density(i, j);
      }
      expected *= step * step;
      EXPECT_NEAR(cube_texel_solid_angle(kSize, column, row) / static_cast<double>(expected), 1.0, 1e-12);
    }
  }
}

TEST(Projection, CubeAnswersHostileDirectionsInsideTheMap) {
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float values[] = {0.0F, -0.0F, 1.0F, -1.0F, 1e30F, -1e30F, 1e-30F, 1e-42F, inf, -inf, nan};
  for (float x : values) {
    for (float y : values) {
      for (float z : values) {
        const CubeCoordinates c = cube_from_direction({x, y, z});
        EXPECT_TRUE(c.face >= 0 && c.face < 6);
        EXPECT_TRUE(c.s >= 0 && c.s <= 1 && c.t >= 0 && c.t <= 1) << x << ' ' << y << ' ' << z;
      }
    }
  }
}

}  // namespace
}  // namespace mirrorbake
