#include "mirrorbake/prefilter/harmonics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/compare.hpp"
#include "panorama.hpp"

namespace mirrorbake {
namespace {

constexpr double kPi = std::numbers::pi;

// [AEM] eq. 9.
TEST(Harmonics, FirstNineAreThePolynomialsOfThePaper) {
  const glm::dvec3 d = glm::normalize(glm::dvec3(0.3, -0.5, 0.8));
  std::array<double, 9> ours{};
  harmonic_basis(d, 2, ours);
  const double linear = std::sqrt(3.0 / (4.0 * kPi));
  const double product = std::sqrt(15.0 / (4.0 * kPi));
  const std::array<double, 9> expected{std::sqrt(0.25 / kPi),
                                       linear * d.y,
                                       linear * d.z,
                                       linear * d.x,
                                       product * d.x * d.y,
                                       product * d.y * d.z,
                                       std::sqrt(5.0 / (16.0 * kPi)) * (3.0 * d.z * d.z - 1.0),
                                       product * d.x * d.z,
                                       std::sqrt(15.0 / (16.0 * kPi)) * (d.x * d.x - d.y * d.y)};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(ours[i], expected[i], 1e-14) << i;
}

TEST(Harmonics, AllAreOrthonormalOverTheTexelsOfAMap) {
  const int size = 64;
  std::vector<double> products(81 * 81);
  std::array<double, 81> y{};
  for (int row = 0; row < size; ++row) {
    const double angle = texel_solid_angle({ProjectionKind::latlong}, 2 * size, size, 0, row);
    for (int column = 0; column < 2 * size; ++column) {
      harmonic_basis(direction_from_point({ProjectionKind::latlong}, 0, column_center(column, 2 * size),
                                          row_center(row, size)),
                     8, y);
      for (std::size_t i = 0; i < 81; ++i) {
        for (std::size_t k = 0; k < 81; ++k) products[81 * i + k] += angle * y[i] * y[k];
      }
    }
  }
  // Middles of texels instead of integrals: l² (π/64)²/24.
  for (std::size_t i = 0; i < 81; ++i) {
    for (std::size_t k = 0; k < 81; ++k) EXPECT_NEAR(products[81 * i + k], i == k ? 1.0 : 0.0, 0.02);
  }
}

// π, 2π/3, π/4 of [AEM]; the next by integration of the cosine against P(4): −π/24.
TEST(Harmonics, LambertFactorsAreThoseOfTheCosine) {
  EXPECT_DOUBLE_EQ(lambert_factor(0), kPi);
  EXPECT_DOUBLE_EQ(lambert_factor(1), 2.0 * kPi / 3.0);
  EXPECT_DOUBLE_EQ(lambert_factor(2), kPi / 4.0);
  EXPECT_EQ(lambert_factor(3), 0.0);
  EXPECT_NEAR(lambert_factor(4), -kPi / 24.0, 1e-15);
  EXPECT_NEAR(lambert_factor(6), kPi / 64.0, 1e-15);
  EXPECT_NEAR(lambert_factor(8), -kPi / 128.0, 1e-15);
}

TEST(Harmonics, IrradianceComesCloserToTheExactOneWithEveryEvenOrder) {
  const EnvMap map = testing::sunny_panorama(64);
  const PrefilterTarget target{{ProjectionKind::cube}, 16, 16};
  const EnvMap exact = irradiance(map, target);
  double before = 1.0;
  for (const int order : {2, 4, 6, 8}) {
    const EnvMap sum =
        evaluate_harmonics(lambert_harmonics(project_harmonics(map, order)), target, NegativeLight::keep);
    const double error = compare(sum, exact).relative_l2;
    EXPECT_LT(error, before) << order;
    before = error;
  }
  EXPECT_LT(before, 0.02);
}

// A sun alone rings by 1/16 of its irradiance below 0.
TEST(Harmonics, SloansWindowLeavesNothingBelowZeroAndClampingIsTheDefault) {
  EnvMap map = testing::sunny_panorama(64);
  for (float& value : map.values) value = value > 10.0F ? value : 0.0F;
  const Harmonics light = lambert_harmonics(project_harmonics(map, 2));
  const PrefilterTarget target{{ProjectionKind::cube}, 16, 16};
  const auto least = [](const EnvMap& m) { return *std::min_element(m.values.begin(), m.values.end()); };
  EXPECT_LT(least(evaluate_harmonics(light, target, NegativeLight::keep)), 0.0F);
  EXPECT_GE(least(evaluate_harmonics(light, target)), 0.0F);
  const Harmonics window = windowed(light, HarmonicWindow::sloan);
  EXPECT_GE(least(evaluate_harmonics(window, target, NegativeLight::keep)),
            -1e-3F * static_cast<float>(light.coefficients[0]));
  for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(window.coefficients[c], light.coefficients[c]);
  const Harmonics hanning = windowed(light, HarmonicWindow::hanning);
  EXPECT_NEAR(hanning.coefficients[3], 0.75 * light.coefficients[3], 1e-9 * std::abs(light.coefficients[3]));
}

TEST(Harmonics, ShaderConstantsSumToReflectedRadiance) {
  const EnvMap map = testing::sunny_panorama(32);
  const Harmonics light = project_harmonics(map, 2);
  const std::vector<double> k = shader_constants(light);
  const PrefilterTarget target{{ProjectionKind::latlong}, 8, 4};
  const EnvMap sums = evaluate_harmonics(lambert_harmonics(light), target, NegativeLight::keep);
  for (int i = 0; i < 32; ++i) {
    const glm::dvec3 n =
        direction_from_point(target.projection, 0, column_center(i % 8, 8), row_center(i / 8, 4));
    const std::array<double, 9> p{
        1.0, n.y, n.z, n.x, n.x * n.y, n.y * n.z, 3.0 * n.z * n.z - 1.0, n.x * n.z, n.x * n.x - n.y * n.y};
    double value = 0.0;
    for (std::size_t j = 0; j < 9; ++j) value += k[3 * j] * p[j];
    const double expected = static_cast<double>(sums.values[static_cast<std::size_t>(3 * i)]) / kPi;
    EXPECT_NEAR(value, expected, 1e-5 * std::abs(light.coefficients[0]));
  }
}

TEST(Harmonics, OrdersThatDoNotExistAreRefused) {
  const EnvMap map = testing::sunny_panorama(8);
  EXPECT_THROW(project_harmonics(map, 9), InvalidArgument);
  EXPECT_THROW(project_harmonics(map, -1), InvalidArgument);
  EXPECT_THROW(validate(Harmonics{2, 3, std::vector<double>(26)}), InvalidArgument);
  EXPECT_THROW(shader_constants(project_harmonics(map, 1)), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
