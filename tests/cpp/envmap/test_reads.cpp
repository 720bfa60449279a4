#include "mirrorbake/envmap/reads.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/projection/cube.hpp"
#include "mirrorbake/projection/projection.hpp"

namespace mirrorbake {
namespace {

glm::vec3 random_direction(std::uint32_t i) {
  const glm::vec2 u = sobol_2d(i, 5);
  const float z = 1.0F - 2.0F * u.x;
  const float r = std::sqrt(std::max(0.0F, 1.0F - z * z));
  const float phi = 2.0F * std::numbers::pi_v<float> * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

// A trilinear lookup at a level.
TexelReads trilinear(const TexelTopology& topology, glm::vec3 direction, float level) {
  TexelReads result;
  add_trilinear(topology, level, direction, 1.0F, result);
  return result;
}

float lookup(const TexelReads& footprint, const std::vector<float>& map) {
  float value = 0;
  for (const TexelWeight& t : footprint) value += t.weight * map[t.texel];
  return value;
}

TEST(Reads, WeightsSumToOneOnEveryLevel) {
  for (int size : {1, 2, 4, 64}) {
    const CubePyramidLayout layout = CubePyramidLayout::full(size);
    for (std::uint32_t i = 0; i < 2000; ++i) {
      const float lod = static_cast<float>(layout.levels) * unit_float(static_cast<std::uint32_t>(hash64(i)));
      const TexelReads footprint = trilinear(layout, random_direction(i), lod);
      float sum = 0;
      for (const TexelWeight& t : footprint) {
        EXPECT_LT(t.texel, layout.texels());
        EXPECT_GE(t.weight, 0.0F);
        sum += t.weight;
      }
      EXPECT_NEAR(sum, 1.0F, 1e-6F);
    }
  }
}

// Along a great circle the filtered map has no step: a bilinear, seamless lookup is continuous, so over a
// step of angle h it changes by at most (texels per radian, at most n at a face's centre... n/2·2) · h ·
// range, here 64 h.
TEST(Reads, LookupIsContinuousAcrossEdgesAndCorners) {
  const CubePyramidLayout layout = CubePyramidLayout::full(16);
  std::vector<float> map(layout.texels());
  for (std::size_t i = 0; i < map.size(); ++i) map[i] = unit_float(static_cast<std::uint32_t>(hash64(i)));
  for (std::uint32_t k = 0; k < 40; ++k) {
    // Circles through a corner of the cube among others.
    const glm::vec3 a = k % 2 ? glm::normalize(glm::vec3(1, 1, 1)) : random_direction(k);
    const glm::vec3 b = glm::normalize(glm::cross(a, random_direction(k + 100)));
    constexpr int kSteps = 20000;
    constexpr float kStep = 2.0F * std::numbers::pi_v<float> / kSteps;
    float previous = lookup(trilinear(layout, a, 0.0F), map);
    for (int i = 1; i <= kSteps; ++i) {
      const float angle = kStep * static_cast<float>(i);
      const float value = lookup(trilinear(layout, std::cos(angle) * a + std::sin(angle) * b, 0.0F), map);
      ASSERT_LT(std::abs(value - previous), 64.0F * kStep) << "circle " << k << ", step " << i;
      previous = value;
    }
  }
}

// A map that holds the direction's own y component is reproduced to the curvature of that function over a
// texel.
TEST(Reads, ReproducesASmoothFunction) {
  const CubePyramidLayout layout = CubePyramidLayout::full(64);
  std::vector<float> map(layout.texels());
  for (int face = 0; face < 6; ++face) {
    for (int row = 0; row < 64; ++row) {
      for (int column = 0; column < 64; ++column) {
        const glm::vec3 d = direction_from_cube(face, (static_cast<float>(column) + 0.5F) / 64,
                                                (static_cast<float>(row) + 0.5F) / 64);
        map[layout.index(0, face, row, column)] = glm::normalize(d).y;
      }
    }
  }
  for (std::uint32_t i = 0; i < 5000; ++i) {
    const glm::vec3 d = random_direction(i);
    // Half a texel of 2/64 beyond an edge lies (2/64)²-close to the neighbour's plane extended; corners
    // average three.
    EXPECT_NEAR(lookup(trilinear(layout, d, 0.0F), map), d.y, 2e-2F);
  }
}

TEST(Reads, DifferentialsAreCountedInTexels) {
  const TexelTopology cube = TexelTopology::cube(256);
  // At a face's centre a texel is 2/256 of the direction's length.
  const float texel = 2.0F / 256;
  for (float texels : {1.0F, 2.0F, 4.0F, 8.0F, 64.0F}) {
    for (float length : {1e-3F, 1.0F, 1e3F}) {
      const glm::vec3 d(0, 0, -length);
      // A differential along the ray changes nothing.
      const TexelLengths lengths = texel_lengths(cube, {d, {texels * texel * length, 0, 0}, {0, 0, length}});
      EXPECT_NEAR(lengths.ddx, texels, 1e-4F * texels);
      EXPECT_EQ(lengths.ddy, 0.0F);
    }
  }
}

// The quotient rule against a difference, in double precision of the projection.
TEST(Reads, DifferentialsOfAParaboloidAreThoseOfItsProjection) {
  const TexelTopology topology = TexelTopology::dual_paraboloid(64);
  const Projection projection{ProjectionKind::dual_paraboloid};
  for (std::uint32_t i = 0; i < 500; ++i) {
    const glm::vec3 d = 3.0F * random_direction(i);
    const glm::vec3 change = random_direction(i + 1000);
    constexpr double kStep = 1e-6;
    const MapPoint a = point_from_direction(projection, glm::dvec3(d));
    const MapPoint b = point_from_direction(projection, glm::dvec3(d) + kStep * glm::dvec3(change));
    if (a.face != b.face) continue;
    const double expected = 32.0 * std::hypot(b.x - a.x, b.y - a.y) / kStep;
    EXPECT_NEAR(static_cast<double>(texel_lengths(topology, {d, change, {}}).ddx), expected,
                1e-4 * expected + 1e-4);
  }
}

TEST(TapPattern, TapsShareTheirWeightAroundTheMiddle) {
  for (int max_taps : {1, 2, 4, 16}) {
    for (float major : {0.1F, 1.0F, 3.0F, 40.0F, 1e6F}) {
      for (float elongation = 1.0F; elongation < 20.0F; elongation *= 1.03F) {
        const TapPattern p = tap_pattern(major, major / elongation, max_taps, 9);
        ASSERT_LE(p.taps, max_taps);
        float sum = 0.0F;
        float middle = 0.0F;
        for (std::size_t i = 0; i < static_cast<std::size_t>(p.taps); ++i) {
          ASSERT_GT(p.weights[i], 0.0F);
          ASSERT_LE(std::abs(p.offsets[i]), 0.5F);
          sum += p.weights[i];
          middle += p.weights[i] * p.offsets[i];
        }
        ASSERT_NEAR(sum, 1.0F, 1e-6F);
        ASSERT_NEAR(middle, 0.0F, 1e-6F);
      }
    }
  }
}

TEST(TapPattern, EvenElongationsAreEvenlySpacedTaps) {
  for (int n : {2, 4, 8, 16}) {
    const TapPattern p = tap_pattern(static_cast<float>(8 * n), 8.0F, 16, 9);
    ASSERT_EQ(p.taps, n);
    EXPECT_EQ(p.level, 3.0F);
    std::vector<float> offsets(p.offsets.begin(), p.offsets.begin() + n);
    std::sort(offsets.begin(), offsets.end());
    for (int i = 0; i < n; ++i) {
      EXPECT_NEAR(offsets[static_cast<std::size_t>(i)],
                  (static_cast<float>(i) + 0.5F) / static_cast<float>(n) - 0.5F, 1e-6F);
      EXPECT_NEAR(p.weights[static_cast<std::size_t>(i)], 1.0F / static_cast<float>(n), 1e-6F);
    }
  }
}

// A hardware's rounding may put a footprint on either side of where a pair of taps comes in: what is read
// must not care. The value of a random map moves with the elongation by no more than its slope, with no step
// at 1¼, 2, 4, 6 …
TEST(Reads, NothingJumpsWhereTapsComeIn) {
  const TexelTopology topology = TexelTopology::cube(64);
  std::vector<float> map(topology.texels());
  for (std::size_t i = 0; i < map.size(); ++i) map[i] = unit_float(static_cast<std::uint32_t>(hash64(i)));
  for (std::uint32_t k = 0; k < 50; ++k) {
    const glm::vec3 d = random_direction(k);
    const glm::vec3 u = glm::normalize(glm::cross(d, random_direction(k + 100)));
    const glm::vec3 v = glm::cross(d, u);
    for (float elongation : {1.25F, 2.0F, 4.0F, 6.0F, 8.0F}) {
      const auto value = [&](float n) {
        return lookup(reads(topology, {d, 0.3F * u, 0.3F / n * v}, {LookupFilter::anisotropic, 8}), map);
      };
      EXPECT_NEAR(value(elongation * 0.99999F), value(elongation * 1.00001F), 1e-3F);
    }
  }
}

TEST(Reads, EndlessDifferentialsReadTheCoarsestLevel) {
  const TexelTopology topology = TexelTopology::cube(256);
  for (const float huge : {1e30F, std::numeric_limits<float>::infinity()}) {
    for (const TexelWeight& t :
         reads(topology, {{1, 0, 0}, {0, huge, 0}, {0, 0, 0}}, {LookupFilter::trilinear, 1})) {
      EXPECT_GE(t.texel, topology.level_offset(8));
      EXPECT_LT(t.texel, topology.texels());
    }
  }
}

TEST(Reads, AnAtlasIsReadAtItsTextureCoordinates) {
  const TexelTopology topology = TexelTopology::atlas(4, 2);
  TexelReads nearest = reads(topology, {{0.6F, 0.9F, 0.0F}, {}, {}}, {LookupFilter::nearest, 1});
  ASSERT_EQ(nearest.count, 1);
  EXPECT_EQ(nearest.texels[0].texel, topology.index({0, 0, 1, 2}));
  // Beyond the sheet its edge is repeated.
  for (const TexelWeight& t : reads(topology, {{-3.0F, 7.0F, 0.0F}, {}, {}}, {LookupFilter::bilinear, 1})) {
    EXPECT_EQ(t.texel, topology.index({0, 0, 1, 0}));
  }
}

TEST(Reads, NamesOfFiltersRoundTrip) {
  for (const char* name : {"nearest", "bilinear", "trilinear", "anisotropic"}) {
    EXPECT_EQ(name_of(parse_name<LookupFilter>(name)), name);
  }
  EXPECT_THROW(parse_name<LookupFilter>("ewa"), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
