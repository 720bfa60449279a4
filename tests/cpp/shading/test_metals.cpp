#include "mirrorbake/shading/metals.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace {

// Expected: the same spectra through colour-science 0.4.7 (sd_to_XYZ, XYZ_to_RGB), whose matrix has more
// digits than that of IEC 61966-2-1. For chromium and aluminium Akenine-Möller et al., Real-Time Rendering,
// 4th ed., table 9.2, has (0.549, 0.556, 0.554) and (0.913, 0.922, 0.924).
TEST(Metals, ColoursAreThoseOfAnIndependentIntegration) {
  const auto expect = [](Metal metal, glm::dvec3 rgb) {
    const glm::dvec3 ours = metal_reflectance(metal, 1.0);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(ours[i], rgb[i], 5e-4) << to_string(metal) << ", channel " << i;
  };
  expect(Metal::aluminium, {0.90749, 0.91584, 0.92211});
  expect(Metal::silver, {0.98952, 0.98393, 0.97758});
  expect(Metal::gold, {1.03771, 0.72833, 0.36451});
  expect(Metal::copper, {0.93185, 0.62266, 0.52219});
  expect(Metal::chromium, {0.54971, 0.55601, 0.55409});
  expect(Metal::titanium, {0.61871, 0.57934, 0.54241});
}

TEST(Metals, GrazingLightIsReflectedWhite) {
  for (Metal metal : all_metals()) {
    for (Illuminant illuminant : {Illuminant::d65, Illuminant::e}) {
      const glm::dvec3 rgb = metal_reflectance(metal, 0.0, illuminant);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(rgb[i], 1.0, 1e-12);
    }
  }
}

TEST(Metals, TheIlluminantMatters) {
  const double difference =
      metal_reflectance(Metal::gold, 1.0).b - metal_reflectance(Metal::gold, 1.0, Illuminant::e).b;
  EXPECT_GT(std::abs(difference), 1e-3);
  EXPECT_LT(std::abs(difference), 0.05);
}

TEST(Metals, TablesRiseAndEncloseTheVisibleRange) {
  for (Metal metal : all_metals()) {
    const OpticalConstants constants = optical_constants(metal);
    EXPECT_LT(constants.entries.front().wavelength, 380.0);
    EXPECT_GT(constants.entries.back().wavelength, 780.0);
    for (std::size_t i = 1; i < constants.entries.size(); ++i) {
      EXPECT_GT(constants.entries[i].wavelength, constants.entries[i - 1].wavelength);
    }
    EXPECT_FALSE(constants.source.empty());
  }
}

TEST(Metals, AnEffectiveIndexFollowsTheSpectralCurveAndBeatsSchlick) {
  for (Metal metal : all_metals()) {
    const MetalFit fit = fit_metal(metal);
    const glm::dvec3 at_normal = metal_reflectance(metal, 1.0);
    for (int i = 0; i < 3; ++i) {
      // Gold's red exceeds what any conductor can reflect.
      EXPECT_LT(fit.conductor_error[i], std::max(0.005, at_normal[i] - 1.0 + 1e-3))
          << to_string(metal) << ' ' << i;
      EXPECT_LE(fit.conductor_error[i], fit.schlick_error[i] + 1e-3) << to_string(metal) << ' ' << i;
      EXPECT_LT(fit.schlick_error[i], 0.2) << to_string(metal) << ' ' << i;
    }
  }
}

TEST(Metals, NamesAndSymbolsParse) {
  for (Metal metal : all_metals()) EXPECT_EQ(parse_metal(to_string(metal)), metal);
  EXPECT_EQ(parse_metal("Au"), Metal::gold);
  EXPECT_THROW(parse_metal("unobtainium"), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
