#include "mirrorbake/envmap/sampling.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/envmap/footprint.hpp"
#include "mirrorbake/envmap/mipmap.hpp"
#include "mirrorbake/envmap/reads.hpp"

namespace mirrorbake {
namespace {

constexpr const char* kProjections[] = {"cube", "dual_paraboloid", "latlong", "angular"};

glm::vec3 random_direction(std::uint32_t i) {
  const glm::vec2 u = sobol_2d(i, 21);
  const float z = 1.0F - 2.0F * u.x;
  const float r = std::sqrt(std::max(0.0F, 1.0F - z * z));
  const float phi = 2.0F * std::numbers::pi_v<float> * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

template <typename F>
EnvMap make_map(const std::string& projection, int width, int height, F&& f) {
  EnvMap map = make_envmap({parse_projection(projection), width, height, 1, 1});
  for (int face = 0; face < face_count(map.layout.projection); ++face) {
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        map.values[map.layout.index(0, face, row, column)] = static_cast<float>(f(direction_from_point(
            map.layout.projection, face, column_center(column, width), row_center(row, height))));
      }
    }
  }
  return build_mips(map, MipFilter::solid_angle);
}

float look_up(const EnvMap& map, glm::vec3 d, glm::vec3 ddx, glm::vec3 ddy, SampleFilter filter) {
  float value = 0.0F;
  sample(map, std::span(&d, 1), std::span(&ddx, 1), std::span(&ddy, 1), {filter}, std::span(&value, 1));
  return value;
}

TEST(Sampling, AConstantMapGivesItsValueForEveryFilterAndFootprint) {
  for (const char* projection : kProjections) {
    const EnvMap map = make_map(projection, 32, 32, [](glm::dvec3) { return 0.4; });
    for (const SampleFilter filter :
         {SampleFilter::nearest, SampleFilter::bilinear, SampleFilter::trilinear, SampleFilter::ewa}) {
      for (std::uint32_t i = 0; i < 300; ++i) {
        const float size = std::pow(10.0F, 3.0F * unit_float(static_cast<std::uint32_t>(hash64(i))) - 3.0F);
        EXPECT_NEAR(look_up(map, random_direction(i), size * random_direction(i + 1),
                            0.1F * size * random_direction(i + 7), filter),
                    0.4F, 1e-6F)
            << projection;
      }
    }
  }
}

// A linear function of the direction is its own mean over a small symmetric footprint, here up to 0.1 rad;
// the maps resolve it to their curvature over a texel, and mips shift it by part of a coarse texel of 0.1
// rad.
TEST(Sampling, FiltersKeepASmoothFunctionAcrossEdgesAndCorners) {
  for (const char* projection : kProjections) {
    const bool panorama = std::string(projection) == "latlong";
    const EnvMap map =
        make_map(projection, panorama ? 256 : 128, 128, [](glm::dvec3 d) { return d.x + d.y - d.z; });
    for (std::uint32_t i = 0; i < 2000; ++i) {
      const glm::vec3 d =
          i % 4 == 0 ? glm::normalize(glm::vec3(1, 1, 1) + 0.03F * random_direction(i)) : random_direction(i);
      const glm::vec3 a = 0.05F * glm::normalize(glm::cross(d, random_direction(i + 3)));
      const glm::vec3 b = 0.5F * glm::cross(d, a);
      const float expected = d.x + d.y - d.z;
      EXPECT_NEAR(look_up(map, d, a, b, SampleFilter::bilinear), expected, 0.04F) << projection << ' ' << i;
      // Around a pole or the rim of the angular map texels are so elongated that square or bounded footprints
      // blur.
      if (panorama && std::abs(d.y) > 0.9F) continue;
      if (map.layout.projection.kind == ProjectionKind::angular && d.z > 0.5F) continue;
      EXPECT_NEAR(look_up(map, d, a, b, SampleFilter::trilinear), expected, 0.1F) << projection << ' ' << i;
      EXPECT_NEAR(look_up(map, d, a, b, SampleFilter::ewa), expected, 0.06F) << projection << ' ' << i;
    }
  }
}

// Stripes one texel wide along one axis: a footprint elongated along the stripes keeps them where the square
// footprint of the longer differential averages them away.
TEST(Sampling, EllipsesKeepWhatTheySkirt) {
  const EnvMap map = make_map("cube", 256, 256, [](glm::dvec3 d) {
    return std::fmod(std::floor(32.0 * (d.x / std::abs(d.z) + 4.0)), 2.0);
  });
  const glm::vec3 d(0.5F / 32.0F, 0.0F, -1.0F);
  const glm::vec3 along(0.0F, 0.1F, 0.0F);
  const glm::vec3 across(0.004F, 0.0F, 0.0F);
  const float ewa = look_up(map, d, along, across, SampleFilter::ewa);
  EXPECT_LT(std::min(ewa, 1.0F - ewa), 0.15F);
  EXPECT_NEAR(look_up(map, d, along, across, SampleFilter::trilinear), 0.5F, 0.2F);
  EXPECT_NEAR(look_up(map, d, glm::vec3(0.3F, 0, 0), along, SampleFilter::ewa), 0.5F, 0.1F);
}

TEST(Sampling, LengthsOfTheDirectionDoNotMatter) {
  const EnvMap map = make_map("cube", 64, 64, [](glm::dvec3 d) { return d.x * d.y; });
  const glm::vec3 d = random_direction(4);
  const glm::vec3 a = 0.02F * random_direction(5);
  for (const float scale : {1e-20F, 1e-3F, 1e10F}) {
    EXPECT_NEAR(look_up(map, scale * d, scale * a, scale * a, SampleFilter::trilinear),
                look_up(map, d, a, a, SampleFilter::trilinear), 1e-5F);
  }
}

TEST(Sampling, HostileDirectionsGiveZeroAndAreCounted) {
  const EnvMap map = make_map("cube", 16, 16, [](glm::dvec3) { return 1.0; });
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const std::vector<glm::vec3> d = {{0, 0, 0}, {nan, 1, 1}, {inf, 0, 0}, {1, 1, 1}, {1e-40F, 0, 0}};
  const std::vector<glm::vec3> wild = {{1, 0, 0}, {0, 0, 0}, {0, 0, 0}, {nan, 0, inf}, {1e38F, 1e38F, 0}};
  for (const SampleFilter filter : {SampleFilter::nearest, SampleFilter::trilinear, SampleFilter::ewa}) {
    std::vector<float> values(5, 7.0F);
    EXPECT_EQ(sample(map, d, wild, wild, {filter}, values), 3u);
    EXPECT_EQ(values[0], 0.0F);
    EXPECT_EQ(values[1], 0.0F);
    EXPECT_EQ(values[2], 0.0F);
    EXPECT_NEAR(values[3], 1.0F, 1e-6F);
    EXPECT_NEAR(values[4], 1.0F, 1e-6F);
  }
  std::vector<float> values(5);
  EXPECT_THROW(sample(map, d, {}, {}, {SampleFilter::ewa}, values), InvalidArgument);
  EXPECT_THROW(sample(map, d, {}, {}, {SampleFilter::nearest}, std::span(values).first(4)), InvalidArgument);
}

// The loop for many directions and the double precision of `sample` against `reads`, in float: they differ by
// rounding of the place on a face, times the step between texels of a random map. Beyond the
// sheet of a paraboloid `sample` goes on to the other hemisphere, where `reads` repeats the edge: directions
// near the rim, and levels whose texels reach there, are left out.
TEST(Sampling, IsTheSumOfWhatReadsReads) {
  for (const bool is_cube : {true, false}) {
    const char* name = is_cube ? "cube" : "dual_paraboloid";
    EnvMap finest = make_map(name, 32, 32, [](glm::dvec3) { return 0.0; });
    finest.layout.levels = 1;
    finest.values.resize(finest.layout.size());
    for (std::size_t i = 0; i < finest.values.size(); ++i)
      finest.values[i] = unit_float(static_cast<std::uint32_t>(hash64(i)));
    const EnvMap map = build_mips(finest, MipFilter::box);
    const TexelTopology topology = is_cube ? TexelTopology::cube(32) : TexelTopology::dual_paraboloid(32);
    ASSERT_EQ(topology.texels(), map.values.size());
    const auto read = [&](const TexelReads& texels) {
      float sum = 0.0F;
      for (const TexelWeight& t : texels) sum += t.weight * map.values[t.texel];
      return sum;
    };
    for (std::uint32_t i = 0; i < 3000; ++i) {
      const glm::vec3 d =
          i % 4 == 0 ? glm::normalize(glm::vec3(1, 1, 1) + 0.05F * random_direction(i)) : random_direction(i);
      const float size = std::pow(10.0F, 3.0F * unit_float(static_cast<std::uint32_t>(hash64(i))) - 3.0F);
      if (!is_cube && (std::abs(d.z) < 0.3F || size > 0.1F)) continue;
      const Footprint footprint{d, size * random_direction(i + 1), 0.3F * size * random_direction(i + 7)};
      const auto value = [&](SampleFilter filter) {
        return look_up(map, d, footprint.ddx, footprint.ddy, filter);
      };
      constexpr float kRounding = 1e-4F;
      EXPECT_NEAR(value(SampleFilter::bilinear),
                  read(reads(topology, footprint, {LookupFilter::bilinear, 1})), kRounding);
      // The level in float and double: their logarithms differ by rounding, too.
      EXPECT_NEAR(value(SampleFilter::trilinear),
                  read(reads(topology, footprint, {LookupFilter::trilinear, 1})), 2.0F * kRounding)
          << name << ' ' << i;
      const MapPoint p = point_from_direction(map.layout.projection, glm::dvec3(d));
      const auto from_side = [](double x) { return std::abs(16.0 * x - std::round(16.0 * x)); };
      if (std::min(from_side(p.x), from_side(p.y)) < 1e-5) continue;  // rounding decides for a texel
      EXPECT_EQ(value(SampleFilter::nearest), read(reads(topology, footprint, {LookupFilter::nearest, 1})));
    }
  }
}

TEST(Sampling, ALevelIsReadAsAskedFor) {
  EnvMap map = make_map("cube", 32, 32, [](glm::dvec3) { return 0.0; });
  for (int level = 0; level < map.layout.levels; ++level) {
    for (std::size_t i = map.layout.level_offset(level); i < map.layout.level_offset(level + 1); ++i)
      map.values[i] = static_cast<float>(level);
  }
  const std::vector<float> levels = {0.0F, 2.25F, 5.0F, 7.0F, -3.0F, 1e30F, -1e30F};
  const std::vector<float> expected = {0.0F, 2.25F, 5.0F, 5.0F, 0.0F, 5.0F, 0.0F};
  std::vector<glm::vec3> d;
  for (std::uint32_t i = 0; i < levels.size(); ++i) d.push_back(random_direction(i));
  std::vector<float> values(levels.size());
  sample(map, d, {}, {}, {.filter = SampleFilter::trilinear, .level = levels}, values);
  for (std::size_t i = 0; i < levels.size(); ++i) EXPECT_FLOAT_EQ(values[i], expected[i]);
  // One level for all, moved by a bias.
  const float one = 1.5F;
  sample(map, d, {}, {}, {.filter = SampleFilter::trilinear, .bias = 0.25, .level = std::span(&one, 1)},
         values);
  for (const float value : values) EXPECT_FLOAT_EQ(value, 1.75F);
}

// A bias is a larger footprint; where that still lies within a texel, the finest level is read.
TEST(Sampling, ABiasScalesTheFootprint) {
  const EnvMap map = make_map("cube", 64, 64, [](glm::dvec3 d) { return d.x * d.y + std::sin(20.0 * d.z); });
  for (const SampleFilter filter : {SampleFilter::trilinear, SampleFilter::ewa}) {
    for (std::uint32_t i = 0; i < 200; ++i) {
      const glm::vec3 d = random_direction(i);
      const glm::vec3 a = 0.02F * random_direction(i + 1);
      const glm::vec3 b = 0.01F * random_direction(i + 2);
      float biased = 0.0F;
      sample(map, std::span(&d, 1), std::span(&a, 1), std::span(&b, 1), {.filter = filter, .bias = 2.0},
             std::span(&biased, 1));
      EXPECT_FLOAT_EQ(biased, look_up(map, d, 4.0F * a, 4.0F * b, filter));
    }
  }
}

TEST(Sampling, OptionsThatContradictEachOtherAreErrors) {
  const EnvMap map = make_map("cube", 4, 4, [](glm::dvec3) { return 1.0; });
  const std::vector<glm::vec3> d(3, {0, 0, 1});
  std::vector<float> values(3);
  const std::vector<float> two(2, 0.0F);
  const float level = 1.0F;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto refuses = [&](const SampleOptions& options) {
    EXPECT_THROW(sample(map, d, d, d, options, values), InvalidArgument);
  };
  refuses({.filter = SampleFilter::ewa, .level = std::span(&level, 1)});
  refuses({.filter = SampleFilter::bilinear, .level = std::span(&level, 1)});
  refuses({.filter = SampleFilter::trilinear, .level = two});
  refuses({.filter = SampleFilter::trilinear, .level = std::span(&nan, 1)});
  refuses({.filter = SampleFilter::nearest, .bias = 1.0});
  refuses({.filter = SampleFilter::trilinear, .bias = 65.0});
  refuses({.filter = SampleFilter::trilinear, .bias = std::numeric_limits<double>::quiet_NaN()});
  refuses({.filter = SampleFilter::ewa, .max_anisotropy = 0.5});
}

TEST(Footprint, CornersOfAPixelGiveItsMiddleAndSides) {
  const Footprint f = footprint_from_corners({glm::vec3(-0.1F, 0.05F, -1), glm::vec3(0.1F, 0.05F, -1),
                                              glm::vec3(0.1F, -0.05F, -1), glm::vec3(-0.1F, -0.05F, -1)});
  EXPECT_LT(glm::length(f.direction - glm::vec3(0, 0, -1)), 1e-6F);
  EXPECT_NEAR(f.ddx.x, 0.2F, 3e-3F);  // normalising shortens by 1 − 1/√1.0125
  EXPECT_NEAR(f.ddy.y, -0.1F, 2e-3F);
  EXPECT_EQ(footprint_from_corners({}).direction, glm::vec3(0.0F));
}

TEST(Footprint, ReflectedDifferentialIsTheDerivativeOfTheReflection) {
  const auto reflect = [](glm::dvec3 d, glm::dvec3 n) { return d - 2.0 * glm::dot(d, n) * n; };
  const glm::dvec3 d = glm::dvec3(random_direction(1));
  const glm::dvec3 n = glm::dvec3(random_direction(2));
  const glm::dvec3 dd = glm::dvec3(random_direction(3));
  const glm::dvec3 dn = glm::dvec3(random_direction(4));
  constexpr double kStep = 1e-5;
  const glm::dvec3 expected =
      (reflect(d + kStep * dd, n + kStep * dn) - reflect(d - kStep * dd, n - kStep * dn)) / (2.0 * kStep);
  EXPECT_LT(glm::length(
                glm::dvec3(reflected_differential(glm::vec3(d), glm::vec3(n), glm::vec3(dd), glm::vec3(dn))) -
                expected),
            1e-5);
}

TEST(Footprint, QuadDifferentialsAreThoseOfTheQuad) {
  std::vector<glm::vec3> d;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 5; ++column) d.emplace_back(column * column, 10 * row * row, 1);
  }
  std::vector<glm::vec3> ddx(15);
  std::vector<glm::vec3> ddy(15);
  quad_differentials(5, 3, d, ddx, ddy);
  const float expected[5] = {1, 1, 5, 5, 7};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(ddx[i].x, expected[i]);
  EXPECT_EQ(ddy[0].y, 10.0F);
  EXPECT_EQ(ddy[10].y, 30.0F);
  EXPECT_THROW(quad_differentials(4, 3, d, ddx, ddy), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
