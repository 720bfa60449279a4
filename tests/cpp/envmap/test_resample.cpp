#include "mirrorbake/envmap/resample.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/sampling.hpp"

namespace mirrorbake {
namespace {

constexpr const char* kProjections[] = {"cube",    "dual_paraboloid", "sphere_map",
                                        "latlong", "angular",         "fisheye:360"};

// Value f(direction) in the centre of every texel.
template <typename F>
EnvMap make_map(const std::string& projection, int width, int height, F&& f) {
  EnvMap map = make_envmap({parse_projection(projection), width, height, 1, 1});
  for (int face = 0; face < face_count(map.layout.projection); ++face) {
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        const glm::dvec3 d = direction_from_point(map.layout.projection, face, column_center(column, width),
                                                  row_center(row, height));
        map.values[map.layout.index(0, face, row, column)] = static_cast<float>(f(d));
      }
    }
  }
  return map;
}

// Lights of 5e4, 1° to 2° wide, before a background of 0.1 to 1: [EMT]-style panoramas at their worst.
double lights(glm::dvec3 d) {
  for (std::uint32_t i = 0; i < 8; ++i) {
    const glm::dvec2 u(sobol_2d(i, 3));
    const double z = 1.0 - 2.0 * u.x;
    const double r = std::sqrt(1.0 - z * z);
    const double phi = 2.0 * std::numbers::pi * u.y;
    const double radius = (0.5 + i / 16.0) * std::numbers::pi / 180.0;
    const glm::dvec3 center(r * std::cos(phi), r * std::sin(phi), z);
    if (glm::dot(d, center) > std::cos(radius)) return 5e4;
  }
  return 0.55 + 0.45 * std::sin(5.0 * d.x + 3.0 * d.y + 2.0 * d.z);
}

double smooth(glm::dvec3 d) { return 2.0 + d.x - 0.5 * d.y * d.z; }

TEST(Resample, ConstantsStayConstantBetweenAnyTwoProjections) {
  for (const char* from : kProjections) {
    for (const int size : {1, 7}) {
      const EnvMap source = make_map(from, size, size, [](glm::dvec3) { return 0.7; });
      for (const char* to : kProjections) {
        for (const char* filter : {"automatic", "area", "bilinear", "nearest"}) {
          for (const int target_size : {1, 5, 16}) {
            const EnvMap result = resample(source, parse_projection(to), target_size, target_size,
                                           {parse_resample_filter(filter)});
            for (const float v : result.values) {
              ASSERT_NEAR(v, 0.7F, 1e-6F) << from << " to " << to << ", " << filter << ", " << target_size;
            }
          }
        }
      }
    }
  }
}

// Every texel against the mean of 160² places of it, weighted by solid angle, each reading the source's texel it lies
// in. It is the reference that is inexact: its error falls with the number of places, 0.05 with 32² of them.
TEST(Resample, MinificationIsTheMeanOverTheTexelsArea) {
  constexpr int kSize = 16;
  constexpr int kPlaces = 160;
  const EnvMap source = make_map("latlong", 256, 128, lights);
  const Projection cube = parse_projection("cube");
  const EnvMap result = resample(source, cube, kSize, kSize);
  double difference = 0.0;
  double norm = 0.0;
  for (int face : {1, 2}) {
    for (int row = 0; row < kSize; ++row) {
      for (int column = 0; column < kSize; ++column) {
        double sum = 0.0;
        double weight = 0.0;
        for (int i = 0; i < kPlaces; ++i) {
          for (int j = 0; j < kPlaces; ++j) {
            const double x = column_center(column * kPlaces + i, kSize * kPlaces);
            const double y = row_center(row * kPlaces + j, kSize * kPlaces);
            const MapPoint p =
                point_from_direction(source.layout.projection, direction_from_point(cube, face, x, y));
            const double w = std::pow(1.0 + x * x + y * y, -1.5);
            sum +=
                w *
                static_cast<double>(
                    source.values[source.layout.index(0, 0, texel_index(-p.y, 128), texel_index(p.x, 256))]);
            weight += w;
          }
        }
        const double expected = sum / weight;
        const double error =
            static_cast<double>(result.values[result.layout.index(0, face, row, column)]) - expected;
        difference += error * error;
        norm += expected * expected;
      }
    }
  }
  EXPECT_LT(std::sqrt(difference / norm), 0.02);
  EXPECT_GT(norm, 1e6);
}

TEST(Resample, FluxIsKeptBetweenAnyTwoProjections) {
  for (const char* from : kProjections) {
    const bool panorama = std::string(from) == "latlong";
    const EnvMap source = make_map(from, panorama ? 256 : 128, 128, lights);
    for (const char* to : kProjections) {
      const EnvMap result = resample(source, parse_projection(to), 64, 64, {ResampleFilter::area});
      // The rim of a one-piece map is a single direction, around which a texel's edges are not straight in such a map.
      const bool singular = std::string(from) != "cube" && std::string(from) != "latlong";
      const double tolerance = singular ? 2e-2 : 1e-3;
      EXPECT_NEAR(integrate(result)[0] / integrate(source)[0], 1.0, tolerance) << from << " to " << to;
    }
  }
}

TEST(Resample, FluxOfAPanoramaWithLightsSurvivesToOnePartIn10000) {
  const EnvMap source = make_map("latlong", 1024, 512, lights);
  for (const int size : {64, 128, 200}) {
    const EnvMap result = resample(source, parse_projection("cube"), size, size);
    EXPECT_NEAR(integrate(result)[0] / integrate(source)[0], 1.0, 1e-4) << size;
  }
}

// Bilinear interpolation misses a smooth function by its curvature over a texel, h²/8 of about 1, with h = 1/16 rad;
// around a pole or beyond a rim the source's texels are further apart.
TEST(Resample, MagnificationIsSmooth) {
  for (const char* from : {"cube", "dual_paraboloid", "latlong"}) {
    const EnvMap source = make_map(from, std::string(from) == "latlong" ? 128 : 64, 64, smooth);
    for (const char* to : {"cube", "latlong", "angular"}) {
      const EnvMap expected = make_map(to, 300, 300, smooth);
      const EnvMap result = resample(source, parse_projection(to), 300, 300);
      double worst = 0.0;
      for (std::size_t i = 0; i < result.values.size(); ++i) {
        worst = std::max(worst, std::abs(static_cast<double>(result.values[i] - expected.values[i])));
      }
      EXPECT_LT(worst, 0.03) << from << " to " << to;
    }
  }
}

TEST(Resample, ToItselfChangesNothing) {
  for (const char* projection : {"cube", "latlong", "dual_paraboloid"}) {
    const EnvMap source =
        make_map(projection, 32, 32, [](glm::dvec3 d) { return d.x + 3.0 * d.y * d.z + 5.0; });
    const EnvMap result = resample(source, source.layout.projection, 32, 32, {ResampleFilter::area});
    for (std::size_t i = 0; i < source.values.size(); ++i) {
      const bool inside = std::string(projection) != "dual_paraboloid" ||
                          texel_solid_angle(source.layout.projection, 32, 32, static_cast<int>(i % 32),
                                            static_cast<int>(i / 32 % 32)) > 1e-3;
      if (!inside) continue;
      EXPECT_NEAR(result.values[i], source.values[i], 1e-4F) << projection << " texel " << i;
    }
  }
}

TEST(Resample, TurnsTheMapAsTheMatrixSays) {
  const EnvMap source = make_map("latlong", 256, 128, [](glm::dvec3 d) { return d.x; });
  // A target direction +Z looks up what the source has at +X.
  const glm::mat3 source_from_target(glm::vec3(0, 0, -1), glm::vec3(0, 1, 0), glm::vec3(1, 0, 0));
  const EnvMap result =
      resample(source, parse_projection("cube"), 8, 8, {ResampleFilter::automatic, source_from_target});
  EXPECT_NEAR(result.values[result.layout.index(0, 4, 4, 4)], 1.0F, 0.05F);
  EXPECT_NEAR(result.values[result.layout.index(0, 5, 4, 4)], -1.0F, 0.05F);
  EXPECT_THROW(resample(source, parse_projection("cube"), 8, 8, {ResampleFilter::area, glm::mat3(2.0F)}),
               InvalidArgument);
}

TEST(Resample, GivesTheSameBitsOnOneThreadAndOnTwo) {
  const EnvMap source = make_map("latlong", 200, 100, lights);
  std::vector<float> values[2];
  for (int threads : {1, 2}) {
    const ThreadLimit limit(threads);
    values[threads - 1] = resample(source, parse_projection("cube"), 77, 77).values;
  }
  EXPECT_EQ(values[0], values[1]);
}

TEST(Resample, EveryInstructionSetGivesTheSameBits) {
  for (const char* from : {"latlong", "cube", "dual_paraboloid"}) {
    const EnvMap source = make_map(from, 64, 64, lights);
    for (const char* to : {"cube", "latlong", "dual_paraboloid"}) {
      for (const int size : {20, 75}) {
        std::vector<float> values;
        {
          const IsaLimit limit(Isa::baseline);
          values = resample(source, parse_projection(to), size, size).values;
        }
        for (const Isa isa : {Isa::sse42, Isa::avx2, Isa::avx512}) {
          const IsaLimit limit(isa);
          ASSERT_EQ(resample(source, parse_projection(to), size, size).values, values)
              << from << " to " << to << ", " << to_string(isa);
        }
      }
    }
  }
}

// The loops treat three channels, four to seven, and groups of seven differently.
TEST(Resample, EveryChannelIsResampledAlike) {
  const EnvMap one = make_map("latlong", 128, 64, lights);
  for (const int channels : {2, 3, 4, 7, 9, 16}) {
    EnvMap source = make_envmap({one.layout.projection, 128, 64, 1, channels});
    for (std::size_t i = 0; i < source.values.size(); ++i) {
      source.values[i] = one.values[i / static_cast<std::size_t>(channels)];
    }
    for (const int size : {12, 40}) {
      const EnvMap expected = resample(one, parse_projection("cube"), size, size);
      const EnvMap result = resample(source, parse_projection("cube"), size, size);
      for (std::size_t i = 0; i < result.values.size(); ++i) {
        ASSERT_EQ(result.values[i], expected.values[i / static_cast<std::size_t>(channels)])
            << channels << " channels, cube of " << size;
      }
    }
  }
}

TEST(Resample, ANaNTexelStaysWhereItIs) {
  EnvMap source = make_map("latlong", 128, 64, smooth);
  source.values[source.layout.index(0, 0, 32, 64)] = std::numeric_limits<float>::quiet_NaN();
  const EnvMap result = resample(source, parse_projection("cube"), 32, 32, {ResampleFilter::area});
  const auto bad =
      std::count_if(result.values.begin(), result.values.end(), [](float v) { return std::isnan(v); });
  EXPECT_GE(bad, 1);
  EXPECT_LE(bad, 4);
}

TEST(Resample, WhatAFisheyeDoesNotSeeIsBlack) {
  const EnvMap source = make_map("fisheye:180", 64, 64, [](glm::dvec3) { return 1.0; });
  const EnvMap result = resample(source, parse_projection("cube"), 16, 16);
  EXPECT_NEAR(result.values[result.layout.index(0, 5, 8, 8)], 1.0F, 1e-6F);
  EXPECT_EQ(result.values[result.layout.index(0, 4, 8, 8)], 0.0F);
}

TEST(Resample, RejectsWhatIsNotAMap) {
  EnvMap source = make_map("latlong", 8, 4, smooth);
  EXPECT_THROW(resample(source, parse_projection("cube"), 8, 4), InvalidArgument);
  EXPECT_THROW(resample(source, parse_projection("latlong"), 0, 4), InvalidArgument);
  source.values.pop_back();
  EXPECT_THROW(resample(source, parse_projection("cube"), 8, 8), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
