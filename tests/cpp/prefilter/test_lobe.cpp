#include "mirrorbake/prefilter/lobe.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mirrorbake/prefilter/split_sum.hpp"

namespace mirrorbake {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(Lobe, DerivativesAreThoseOfTheWeight) {
  Lobe table{LobeKind::table};
  table.table = {1.0, 0.9, 0.5, 0.1, 0.0};
  for (const Lobe& lobe : {Lobe{LobeKind::phong, 7.0}, Lobe{LobeKind::ggx, 1.0, 0.3}, table}) {
    for (const double c : {0.9, 0.6, 0.2}) {
      const double step = 1e-5;
      const LobeDerivatives d = lobe_derivatives(lobe, std::sqrt(0.5 * (1.0 - c)));
      const double low = lobe_weight(lobe, c - step);
      const double high = lobe_weight(lobe, c + step);
      EXPECT_NEAR(d.weight, lobe_weight(lobe, c), 1e-12);
      // Differences of that step lose half of the digits, second ones most.
      EXPECT_NEAR(d.first, (high - low) / (2.0 * step), 1e-6);
      EXPECT_NEAR(d.second, (high - 2.0 * d.weight + low) / (step * step), 1e-4);
    }
  }
}

// ∫ c^N dω = 2π/(N + 1), and of GGX with α = 1 it is the cosine lobe's π.
TEST(Lobe, IntegralsAreThoseOfTheFormulas) {
  Lobe table{LobeKind::table};
  table.table_angle = 60.0;
  table.table = {1.0};  // a cone
  EXPECT_NEAR(lobe_integral({LobeKind::phong, 9.0}), 0.2 * kPi, 1e-12);
  EXPECT_NEAR(lobe_integral({LobeKind::ggx, 1.0, 1.0}), kPi,
              1e-6);                             // the rule meets the corner at the horizon
  EXPECT_NEAR(lobe_integral(table), kPi, 2e-3);  // 2π(1 − cos 60°), and a step
}

TEST(Lobe, WidthsOfPhongAndMicrofacetsConvert) {
  EXPECT_DOUBLE_EQ(alpha_from_exponent(6.0), 0.5);
  for (const double exponent : {1.0, 10.0, 1e4}) {
    EXPECT_NEAR(exponent_from_alpha(alpha_from_exponent(exponent)), exponent, 1e-9 * exponent);
  }
}

// Smooth surfaces reflect everything, and Schlick's share is (1 − cos θ)^5; rough ones lose what bounces
// twice.
TEST(SplitSum, IsFresnelForSmoothSurfacesAndLosesLightWithRoughness) {
  for (const double cosine : {0.2, 0.5, 0.9}) {
    const SplitSum smooth = split_sum(cosine, 1e-3);
    EXPECT_NEAR(smooth.scale + smooth.bias, 1.0, 2e-3);
    EXPECT_NEAR(smooth.bias, std::pow(1.0 - cosine, 5.0), 2e-3);
    double before = 1.01;
    for (const double alpha : {0.1, 0.3, 0.6, 1.0}) {
      const SplitSum sum = split_sum(cosine, alpha);
      EXPECT_LT(sum.scale + sum.bias, before);
      before = sum.scale + sum.bias;
    }
  }
}

TEST(SplitSum, TableHoldsItsValuesAndTheirSum) {
  const std::vector<float> table = split_sum_table(4);
  const SplitSum sum = split_sum(0.625, 0.375 * 0.375);  // row 1, column 2
  EXPECT_FLOAT_EQ(table[(1 * 4 + 2) * 3], static_cast<float>(sum.scale));
  EXPECT_FLOAT_EQ(table[(1 * 4 + 2) * 3 + 1], static_cast<float>(sum.bias));
  EXPECT_FLOAT_EQ(table[(1 * 4 + 2) * 3 + 2], static_cast<float>(sum.scale + sum.bias));
}

}  // namespace
}  // namespace mirrorbake
