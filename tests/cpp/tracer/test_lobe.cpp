#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>
#include <glm/geometric.hpp>

#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/tracer/lobe.hpp"
#include "scenes.hpp"

namespace mirrorbake {
namespace {

constexpr double kPi = std::numbers::pi;

LobeShape ggx(float alpha) { return {SpecularLobe::ggx, alpha, 1.0F}; }
LobeShape phong(float exponent) { return {SpecularLobe::phong, 0.5F, exponent}; }

glm::vec3 direction(double cosine, double azimuth) {
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  return {static_cast<float>(sine * std::cos(azimuth)), static_cast<float>(sine * std::sin(azimuth)),
          static_cast<float>(cosine)};
}

// ∫ f(l) dω over the whole sphere by the midpoint rule in cosine and azimuth.
template <typename Function>
double integrate(const Function& f, int rows = 800, int columns = 1600) {
  double sum = 0.0;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      sum += static_cast<double>(f(direction(2.0 * (i + 0.5) / rows - 1.0, 2.0 * kPi * (j + 0.5) / columns)));
    }
  }
  return sum * 4.0 * kPi / rows / columns;
}

struct Case {
  LobeShape shape;
  double cosine;
};
const std::vector<Case> kCases = {{ggx(0.15F), 0.9}, {ggx(0.4F), 0.6},   {ggx(1.0F), 1.0},
                                  {ggx(0.6F), 0.1},  {phong(1.0F), 0.7}, {phong(40.0F), 0.3}};

std::string name(const Case& c) {
  return "lobe " + std::to_string(static_cast<int>(c.shape.lobe)) + ", alpha " +
         std::to_string(c.shape.roughness) + ", N " + std::to_string(c.shape.exponent) + ", cosine " +
         std::to_string(c.cosine);
}

// χ² of directions drawn against the integral of the density over cells of equal solid angle. Independent
// random numbers: a stratified sequence would fit too well.
TEST(Lobe, SamplesFollowTheDensity) {
  constexpr int kRows = 12;
  constexpr int kColumns = 24;
  constexpr int kFine = 24;  // midpoints per side of a cell
  constexpr int kSamples = 100'000;
  for (const Case& c : kCases) {
    SCOPED_TRACE(name(c));
    const glm::vec3 view = direction(c.cosine, 0.4);
    std::vector<double> expected(kRows * kColumns, 0.0);
    for (int i = 0; i < kRows * kFine; ++i) {
      for (int j = 0; j < kColumns * kFine; ++j) {
        const glm::vec3 l =
            direction(2.0 * (i + 0.5) / (kRows * kFine) - 1.0, 2.0 * kPi * (j + 0.5) / (kColumns * kFine));
        expected[static_cast<std::size_t>(i / kFine * kColumns + j / kFine)] +=
            static_cast<double>(lobe_density(c.shape, view, l)) * 4.0 * kPi / (kRows * kFine) /
            (kColumns * kFine);
      }
    }
    std::vector<double> counted(expected.size(), 0.0);
    for (int i = 0; i < kSamples; ++i) {
      const std::uint64_t bits = hash64(17, static_cast<std::uint64_t>(i));
      const glm::vec2 u(unit_float(static_cast<std::uint32_t>(bits >> 32)),
                        unit_float(static_cast<std::uint32_t>(bits)));
      const glm::vec3 l = sample_lobe(c.shape, view, u);
      ASSERT_NEAR(glm::length(l), 1.0F, 1e-5F);
      const int row = std::min(kRows - 1, static_cast<int>(0.5 * (l.z + 1.0) * kRows));
      const double turn = std::atan2(l.y, l.x) / (2.0 * kPi);
      const int column =
          std::min(kColumns - 1, static_cast<int>((turn < 0.0 ? turn + 1.0 : turn) * kColumns));
      counted[static_cast<std::size_t>(row * kColumns + column)] += 1.0;
    }
    // Cells with few samples are pooled.
    double chi2 = 0.0, rare_expected = 0.0, rare_counted = 0.0;
    int cells = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const double e = expected[i] * kSamples;
      if (e < 10.0) {
        rare_expected += e;
        rare_counted += counted[i];
        continue;
      }
      chi2 += (counted[i] - e) * (counted[i] - e) / e;
      ++cells;
    }
    ASSERT_GT(cells, 5);
    // χ² of n degrees of freedom exceeds n + 4√(2n) once in 10,000 or so; the midpoint rule adds up to 1 %
    // per cell where the lobe is as narrow as a cell.
    EXPECT_LT(chi2, cells + 4.0 * std::sqrt(2.0 * cells) + 10.0);
    EXPECT_NEAR(rare_counted, rare_expected, 5.0 * std::sqrt(rare_expected + 10.0));
  }
}

TEST(Lobe, DensityIntegratesToOneAndTheResponseIsBelowIt) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(name(c));
    const glm::vec3 view = direction(c.cosine, 1.0);
    EXPECT_NEAR(integrate([&](glm::vec3 l) { return lobe_density(c.shape, view, l); }), 1.0, 2e-3);
    integrate(
        [&](glm::vec3 l) {
          EXPECT_LE(lobe_response(c.shape, view, l), lobe_density(c.shape, view, l) * 1.0001F);
          return 0.0F;
        },
        60, 120);
  }
}

// f(v, l) cosθl · cosθv is symmetric.
TEST(Lobe, GgxIsReciprocal) {
  for (float alpha : {0.05F, 0.3F, 1.0F}) {
    for (std::uint32_t i = 0; i < 200; ++i) {
      const glm::vec2 a = sobol_2d(i, 1);
      const glm::vec2 b = sobol_2d(i, 2);
      const glm::vec3 v = direction(0.02 + 0.98 * static_cast<double>(a.x), 6.28 * static_cast<double>(a.y));
      const glm::vec3 l = direction(0.02 + 0.98 * static_cast<double>(b.x), 6.28 * static_cast<double>(b.y));
      const float forth = lobe_response(ggx(alpha), v, l) * v.z;
      const float back = lobe_response(ggx(alpha), l, v) * l.z;
      EXPECT_NEAR(forth, back, 1e-5F * std::max(forth, back));
    }
  }
}

// The response against the textbook's terms, in double: D and G₁ of Walter et al. 2007, eq. 33 and 34.
TEST(Lobe, GgxIsDistributionTimesMaskingTimesShadowing) {
  for (double alpha : {0.1, 0.5, 1.0}) {
    for (std::uint32_t i = 0; i < 100; ++i) {
      const glm::vec2 a = sobol_2d(i, 3);
      const glm::vec2 b = sobol_2d(i, 4);
      const glm::dvec3 v = direction(0.05 + 0.95 * static_cast<double>(a.x), 6.28 * static_cast<double>(a.y));
      const glm::dvec3 l = direction(0.05 + 0.95 * static_cast<double>(b.x), 6.28 * static_cast<double>(b.y));
      const glm::dvec3 h = glm::normalize(v + l);
      const auto masking = [&](glm::dvec3 w) {
        const double tangent2 = (1.0 - w.z * w.z) / (w.z * w.z);
        return 2.0 / (1.0 + std::sqrt(1.0 + alpha * alpha * tangent2));
      };
      const double tangent2 = (1.0 - h.z * h.z) / (h.z * h.z);
      const double root = 1.0 + tangent2 / (alpha * alpha);
      const double d = 1.0 / (kPi * alpha * alpha * std::pow(h.z, 4) * root * root);
      const double expected = d * masking(v) * masking(l) / (4.0 * v.z);
      EXPECT_NEAR(lobe_response(ggx(static_cast<float>(alpha)), v, l), expected, 1e-4 * expected);
    }
  }
}

// White furnace: what is lost is what the facets shadow.
TEST(Lobe, ReflectsNoMoreThanArrives) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(name(c));
    const glm::vec3 view = direction(c.cosine, 0.0);
    const double whole = integrate([&](glm::vec3 l) { return lobe_response(c.shape, view, l); });
    EXPECT_LE(whole, 1.002);
    EXPECT_GE(whole, 0.3);
  }
  // For α = 1 and normal incidence the integral is ∫ c/(1+c) dc.
  EXPECT_NEAR(integrate([&](glm::vec3 l) {
                return lobe_response(ggx(1.0F), {0, 0, 1}, l);
              }),
              1.0 - std::log(2.0), 1e-4);
  // Smooth facets shadow little; of the whole lobe about the normal none is below the horizon but for N = 1.
  EXPECT_NEAR(integrate([&](glm::vec3 l) { return lobe_response(ggx(0.1F), {0, 0, 1}, l); }), 1.0, 0.02);
  EXPECT_NEAR(integrate([&](glm::vec3 l) { return lobe_response(phong(20.0F), {0, 0, 1}, l); }), 1.0, 1e-3);
}

TEST(Lobe, NarrowLobesAreMirrors) {
  for (const LobeShape& shape : {ggx(1e-4F), phong(1e6F)}) {
    for (double cosine : {1.0, 0.5, 0.05}) {
      const glm::vec3 view = direction(cosine, 2.0);
      for (std::uint32_t i = 0; i < 256; ++i) {
        const glm::vec2 u = sobol_2d(i, 6);
        const glm::vec3 l = sample_lobe(shape, view, u);
        // √(2 ln(1/u)/N), or 2 α tanθ: the last percent of either lobe reaches 0.01.
        EXPECT_LT(glm::length(l - glm::vec3(-view.x, -view.y, view.z)), 0.01F);
        const float density = lobe_density(shape, view, l);
        ASSERT_GT(density, 0.0F);
        EXPECT_NEAR(lobe_response(shape, view, l) / density, l.z > 0.0F ? 1.0F : 0.0F, 2e-3F);
      }
    }
  }
}

// A rough ball under a white sky, traced, against the quadrature of its lobe: the estimator with both of its
// ways to find light.
TEST(Lobe, TracedFurnaceIsTheIntegralOfTheResponse) {
  for (const Case& c : {Case{ggx(0.4F), 0.6}, Case{ggx(1.0F), 0.9}, Case{phong(20.0F), 0.5}}) {
    SCOPED_TRACE(name(c));
    Scene scene;
    Material material = test::mirror(glm::vec3(1.0F));
    material.lobe = c.shape.lobe;
    material.roughness = c.shape.roughness;
    material.exponent = c.shape.exponent;
    test::add_object(scene, make_rectangle({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), material);
    scene.environment = test::constant_environment(1.0F);
    const Tracer tracer(scene, {.indirect = IndirectLight::path});
    const glm::vec3 view = direction(c.cosine, 0.3);
    Camera camera;
    camera.target = glm::vec3(0.0F);
    camera.eye = 3.0F * view;
    camera.up = {0.0F, 0.0F, 1.0F};
    camera.vertical_fov_degrees = 0.1F;
    camera.width = camera.height = 32;
    TraceOptions options;
    options.samples_per_pixel = 256;
    const Image image = tracer.trace_beauty(camera, options);
    double sum = 0.0;
    for (int i = 0; i < 32 * 32; ++i) sum += image.pixels[static_cast<std::size_t>(3 * i)];
    const double expected = integrate([&](glm::vec3 l) { return lobe_response(c.shape, view, l); });
    // 262,144 samples of a value between 0 and 2.
    EXPECT_NEAR(sum / (32 * 32), expected, 4e-3);
  }
}

}  // namespace
}  // namespace mirrorbake
