#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/shading/fresnel.hpp"

namespace mirrorbake {
namespace {

using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Cosines with every kind of trouble, and an odd number of ordinary ones.
std::vector<float> cosines() {
  std::vector<float> c = {0.0F,  -0.0F, 1e-45F, 1e-30F, 1e-7F, 1.0F - 1e-7F, 1.0F,     1.0F + 1e-7F, -1e-7F,
                          -3.0F, 7.0F,  kNan,   -kNan,  1e30F, -1e30F,       INFINITY, -INFINITY};
  for (int i = 0; i < 70'002; ++i) c.push_back(static_cast<float>(i) / 70'001.0F);
  return c;
}

std::vector<std::uint32_t> bits(const std::vector<float>& values) {
  std::vector<std::uint32_t> result;
  for (float value : values) {
    // All NaN count as one: which of two NaN an addition keeps is the processor's choice.
    result.push_back(std::bit_cast<std::uint32_t>(std::isnan(value) ? kNan : value));
  }
  return result;
}

std::vector<std::uint64_t> bits(const std::vector<double>& values) {
  std::vector<std::uint64_t> result;
  for (double value : values) {
    result.push_back(std::bit_cast<std::uint64_t>(std::isnan(value) ? static_cast<double>(kNan) : value));
  }
  return result;
}

TEST(Fresnel, DielectricHasTheClosedFormsOfNormalGrazingAndBrewsterIncidence) {
  for (double n : {1.0001, 1.33, 1.5, 2.4, 200.0, 1e6}) {
    const double r = (n - 1) / (n + 1);
    EXPECT_NEAR(fresnel_dielectric(1.0, n), r * r, 1e-15);
    EXPECT_DOUBLE_EQ(fresnel_dielectric(0.0, n), 1.0);
    // tan θ = n: r_p = 0 and r_s = (n² − 1)/(n² + 1). The error is c's, times the slope dF/dc ≤ n.
    const double s = (n * n - 1) / (n * n + 1);
    EXPECT_NEAR(fresnel_dielectric(1 / std::sqrt(1 + n * n), n), 0.5 * s * s, 1e-15) << n;
  }
}

TEST(Fresnel, NoInterfaceReflectsNothing) {
  for (float c : cosines()) {
    if (!std::isnan(c)) {
      EXPECT_EQ(fresnel_dielectric(c, 1.0F), 0.0F) << c;
      EXPECT_EQ(fresnel_conductor(c, 1.0F, 0.0F), 0.0F) << c;
      EXPECT_EQ(fresnel_dielectric_transmittance(c, 1.0F), 1.0F) << c;
    }
  }
}

TEST(Fresnel, TotalInternalReflectionBelowTheCriticalAngle) {
  for (double n : {0.01, 0.5, 0.66, 0.999999}) {
    const double critical = std::sqrt((1 - n) * (1 + n));
    for (double part : {0.0, 0.5, 1.0 - 1e-14}) EXPECT_EQ(fresnel_dielectric(part * critical, n), 1.0) << n;
    EXPECT_LT(fresnel_dielectric(critical * (1 + 1e-6), n), 1.0) << n;
    EXPECT_EQ(fresnel_dielectric_transmittance(0.5 * critical, n), 0.0) << n;
  }
}

// Reversed light takes the same path: F(c, n) = F(c', 1/n) with c' from Snell's law.
TEST(Fresnel, DielectricIsReciprocal) {
  for (double n : {1.0001, 1.5, 2.4, 20.0}) {
    for (double c : {0.05, 0.3, 0.7, 0.99}) {
      const double other = std::sqrt(1 - (1 - c) * (1 + c) / (n * n));
      EXPECT_NEAR(fresnel_dielectric(c, n), fresnel_dielectric(other, 1 / n), 1e-12) << n << ' ' << c;
    }
  }
}

TEST(Fresnel, ReflectedAndTransmittedEnergyAddUpToOne) {
  for (float n : {0.2F, 0.66F, 1.0F - 1e-7F, 1.0F, 1.0F + 1e-7F, 1.5F, 200.0F, 1e6F}) {
    for (float c : cosines()) {
      if (std::isnan(c)) continue;
      const double f = fresnel_dielectric(static_cast<double>(c), static_cast<double>(n));
      const double t = fresnel_dielectric_transmittance(static_cast<double>(c), static_cast<double>(n));
      ASSERT_NEAR(f + t, 1.0, 2e-15) << "n " << n << ", c " << c;
    }
  }
}

TEST(Fresnel, ConductorWithoutAbsorptionIsTheDielectric) {
  for (float n : {0.3F, 0.66F, 1.0F, 1.0F + 1e-7F, 1.5F, 200.0F, 1e6F}) {
    for (float c : cosines()) {
      if (std::isnan(c)) continue;
      ASSERT_EQ(fresnel_conductor(c, n, 0.0F), fresnel_dielectric(c, n)) << "n " << n << ", c " << c;
      // And goes there continuously, but for n = 1, c = 0. √(2nk)/n² of k shows at the critical angle.
      if (n == 1.0F && c <= 1e-7F) continue;
      const double f = fresnel_conductor(static_cast<double>(c), static_cast<double>(n), 1e-20);
      ASSERT_NEAR(f, fresnel_dielectric(static_cast<double>(c), static_cast<double>(n)), 1e-8)
          << "n " << n << ", c " << c;
    }
  }
}

TEST(Fresnel, SchlickMeetsItsEndsAndNeverLeavesTheUnitInterval) {
  for (float r0 : {0.0F, 0.04F, 0.3F, 0.7F, 1.0F}) {
    EXPECT_EQ(fresnel_schlick(1.0F, r0), r0);
    EXPECT_EQ(fresnel_schlick(0.0F, r0), 1.0F);
    for (float c : cosines()) {
      if (std::isnan(c)) continue;
      ASSERT_GE(fresnel_schlick(c, r0), 0.0F);
      ASSERT_LE(fresnel_schlick(c, r0), 1.0F);
    }
  }
}

TEST(Fresnel, CosinesOutsideTheRangeAreClampedAndNanStaysNan) {
  const auto check = [](const std::function<float(float)>& f) {
    EXPECT_EQ(f(-1.0F), f(0.0F));
    EXPECT_EQ(f(-0.0F), f(0.0F));
    EXPECT_EQ(f(1.0F + 1e-6F), f(1.0F));
    EXPECT_EQ(f(INFINITY), f(1.0F));
    EXPECT_TRUE(std::isnan(f(kNan)));
  };
  check([](float c) { return fresnel_schlick(c, 0.04F); });
  check([](float c) { return fresnel_dielectric(c, 1.5F); });
  check([](float c) { return fresnel_dielectric(c, 0.5F); });
  check([](float c) { return fresnel_conductor(c, 0.2F, 3.0F); });
  check([](float c) { return fresnel_conductor(c, 0.5F, 0.01F); });
}

// Every loop over arrays, in both precisions; 1.5 and (0.2, 3) stay in float, 0.66 and (0.66, 0.01) go
// through double, (0.66, 1) is too close to its branch point for the polynomials.
struct Batch {
  std::string name;
  std::function<std::vector<float>(const std::vector<float>&)> f32;
  std::function<std::vector<double>(const std::vector<double>&)> f64;
};

std::vector<Batch> batches() {
  const auto with = [](std::string name, auto call) {
    return Batch{std::move(name),
                 [call](const std::vector<float>& c) {
                   std::vector<float> f(c.size());
                   call(std::span<const float>(c), std::span<float>(f));
                   return f;
                 },
                 [call](const std::vector<double>& c) {
                   std::vector<double> f(c.size());
                   call(std::span<const double>(c), std::span<double>(f));
                   return f;
                 }};
  };
  const auto ramp = []<typename T>(std::span<const T> c, double low, double high) {
    std::vector<T> values(c.size());
    for (std::size_t i = 0; i < c.size(); ++i) {
      values[i] = static_cast<T>(low + (high - low) * static_cast<double>(i * 7919 % c.size()) /
                                           static_cast<double>(c.size()));
    }
    return values;
  };
  std::vector<Batch> all;
  all.push_back(with(
      "schlick", []<typename T>(std::span<const T> c, std::span<T> f) { fresnel_schlick(c, T(0.04), f); }));
  for (double n : {1.5, 0.66, 1.0}) {
    all.push_back(
        with("dielectric " + std::to_string(n), [n]<typename T>(std::span<const T> c, std::span<T> f) {
          fresnel_dielectric(c, static_cast<T>(n), f);
        }));
  }
  for (auto [n, k] : {std::pair(0.2, 3.0), {0.66, 1.0}, {0.66, 0.01}, {1.5, 0.0}}) {
    all.push_back(with("conductor " + std::to_string(n) + " " + std::to_string(k),
                       [n = n, k = k]<typename T>(std::span<const T> c, std::span<T> f) {
                         fresnel_conductor(c, static_cast<T>(n), static_cast<T>(k), f);
                       }));
  }
  all.push_back(with("schlick each", [ramp]<typename T>(std::span<const T> c, std::span<T> f) {
    fresnel_schlick(c, std::span<const T>(ramp(c, 0, 1)), f);
  }));
  all.push_back(with("dielectric each", [ramp]<typename T>(std::span<const T> c, std::span<T> f) {
    fresnel_dielectric(c, std::span<const T>(ramp(c, 0.5, 3)), f);
  }));
  all.push_back(with("conductor each", [ramp]<typename T>(std::span<const T> c, std::span<T> f) {
    fresnel_conductor(c, std::span<const T>(ramp(c, 0.5, 3)), std::span<const T>(ramp(c, 0, 4)), f);
  }));
  return all;
}

TEST(Fresnel, EveryInstructionSetGivesTheSameBits) {
  const std::vector<float> c32 = cosines();
  const std::vector<double> c64(c32.begin(), c32.end());
  for (const Batch& batch : batches()) {
    std::vector<std::uint32_t> expected32;
    std::vector<std::uint64_t> expected64;
    {
      const IsaLimit limit(Isa::baseline);
      expected32 = bits(batch.f32(c32));
      expected64 = bits(batch.f64(c64));
    }
    for (Isa isa : {Isa::sse42, Isa::avx2, Isa::avx512}) {
      if (isa > best_isa()) continue;
      const IsaLimit limit(isa);
      ASSERT_EQ(active_isa(), isa);
      EXPECT_TRUE(bits(batch.f32(c32)) == expected32) << batch.name << ", float, " << to_string(isa);
      EXPECT_TRUE(bits(batch.f64(c64)) == expected64) << batch.name << ", double, " << to_string(isa);
    }
  }
}

TEST(Fresnel, AnyNumberOfThreadsAndAnyAlignmentGiveTheSameBits) {
  const std::vector<float> c = cosines();
  for (const Batch& batch : batches()) {
    if (batch.name.ends_with("each")) continue;  // its parameters move with the first element
    const auto expected = bits(batch.f32(c));
    const ThreadLimit one(1);
    EXPECT_TRUE(bits(batch.f32(c)) == expected) << batch.name;
    const std::vector<float> tail(c.begin() + 3, c.end());
    EXPECT_TRUE(bits(batch.f32(tail)) == std::vector(expected.begin() + 3, expected.end())) << batch.name;
  }
}

// Large arrays are written past the caches in whole aligned vectors, and from their ends where the output
// lies a little more than whole pages behind the input.
TEST(Fresnel, SizeAndPlaceOfArraysDoNotChangeTheBits) {
  const std::vector<float> some = cosines();
  for (const std::size_t count : {std::size_t{1000}, (std::size_t{1} << 20) + 1003}) {
    constexpr std::size_t kPage = 4096 / sizeof(float);
    const std::size_t pages = count / kPage + 2;
    std::vector<float> memory(2 * pages * kPage);
    const std::span<float> c = std::span(memory).first(count);
    for (std::size_t i = 0; i < count; ++i) c[i] = some[i % some.size()];
    std::vector<float> expected(some.size());
    fresnel_schlick(some, 0.04F, expected);
    for (const std::size_t shift : {0, 1, 7, 16, 500, 513, 1023}) {
      const std::span<float> f = std::span(memory).subspan(pages * kPage + shift - kPage, count);
      std::fill(f.begin(), f.end(), -1.0F);
      fresnel_schlick(c, 0.04F, f);
      std::size_t wrong = 0;
      for (std::size_t i = 0; i < count; ++i) {
        wrong +=
            std::bit_cast<std::uint32_t>(f[i]) != std::bit_cast<std::uint32_t>(expected[i % some.size()]);
      }
      EXPECT_EQ(wrong, 0U) << count << " values, shifted by " << shift;
    }
  }
}

TEST(Fresnel, ArraysHaveTheBitsOfSingleValues) {
  const std::vector<float> c = cosines();
  std::vector<float> f(c.size());
  const auto expect = [&](const std::function<float(float)>& one) {
    std::vector<float> expected;
    for (float cosine : c) expected.push_back(one(cosine));
    EXPECT_TRUE(bits(f) == bits(expected));
  };
  fresnel_schlick(c, 0.04F, f);
  expect([](float x) { return fresnel_schlick(x, 0.04F); });
  for (float n : {0.66F, 1.0F, 1.0F + 1e-7F, 1.5F, 200.0F, 1e13F}) {
    fresnel_dielectric(c, n, f);
    expect([n](float x) { return fresnel_dielectric(x, n); });
  }
  fresnel_conductor(c, 0.66F, 0.01F, f);
  expect([](float x) { return fresnel_conductor(x, 0.66F, 0.01F); });
}

TEST(Fresnel, MaterialOverAnArrayIsTheMaterialOfEachCosine) {
  std::vector<float> c = cosines();
  std::vector<glm::vec3> f(c.size());
  for (FresnelModel model :
       {FresnelModel::constant, FresnelModel::schlick, FresnelModel::dielectric, FresnelModel::conductor}) {
    const Fresnel material = {model, {0.9F, 0.6F, 0.3F}, {0.2F, 0.9F, 1.4F}, {3.9F, 2.5F, 1.6F}};
    evaluate(material, c, f);
    for (std::size_t i = 0; i < c.size(); ++i) {
      const glm::vec3 one = evaluate(material, c[i]);
      for (int channel = 0; channel < 3; ++channel) {
        if (std::isnan(one[channel])) {
          ASSERT_TRUE(std::isnan(f[i][channel]));
        } else {
          ASSERT_EQ(f[i][channel], one[channel]) << i;
        }
      }
    }
  }
}

TEST(Fresnel, EmptyArraysAreFine) {
  std::vector<float> none;
  EXPECT_NO_THROW(fresnel_dielectric(none, 1.5F, none));
}

TEST(Fresnel, BadParametersAreRejectedByName) {
  std::vector<float> c(4, 0.5F);
  std::vector<float> f(4);
  const auto message = [](const std::function<void()>& call) -> std::string {
    try {
      call();
    } catch (const InvalidArgument& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(message([&] { fresnel_schlick(c, 1.5F, f); }), HasSubstr("r0 is 1.5"));
  EXPECT_THAT(message([&] { fresnel_schlick(c, kNan, f); }), HasSubstr("r0 is nan"));
  EXPECT_THAT(message([&] { fresnel_dielectric(c, 0.0F, f); }), HasSubstr("ior is 0"));
  EXPECT_THAT(message([&] { fresnel_dielectric(c, -1.5F, f); }), HasSubstr("ior is -1.5"));
  EXPECT_THAT(message([&] { fresnel_dielectric(c, INFINITY, f); }), HasSubstr("ior is inf"));
  EXPECT_THAT(message([&] { fresnel_conductor(c, kNan, 1.0F, f); }), HasSubstr("eta is nan"));
  EXPECT_THAT(message([&] { fresnel_conductor(c, 1.0F, -1.0F, f); }), HasSubstr("k is -1"));
  EXPECT_THAT(message([&] {
                fresnel_dielectric(c, std::vector<float>{1.5F, 1.5F, 0.0F, 1.5F}, f);
              }),
              HasSubstr("ior is 0"));
  EXPECT_THAT(message([&] { fresnel_dielectric(c, std::vector<float>{1.5F}, f); }), HasSubstr("1 elements"));
  std::vector<float> small(3);
  EXPECT_THAT(message([&] { fresnel_dielectric(c, 1.5F, small); }), HasSubstr("c is 4 elements"));
  EXPECT_THAT(message([&] { fresnel_dielectric(c, 1.5F, c); }), HasSubstr("overlap"));
  EXPECT_THAT(message([&] { parse_isa("mmx"); }), HasSubstr("isa is mmx"));
}

TEST(Isa, NamesRoundTrip) {
  for (Isa isa : {Isa::baseline, Isa::sse42, Isa::avx2, Isa::avx512})
    EXPECT_EQ(parse_isa(to_string(isa)), isa);
}

}  // namespace
}  // namespace mirrorbake
