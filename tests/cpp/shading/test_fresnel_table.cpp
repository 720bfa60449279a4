#include "mirrorbake/shading/fresnel_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"

namespace mirrorbake {
namespace {

double largest_error(const FresnelTable& table, const ReflectanceFunction& exact) {
  double worst = 0;
  constexpr int kCount = 300'007;
  for (int i = 0; i <= kCount; ++i) {
    const double c = static_cast<double>(i) / kCount;
    worst = std::max(worst, std::abs(evaluate(table, c) - exact(c)));
  }
  return worst;
}

TEST(FresnelTable, MeetsTheWantedErrorWithTheFewestEntries) {
  const Fresnel schlick = {FresnelModel::schlick, glm::vec3(0.04F)};
  const Fresnel glass = {FresnelModel::dielectric, {}, glm::vec3(1.5F)};
  const Fresnel gold = {FresnelModel::conductor, {}, glm::vec3(0.43F), glm::vec3(2.46F)};
  for (const Fresnel& material : {schlick, glass, gold}) {
    const ReflectanceFunction exact = reflectance_function(material, 0);
    for (double wanted : {0.1, 1e-2, 1e-3, 1e-5}) {
      const FresnelTable table = table_for_error(exact, wanted);
      const double error = largest_error(table, exact);
      // Tops of bumps are interpolated by parabolas.
      EXPECT_LE(error, wanted * (1.0 + 1e-4));
      EXPECT_NEAR(table.max_error, error, 0.003 * error);
      if (table.values.size() > 2) {
        EXPECT_GT(largest_error(make_table(exact, table.values.size() - 1), exact), wanted * 0.99);
      }
    }
  }
}

// The largest second derivative of Schlick's curve is 20(1 − r0) at c = 0, so the error of the first interval
// of width h tends to 20(1 − r0)h²/8.
TEST(FresnelTable, SizeForSchlickIsWhatItsSecondDerivativeAsksFor) {
  const auto exact = reflectance_function({FresnelModel::schlick, glm::vec3(0.04F)}, 1);
  const double h = std::sqrt(8 * 1e-5 / (20 * 0.96));
  EXPECT_NEAR(static_cast<double>(table_for_error(exact, 1e-5).values.size()), 1 / h + 1, 0.02 / h);
}

TEST(FresnelTable, InterpolatesEntriesAndClampsCosines) {
  const FresnelTable table{{0.0F, 0.5F, 1.0F, 0.25F}, 0.0};
  EXPECT_EQ(evaluate(table, 0.0F), 0.0F);
  EXPECT_EQ(evaluate(table, 1.0F), 0.25F);
  EXPECT_FLOAT_EQ(evaluate(table, 0.5F), 0.75F);
  EXPECT_EQ(evaluate(table, -1.0F), 0.0F);
  EXPECT_EQ(evaluate(table, 2.0), 0.25);
  EXPECT_TRUE(std::isnan(evaluate(table, std::numeric_limits<float>::quiet_NaN())));
}

TEST(FresnelTable, ArraysHaveTheBitsOfSingleValuesOnEveryInstructionSet) {
  const auto table =
      table_for_error(reflectance_function({FresnelModel::dielectric, {}, glm::vec3(1.33F)}, 2), 1e-4);
  std::vector<float> c;
  for (int i = -10; i < 100'001; ++i) c.push_back(static_cast<float>(i) / 100'000.0F);
  const std::vector<double> c64(c.begin(), c.end());
  std::vector<float> f(c.size());
  std::vector<double> f64(c.size());
  for (Isa isa : {Isa::baseline, Isa::sse42, Isa::avx2, Isa::avx512}) {
    const IsaLimit limit(isa);
    evaluate(table, c, f);
    evaluate(table, c64, f64);
    for (std::size_t i = 0; i < c.size(); ++i) {
      ASSERT_EQ(f[i], evaluate(table, c[i])) << to_string(isa);
      ASSERT_EQ(f64[i], evaluate(table, c64[i])) << to_string(isa);
    }
  }
}

TEST(FresnelTable, WhatCannotBeDoneIsAnError) {
  const auto glass = reflectance_function({FresnelModel::dielectric, {}, glm::vec3(1.5F)}, 0);
  EXPECT_THROW(table_for_error(glass, 0.0), InvalidArgument);
  EXPECT_THROW(table_for_error(glass, 1e-9), InvalidArgument);
  EXPECT_THROW(table_for_error(glass, std::nan("")), InvalidArgument);
  EXPECT_THROW(make_table(glass, 1), InvalidArgument);
  EXPECT_THROW(make_table([](double) { return 1.5; }, 4), InvalidArgument);
  EXPECT_THROW(reflectance_function({}, 3), InvalidArgument);
  EXPECT_THROW(evaluate(FresnelTable{}, 0.5F), InvalidArgument);
  const auto total = reflectance_function({FresnelModel::dielectric, {}, glm::vec3(0.66F)}, 0);
  EXPECT_THROW(table_for_error(total, 1e-4), NumericalError);
}

}  // namespace
}  // namespace mirrorbake
