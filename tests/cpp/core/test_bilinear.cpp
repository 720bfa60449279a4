#include "mirrorbake/core/bilinear.hpp"

#include <gtest/gtest.h>

#include <array>

namespace mirrorbake {
namespace {

TEST(BilinearCell, CentresOfTexelsAreTheirOwnValues) {
  for (const int i : {0, 1, 7}) {
    const BilinearCell<float> cell = bilinear_cell(static_cast<float>(i) + 0.5F, 2.5F);
    EXPECT_EQ(cell.column, i);
    EXPECT_EQ(cell.row, 2);
    EXPECT_EQ(cell.weights()[0], 1.0F);
  }
}

TEST(BilinearCell, BeforeTheFirstCentreTheCellBeginsOutside) {
  const BilinearCell<double> cell = bilinear_cell(0.25, 0.0);
  EXPECT_EQ(cell.column, -1);
  EXPECT_EQ(cell.x, 0.75);
  EXPECT_EQ(cell.row, -1);
  EXPECT_EQ(cell.y, 0.5);
  EXPECT_FALSE(cell.inside(8, 8));
  EXPECT_FALSE(bilinear_cell(7.75, 3.0).inside(8, 8));
  EXPECT_TRUE(bilinear_cell(7.25, 3.0).inside(8, 8));
  EXPECT_FALSE(bilinear_cell(0.5, 0.5).inside(1, 1));
}

// Bilinear functions are what bilinear interpolation reproduces; the numbers below are exact in binary.
TEST(BilinearCell, ReproducesABilinearFunction) {
  const auto f = [](double x, double y) { return 3.0 + 2.0 * x - y + 0.5 * x * y; };
  for (double y = -0.25; y < 3.0; y += 0.375) {
    for (double x = -0.25; x < 3.0; x += 0.125) {
      const BilinearCell<double> cell = bilinear_cell(x, y);
      std::array<double, 4> v{};
      double sum = 0.0;
      double weighted = 0.0;
      for (std::size_t i = 0; i < 4; ++i) {
        v[i] = f(cell.column + static_cast<int>(i % 2) + 0.5, cell.row + static_cast<int>(i / 2) + 0.5);
        sum += cell.weights()[i];
        weighted += cell.weights()[i] * v[i];
      }
      EXPECT_EQ(sum, 1.0);
      EXPECT_EQ(weighted, f(x, y));
      EXPECT_EQ(cell.mix(v[0], v[1], v[2], v[3]), f(x, y));
    }
  }
}

}  // namespace
}  // namespace mirrorbake
