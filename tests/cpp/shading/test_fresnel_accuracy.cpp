#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <vector>

#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/shading/fresnel.hpp"

// The claim of the header, |f − F| ≤ 4 ulp(F) + 1e-7 and f in [0,1], over the float cosines in [0,1]. The
// reference is the textbook's complex form, straight from Snell's law, in 80-bit arithmetic: independent of
// the library's forms, and wrong by less than 1e-15 for the parameters used here.
// (tests/python/test_fresnel.py has 50 digits.)
//
// Every 2003rd of the 1,065,353,217 cosines against long double, every 509th against double; all of them with
// MIRRORBAKE_FRESNEL_SWEEP=full.
namespace mirrorbake {
namespace {

using Reference = std::complex<long double>;

long double reference(long double c, std::complex<long double> n) {
  const Reference sine2 = (1.0L - c) * (1.0L + c);
  const Reference ng = std::sqrt(n * n - sine2);  // n cos θ'
  const Reference rs = (c - ng) / (c + ng);
  const Reference rp = (n * n * c - ng) / (n * n * c + ng);
  return 0.5L * (std::norm(rs) + std::norm(rp));
}

long double ulp(long double value) {
  const float f = std::max(static_cast<float>(value), std::numeric_limits<float>::min());
  return std::nextafter(f, INFINITY) - f;
}

struct Worst {
  long double excess = 0;  // error over what is allowed
  float cosine = 0;
  long double error = 0;
};

using FloatBatch = std::function<void(std::span<const float>, std::span<float>)>;

/// Every `stride`th float from 1 downwards, and 0, in blocks: both ends are in whatever the stride.
void for_blocks_of_cosines(std::size_t stride, const std::function<void(std::span<const float>)>& visit) {
  const std::size_t last = std::bit_cast<std::uint32_t>(1.0F);
  const std::size_t count = last / stride + 1;
  parallel_for(count, std::size_t{1} << 16, [&](std::size_t begin, std::size_t end) {
    std::vector<float> c(end - begin);
    for (std::size_t i = begin; i < end; ++i) {
      c[i - begin] = std::bit_cast<float>(static_cast<std::uint32_t>(last - i * stride));
    }
    if (end == count) c.back() = 0.0F;
    visit(c);
  });
}

Worst sweep(const FloatBatch& batch, const std::function<long double(float)>& exact) {
  Worst worst;
  std::mutex mutex;
  for_blocks_of_cosines(2003, [&](std::span<const float> c) {
    std::vector<float> f(c.size());
    batch(c, f);
    Worst mine;
    for (std::size_t i = 0; i < c.size(); ++i) {
      const long double expected = exact(c[i]);
      const long double error = std::abs(static_cast<long double>(f[i]) - expected);
      const bool in_range = f[i] >= 0.0F && f[i] <= 1.0F;
      const long double excess = in_range ? error / (4 * ulp(expected) + 1e-7L) : 1e9L;
      if (excess > mine.excess) mine = {excess, c[i], error};
    }
    const std::scoped_lock lock(mutex);
    if (mine.excess > worst.excess) worst = mine;
  });
  return worst;
}

/// The same against the batches of doubles, which other tests hold against 50 digits: fast enough for every
/// cosine.
Worst sweep_against_double(const FloatBatch& batch,
                           const std::function<void(std::span<const double>, std::span<double>)>& exact) {
  const char* option = std::getenv("MIRRORBAKE_FRESNEL_SWEEP");
  const std::size_t stride = option != nullptr && std::string(option) == "full" ? 1 : 509;
  Worst worst;
  std::mutex mutex;
  for_blocks_of_cosines(stride, [&](std::span<const float> c) {
    const std::vector<double> wide(c.begin(), c.end());
    std::vector<float> f(c.size());
    std::vector<double> expected(c.size());
    batch(c, f);
    exact(wide, expected);
    double excess = 0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < c.size(); ++i) {
      const auto nearest = std::max(static_cast<float>(expected[i]), std::numeric_limits<float>::min());
      const float next = std::bit_cast<float>(std::bit_cast<std::uint32_t>(nearest) + 1);
      const double allowed = 4 * static_cast<double>(next - nearest) + 1e-7;
      const bool in_range = f[i] >= 0.0F && f[i] <= 1.0F;
      const double mine = in_range ? std::abs(static_cast<double>(f[i]) - expected[i]) / allowed : 1e9;
      if (mine > excess) excess = mine, at = i;
    }
    const std::scoped_lock lock(mutex);
    if (excess > worst.excess) worst = {excess, c[at], f[at] - static_cast<long double>(expected[at])};
  });
  return worst;
}

class DielectricSweep : public testing::TestWithParam<float> {};

TEST_P(DielectricSweep, IsWithinFourUlpAndOneTenMillionth) {
  const float n = GetParam();
  const Worst worst = sweep([n](auto c, auto f) { fresnel_dielectric(c, n, f); },
                            [n](float c) { return reference(c, static_cast<long double>(n)); });
  RecordProperty("worst", std::to_string(static_cast<double>(worst.excess)));
  std::printf("n %.9g: worst %.3Lf of the allowance, error %.3Lg at c = %.9g\n", n, worst.excess, worst.error,
              worst.cosine);
  EXPECT_LE(worst.excess, 1.0L) << "n " << n << ", c " << worst.cosine;
  EXPECT_GT(worst.excess, 0.0L);
}

TEST_P(DielectricSweep, EveryFloatCosineIsAsNearToTheDoubleForm) {
  const float n = GetParam();
  const Worst worst = sweep_against_double([n](auto c, auto f) { fresnel_dielectric(c, n, f); },
                                           [n](auto c, auto f) { fresnel_dielectric(c, n, f); });
  RecordProperty("worst", std::to_string(static_cast<double>(worst.excess)));
  EXPECT_LE(worst.excess, 1.0L) << "n " << n << ", c " << worst.cosine << ", error " << worst.error;
}

INSTANTIATE_TEST_SUITE_P(Fresnel, DielectricSweep,
                         testing::Values(0.1F, 0.66F, 0.99F, 1.0F - 1.2e-7F, 1.0F + 1.2e-7F, 1.0001F, 1.1F,
                                         1.33F, 1.5F, 2.4F, 10.0F, 200.0F, 1e6F));

class ConductorSweep : public testing::TestWithParam<std::pair<float, float>> {};

TEST_P(ConductorSweep, IsWithinFourUlpAndOneTenMillionth) {
  const auto [n, k] = GetParam();
  const Worst worst = sweep([n = n, k = k](auto c, auto f) { fresnel_conductor(c, n, k, f); },
                            [n = n, k = k](float c) {
                              return reference(c, {n, k});
                            });
  std::printf("n %.9g, k %.9g: worst %.3Lf of the allowance, error %.3Lg at c = %.9g\n", n, k, worst.excess,
              worst.error, worst.cosine);
  EXPECT_LE(worst.excess, 1.0L) << "n " << n << ", k " << k << ", c " << worst.cosine;
  EXPECT_GT(worst.excess, 0.0L);
}

TEST_P(ConductorSweep, EveryFloatCosineIsAsNearToTheDoubleForm) {
  const auto [n, k] = GetParam();
  const Worst worst =
      sweep_against_double([n = n, k = k](auto c, auto f) { fresnel_conductor(c, n, k, f); },
                           [n = double{n}, k = double{k}](auto c, auto f) { fresnel_conductor(c, n, k, f); });
  RecordProperty("worst", std::to_string(static_cast<double>(worst.excess)));
  EXPECT_LE(worst.excess, 1.0L) << "n " << n << ", k " << k << ", c " << worst.cosine << ", error "
                                << worst.error;
}

// Silver, gold in red, green and blue, aluminium, chromium; then where one form hands over to another.
INSTANTIATE_TEST_SUITE_P(Fresnel, ConductorSweep,
                         testing::Values(std::pair(0.05F, 3.3F), std::pair(0.21F, 3.27F),
                                         std::pair(0.43F, 2.46F), std::pair(1.38F, 1.91F),
                                         std::pair(1.07F, 6.78F), std::pair(3.18F, 3.33F),
                                         std::pair(0.66F, 0.01F), std::pair(0.66F, 0.8F),
                                         std::pair(1.0F, 1e-4F), std::pair(1.0F, 0.5F),
                                         std::pair(1.5F, 1e-6F), std::pair(1.5F, 1.1F),
                                         std::pair(200.0F, 1e-3F), std::pair(1e4F, 1e5F)));

// The single-value form of a conductor differs from that of arrays: it takes square roots, not polynomials.
TEST(FresnelAccuracy, SingleConductorValuesAreAsExact) {
  for (const auto& [n, k] :
       {std::pair(0.05F, 3.3F), {0.43F, 2.46F}, {3.18F, 3.33F}, {1.5F, 1.1F}, {0.66F, 0.01F}}) {
    const Worst worst = sweep(
        [n = n, k = k](std::span<const float> c, std::span<float> f) {
          for (std::size_t i = 0; i < c.size(); ++i) f[i] = fresnel_conductor(c[i], n, k);
        },
        [n = n, k = k](float c) {
          return reference(c, {n, k});
        });
    EXPECT_LE(worst.excess, 1.0L) << "n " << n << ", k " << k << ", c " << worst.cosine;
  }
}

}  // namespace
}  // namespace mirrorbake
