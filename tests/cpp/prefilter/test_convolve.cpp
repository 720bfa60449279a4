#include "mirrorbake/prefilter/convolve.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/envmap/compare.hpp"
#include "mirrorbake/envmap/resample.hpp"
#include "panorama.hpp"

namespace mirrorbake {
namespace {

constexpr double kPi = std::numbers::pi;

// Every texel at its middle, in double; its own formulas, not the library's.
std::array<double, 4> all_texels(const EnvMap& map, const Lobe& lobe, const glm::dvec3& r) {
  std::array<double, 4> sums{};
  const int width = map.layout.width;
  const int height = map.layout.height;
  for (int row = 0; row < height; ++row) {
    const double latitude = kPi * (0.5 - (row + 0.5) / height);
    const double angle = 2.0 * kPi / width * 2.0 * std::cos(latitude) * std::sin(0.5 * kPi / height);
    for (int column = 0; column < width; ++column) {
      const double longitude = kPi * (2.0 * (column + 0.5) / width - 1.0);
      const glm::dvec3 l(std::cos(latitude) * std::sin(longitude), std::sin(latitude),
                         -std::cos(latitude) * std::cos(longitude));
      const double c = glm::dot(r, l);
      if (c <= 0.0) continue;
      double weight = c;
      if (lobe.kind == LobeKind::phong) weight = std::pow(c, lobe.exponent);
      if (lobe.kind == LobeKind::ggx) {
        const double a = lobe.alpha * lobe.alpha;
        const double cos2 = 0.5 * (1.0 + c);
        weight = c * std::pow(a / (cos2 * (a - 1.0) + 1.0), 2.0);
      }
      const float* texel = map.values.data() + map.layout.index(0, 0, row, column);
      for (std::size_t k = 0; k < 3; ++k) sums[k] += weight * angle * static_cast<double>(texel[k]);
      sums[3] += weight * angle;
    }
  }
  return sums;
}

// Some texels of a cube of 16² faces, by relative error in rising order.
std::vector<double> errors(const EnvMap& map, const Lobe& lobe, LobeScale scale) {
  const EnvMap ours = Convolver(map).apply(lobe, {{ProjectionKind::cube}, 16, 16}, scale);
  std::vector<double> found;
  for (std::size_t texel = 3; texel < ours.layout.level_texels(0); texel += 29) {
    const int at = static_cast<int>(texel);
    const glm::vec3 r(direction_from_point(ours.layout.projection, at / 256, column_center(at % 16, 16),
                                           row_center(at / 16 % 16, 16)));
    const std::array<double, 4> sums = all_texels(map, lobe, glm::normalize(glm::dvec3(r)));
    for (std::size_t c = 0; c < 3; ++c) {
      const double expected = scale == LobeScale::mean ? sums[c] / sums[3] : sums[c];
      found.push_back(std::abs(static_cast<double>(ours.values[3 * texel + c]) / expected - 1.0));
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

TEST(Convolve, IrradianceIsTheSumOverAllTexelsTheSunIncluded) {
  const EnvMap map = testing::sunny_panorama(128);
  EXPECT_LT(errors(map, {LobeKind::lambert}, LobeScale::sum).back(), 1e-6);
  EXPECT_LT(errors(map, {LobeKind::phong, 1.0}, LobeScale::mean).back(), 1e-6);
  EXPECT_LT(errors(map, {LobeKind::ggx, 1.0, 1.0}, LobeScale::mean).back(), 1e-6);
}

TEST(Convolve, PhongIsWithinAThousandthOfTheSumOverAllTexels) {
  const EnvMap map = testing::sunny_panorama(128);
  for (const double exponent : {2.0, 10.0, 128.0, 600.0}) {
    for (const LobeScale scale : {LobeScale::mean, LobeScale::sum}) {
      const std::vector<double> e = errors(map, {LobeKind::phong, exponent}, scale);
      EXPECT_LT(e[e.size() / 2], 1e-3) << exponent;
      EXPECT_LT(e[e.size() * 99 / 100], 1e-2) << exponent;
    }
  }
}

TEST(Convolve, GgxIsWithinAThousandthOfTheSumOverAllTexels) {
  const EnvMap map = testing::sunny_panorama(128);
  for (const double alpha : {0.04, 0.1, 0.5, 0.8}) {
    const std::vector<double> e = errors(map, {LobeKind::ggx, 1.0, alpha}, LobeScale::mean);
    EXPECT_LT(e[e.size() / 2], 1e-3) << alpha;
    EXPECT_LT(e[e.size() * 99 / 100], 1e-2) << alpha;
  }
}

// A table of Phong's weights by degree is Phong's lobe but for what cubics between them miss.
TEST(Convolve, ATableIsTheLobeItWasMadeFrom) {
  const EnvMap map = testing::sunny_panorama(64);
  Lobe table{LobeKind::table};
  table.table_angle = 90.0;
  for (int i = 0; i <= 360; ++i) table.table.push_back(std::pow(std::cos(kPi * i / 720.0), 20.0));
  const PrefilterTarget target{{ProjectionKind::cube}, 8, 8};
  const EnvMap ours = Convolver(map).apply(table, target);
  const EnvMap phong = Convolver(map).apply({LobeKind::phong, 20.0}, target);
  for (std::size_t i = 0; i < ours.values.size(); ++i) {
    EXPECT_NEAR(ours.values[i] / phong.values[i], 1.0, 5e-3) << i;
  }
}

TEST(Convolve, WhiteStaysWhiteForEveryLobeAndProjection) {
  for (const char* projection :
       {"latlong", "cube", "dual_paraboloid", "angular", "sphere_map", "equal_area"}) {
    EnvMap map = make_envmap({parse_projection(projection), 16, 16, 1, 4});
    std::fill(map.values.begin(), map.values.end(), 0.7F);
    Convolver convolver(map);
    for (const Lobe& lobe :
         {Lobe{LobeKind::lambert}, Lobe{LobeKind::phong, 3.0}, Lobe{LobeKind::phong, 200.0},
          Lobe{LobeKind::phong, 1e4}, Lobe{LobeKind::ggx, 1.0, 0.1}, Lobe{LobeKind::ggx, 1.0, 1.0}}) {
      const EnvMap white = convolver.apply(lobe, {{ProjectionKind::latlong}, 12, 6});
      for (const float value : white.values) {
        EXPECT_NEAR(value, 0.7F, 7e-7F) << projection << ' ' << static_cast<int>(lobe.kind);
      }
    }
  }
}

TEST(Convolve, SumsOverAWhiteMapAreTheIntegralOfTheLobe) {
  EnvMap map = make_envmap({{ProjectionKind::latlong}, 256, 128, 1, 1});
  std::fill(map.values.begin(), map.values.end(), 1.0F);
  Convolver convolver(map);
  for (const Lobe& lobe : {Lobe{LobeKind::lambert}, Lobe{LobeKind::phong, 10.0},
                           Lobe{LobeKind::phong, 5000.0}, Lobe{LobeKind::ggx, 1.0, 0.3}}) {
    const EnvMap sums = convolver.apply(lobe, {{ProjectionKind::cube}, 4, 4}, LobeScale::sum);
    // The fourth order of cells that are 0.45 of the lobe wide.
    for (const float value : sums.values) EXPECT_NEAR(value / lobe_integral(lobe), 1.0, 2e-3);
  }
}

TEST(Convolve, ContrastRisesWithTheExponentToThatOfTheMap) {
  const EnvMap map = testing::sunny_panorama(32);
  const PrefilterTarget same{map.layout.projection, 64, 32};
  Convolver convolver(map);
  double before = std::numeric_limits<double>::infinity();
  for (const double exponent : {1.0, 10.0, 100.0, 1e3, 1e6}) {
    const double error = compare(convolver.apply({LobeKind::phong, exponent}, same), map).relative_l2;
    EXPECT_LT(error, before) << exponent;
    before = error;
  }
  EXPECT_LT(before, 1e-3);  // texels at the poles are five times as wide as the lobe
  const Lobe mirror{LobeKind::phong, std::numeric_limits<double>::infinity()};
  EXPECT_EQ(convolver.apply(mirror, same).values, map.values);
}

TEST(Convolve, ASingleTexelIsTheMapAtAnyExponent) {
  EnvMap map = make_envmap({{ProjectionKind::latlong}, 1, 1, 1, 3});
  map.values = {1.0F, 65504.0F, 0.0F};
  for (const double exponent : {1.0, 100.0, 1e6}) {
    const EnvMap same = Convolver(map).apply({LobeKind::phong, exponent}, {{ProjectionKind::latlong}, 2, 1});
    for (std::size_t i = 0; i < same.values.size(); ++i) {
      EXPECT_NEAR(same.values[i], map.values[i % 3], 1e-6F * map.values[i % 3]);
    }
  }
}

TEST(Convolve, OneBrightTexelCountsFromWhereItStands) {
  EnvMap map = make_envmap({{ProjectionKind::latlong}, 256, 128, 1, 1});
  map.values[map.layout.index(0, 0, 40, 77)] = 65504.0F;
  const glm::dvec3 l =
      direction_from_point(map.layout.projection, 0, column_center(77, 256), row_center(40, 128));
  const double angle = texel_solid_angle(map.layout.projection, 256, 128, 77, 40);
  const Lobe lobe{LobeKind::ggx, 1.0, 0.2};
  std::vector<glm::vec3> axes;
  std::vector<float> values(64);
  for (int i = 0; i < 64; ++i) axes.emplace_back(std::sin(0.1 * i), 0.3, std::cos(0.1 * i));
  Convolver(map).apply(lobe, axes, LobeScale::sum, values);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const double expected =
        65504.0 * angle * lobe_weight(lobe, glm::dot(glm::normalize(glm::dvec3(axes[i])), l));
    EXPECT_NEAR(values[i], expected, 1e-5 * expected + 1e-12) << i;
  }
}

TEST(Convolve, BlackStaysBlackAndWhatAFisheyeDoesNotSeeHasNoLight) {
  const EnvMap black = make_envmap({{ProjectionKind::cube}, 4, 4, 1, 3});
  for (const float value :
       Convolver(black).apply({LobeKind::ggx, 1.0, 0.5}, {{ProjectionKind::cube}, 4, 4}).values) {
    EXPECT_EQ(value, 0.0F);
  }
  EnvMap sky = make_envmap({{ProjectionKind::fisheye, 90.0F}, 64, 64, 1, 1});
  std::fill(sky.values.begin(), sky.values.end(), 1.0F);
  const std::vector<glm::vec3> axes{{0, 0, -1}, {0, 0, 1}};
  std::vector<float> values(2);
  Convolver(sky).apply({LobeKind::phong, 100.0}, axes, LobeScale::mean, values);
  EXPECT_NEAR(values[0], 1.0F, 1e-6F);
  EXPECT_EQ(values[1], 0.0F);
}

TEST(Convolve, ThreadsAndInstructionSetsGiveTheSameBits) {
  const EnvMap map = testing::sunny_panorama(64);
  const PrefilterTarget target{{ProjectionKind::cube}, 16, 16};
  for (const Lobe& lobe : {Lobe{LobeKind::lambert}, Lobe{LobeKind::phong, 40.0}, Lobe{LobeKind::phong, 5e3},
                           Lobe{LobeKind::ggx, 1.0, 0.2}}) {
    const EnvMap expected = Convolver(map).apply(lobe, target);
    const ThreadLimit one(1);
    const IsaLimit plain(Isa::baseline);
    EXPECT_EQ(Convolver(map).apply(lobe, target).values, expected.values);
  }
}

TEST(Convolve, ProgressRisesToOneAndChangesNothing) {
  EnvMap map = make_envmap({{ProjectionKind::latlong}, 64, 32, 1, 4});
  for (std::size_t i = 0; i < map.values.size(); ++i) map.values[i] = static_cast<float>(i % 17);
  const PrefilterTarget target{{ProjectionKind::cube}, 16, 16};
  Convolver convolver(map);
  for (const Lobe& lobe : {Lobe{LobeKind::lambert}, Lobe{LobeKind::phong, 20.0}, Lobe{LobeKind::phong, 1e4},
                           Lobe{LobeKind::ggx, 1.0, 0.0}}) {
    std::vector<double> done;
    const auto progress = [&](double share) { done.push_back(share); };
    const EnvMap watched = convolver.apply(lobe, target, LobeScale::mean, progress);
    EXPECT_EQ(watched.values, convolver.apply(lobe, target).values);
    EXPECT_TRUE(std::is_sorted(done.begin(), done.end()));
    EXPECT_EQ(done.back(), 1.0);
    EXPECT_GT(done.size(), is_mirror(lobe) ? 0U : 40U);
  }
}

TEST(Convolve, AChainRunsFromTheMapToTheCosineLobe) {
  const EnvMap map = testing::sunny_panorama(32);
  ChainOptions options;
  options.size = 32;
  std::vector<int> done;
  options.progress = [&](int level, int) { done.push_back(level); };
  const EnvMap chain = ggx_chain(map, options);
  EXPECT_EQ(chain.layout.levels, 4);
  EXPECT_EQ(done, (std::vector{0, 1, 2, 3}));
  const EnvMap mirror = resample(map, {ProjectionKind::cube}, 32, 32);
  EXPECT_TRUE(std::equal(mirror.values.begin(), mirror.values.end(), chain.values.begin()));
  const EnvMap rough = Convolver(map).apply({LobeKind::ggx, 1.0, 1.0}, {{ProjectionKind::cube}, 4, 4});
  const std::span<const float> last = EnvMapView(chain).level(3);
  EXPECT_TRUE(std::equal(last.begin(), last.end(), rough.values.begin()));
  EXPECT_EQ(chain_alpha(0, 5, RoughnessScale::squared), 0.0);
  EXPECT_EQ(chain_alpha(2, 5, RoughnessScale::squared), 0.25);
  EXPECT_EQ(chain_alpha(2, 5, RoughnessScale::linear), 0.5);
}

TEST(Convolve, NanIsCountedAndOutOfRangeIsNamed) {
  EnvMap map = testing::sunny_panorama(8);
  map.values[5] = std::numeric_limits<float>::quiet_NaN();
  map.values[7] = std::numeric_limits<float>::infinity();
  try {
    const Convolver convolver(map);
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_STREQ(error.what(), "map is 2 NaN or infinite values, expected finite values");
  }
  map = testing::sunny_panorama(8);
  Convolver convolver(map);
  const PrefilterTarget target{{ProjectionKind::cube}, 4, 4};
  EXPECT_THROW(convolver.apply({LobeKind::phong, 0.5}, target), InvalidArgument);
  EXPECT_THROW(convolver.apply({LobeKind::ggx, 1.0, 0.001}, target), InvalidArgument);
  EXPECT_THROW(convolver.apply({LobeKind::ggx, 1.0, 0.0}, target, LobeScale::sum), InvalidArgument);
  EXPECT_THROW(convolver.apply({LobeKind::table}, target), InvalidArgument);
  EXPECT_THROW(convolver.apply({LobeKind::lambert}, {{ProjectionKind::cube}, 4, 5}), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
