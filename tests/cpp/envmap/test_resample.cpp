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
#include "mirrorbake/envmap/texel_lookup.hpp"

namespace mirrorbake {
namespace {

constexpr const char* kProjections[] = {"cube",    "dual_paraboloid", "sphere_map", "latlong",
                                        "angular", "fisheye:360",     "equal_area"};

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
                                           {parse_name<ResampleFilter>(filter)});
            for (const float v : result.values) {
              ASSERT_NEAR(v, 0.7F, 1e-6F) << from << " to " << to << ", " << filter << ", " << target_size;
            }
          }
        }
      }
    }
  }
}

// Every texel against the mean of 160² places of it, weighted by solid angle, each reading the source's texel
// it lies in. It is the reference that is inexact: its error falls with the number of places, 0.05 with 32²
// of them.
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
      // The rim of a one-piece map is a single direction, around which a texel's edges are not straight in
      // such a map.
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

// Bilinear interpolation misses a smooth function by its curvature over a texel, h²/8 of about 1, with h =
// 1/16 rad; around a pole or beyond a rim the source's texels are further apart.
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

// It is in the boxes of texels that it has no part in, too.
TEST(Resample, ATexelThatIsNotFiniteStaysWhereItIs) {
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    for (const int channels : {1, 3, 5}) {
      EnvMap source = make_envmap({parse_projection("latlong"), 128, 64, 1, channels});
      std::fill(source.values.begin(), source.values.end(), 1.0F);
      const std::size_t at = source.layout.index(0, 0, 20, 64);
      std::fill_n(source.values.begin() + static_cast<std::ptrdiff_t>(at), channels, value);
      const EnvMap result = resample(source, parse_projection("cube"), 32, 32, {ResampleFilter::area});
      const auto bad = std::count_if(result.values.begin(), result.values.end(),
                                     [](float v) { return !std::isfinite(v); });
      EXPECT_GE(bad, channels);
      EXPECT_LE(bad, 4 * channels);
    }
  }
}

// Every texel of a face against the mean of interpolations at 24² places, with solid angles where the filter
// has the mean ones of rows: over a texel they change by some 0.04, of which a hundredth of the steps between
// texels remains.
TEST(Resample, MagnificationIsTheMeanOfInterpolation) {
  constexpr int kSize = 40;
  constexpr int kPlaces = 24;
  const EnvMap source =
      make_map("latlong", 64, 32, [](glm::dvec3 d) { return 2.0 + std::sin(40.0 * d.x + 30.0 * d.y * d.z); });
  const Projection cube = parse_projection("cube");
  const EnvMap result = resample(source, cube, kSize, kSize);
  for (int row = 0; row < kSize; ++row) {
    for (int column = 0; column < kSize; ++column) {
      double sum = 0.0;
      double weight = 0.0;
      for (int i = 0; i < kPlaces * kPlaces; ++i) {
        const double x = column_center(column * kPlaces + i % kPlaces, kSize * kPlaces);
        const double y = row_center(row * kPlaces + i / kPlaces, kSize * kPlaces);
        const MapPoint p =
            point_from_direction(source.layout.projection, direction_from_point(cube, 0, x, y));
        double value = 0.0;
        interpolate(source, 0, 0, 32.0 * (p.x + 1.0), 16.0 * (1.0 - p.y), {&value, 1});
        const double w = std::pow(1.0 + x * x + y * y, -1.5);
        sum += w * value;
        weight += w;
      }
      ASSERT_NEAR(result.values[result.layout.index(0, 0, row, column)], sum / weight, 5e-3)
          << "row " << row << ", column " << column;
    }
  }
}

// Their edges are far from straight in the source: traced, they miss a hundredth of a texel of it.
TEST(Resample, MapsOfFewTexelsKeepTheFluxOfLights) {
  const EnvMap source = make_map("latlong", 512, 256, lights);
  for (const char* to : {"cube", "dual_paraboloid", "sphere_map", "latlong", "angular"}) {
    for (const int size : {1, 2, 3, 4, 8, 12}) {
      const EnvMap result = resample(source, parse_projection(to), size, size);
      EXPECT_NEAR(integrate(result)[0] / integrate(source)[0], 1.0, 1e-3) << to << " of " << size;
    }
  }
}

// A turn by 1e-6 leaves no symmetries, and the values where they are up to that.
TEST(Resample, SymmetriesChangeNothing) {
  const float angle = 1e-6F;
  const glm::mat3 turn(glm::vec3(1, angle, -angle), glm::vec3(-angle, 1, angle), glm::vec3(angle, -angle, 1));
  const auto lopsided = [](glm::dvec3 d) {
    return 3.0 + d.x + 0.7 * d.y - 0.4 * d.z + std::sin(9.0 * d.x + 7.0 * d.y);
  };
  for (const char* from : kProjections) {
    for (const int size : {24, 25}) {
      const EnvMap source = make_map(from, size, size, lopsided);
      for (const char* to : kProjections) {
        for (const ResampleFilter filter : {ResampleFilter::area, ResampleFilter::bilinear}) {
          for (const int target_size : {13, 44}) {
            // The centre of a texel of 13 looks exactly at the rim of such maps.
            const bool singular = std::string(from) != "cube" && std::string(from) != "latlong";
            if (singular && target_size == 13 && filter == ResampleFilter::bilinear) continue;
            const Projection target = parse_projection(to);
            const EnvMap straight = resample(source, target, target_size, target_size, {filter});
            const EnvMap turned = resample(source, target, target_size, target_size, {filter, turn});
            const std::vector<double> angles = texel_solid_angles(target, target_size, target_size);
            double difference = 0.0;
            for (std::size_t i = 0; i < straight.values.size(); ++i) {
              difference += angles[i % angles.size()] *
                            std::abs(static_cast<double>(straight.values[i] - turned.values[i]));
            }
            // On the average over the sphere: at rims a turn of any size may take another texel.
            EXPECT_LT(difference / (4.0 * std::numbers::pi), 5e-3)
                << from << " of " << size << " to " << to << " of " << target_size;
          }
        }
      }
    }
  }
}

// Every texel looks up the direction it had: what symmetries do to rows, columns and faces is what they do to
// directions. The bound is a bit more than half the diagonal of a texel; those of sphere maps are long.
TEST(Resample, EveryTexelFindsItsDirection) {
  for (const char* from : kProjections) {
    const double half_diagonal = std::string(from) == "sphere_map" ? 0.25 : 0.1;
    for (const int size : {40, 41}) {
      std::vector<EnvMap> sources;
      const int width = std::string(from) == "latlong" ? 2 * size : size;
      for (int axis = 0; axis < 3; ++axis) {
        sources.push_back(make_map(from, width, size, [&](glm::dvec3 d) { return d[axis]; }));
      }
      for (const char* to : {"cube", "dual_paraboloid", "latlong", "angular"}) {
        const Projection target = parse_projection(to);
        EnvMap results[3];
        for (int axis = 0; axis < 3; ++axis)
          results[axis] = resample(sources[static_cast<std::size_t>(axis)], target, 36, 36);
        for (int face = 0; face < face_count(target); ++face) {
          for (int row = 0; row < 36; ++row) {
            for (int column = 0; column < 36; ++column) {
              const double x = column_center(column, 36);
              const double y = row_center(row, 36);
              // Around the singular points of maps texels are long.
              if (target.kind != ProjectionKind::cube && x * x + y * y > 0.8) continue;
              const glm::dvec3 d = direction_from_point(target, face, x, y);
              if (std::abs(d.y) > 0.9 || std::abs(d.z) > 0.9) continue;
              const std::size_t i = results[0].layout.index(0, face, row, column);
              const glm::dvec3 found(results[0].values[i], results[1].values[i], results[2].values[i]);
              ASSERT_LT(glm::length(found - d), half_diagonal)
                  << from << " to " << to << " face " << face << " row " << row << " column " << column;
            }
          }
        }
      }
    }
  }
}

TEST(Resample, AResamplerGivesTheSameBitsWhateverItKeeps) {
  const EnvMap source = make_map("latlong", 96, 48, lights);
  const Projection cube = parse_projection("cube");
  const EnvMap expected = resample(source, cube, 33, 33);
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{5000}, std::size_t{1} << 30}) {
    const Resampler resampler(source.layout, cube, 33, 33, {}, bytes);
    EXPECT_LE(resampler.bytes(), bytes);
    EXPECT_EQ(resampler.apply(source).values, expected.values) << bytes;
    EXPECT_EQ(resampler.apply(source).values, expected.values) << "again, " << bytes;
  }
  const Resampler resampler(source.layout, cube, 33, 33);
  EXPECT_GT(resampler.bytes(), 10000U);
  const EnvMap other = make_map("latlong", 98, 49, lights);
  EXPECT_THROW(resampler.apply(other), InvalidArgument);
  std::vector<float> small(10);
  EXPECT_THROW(resampler.apply(source, small), InvalidArgument);
}

// Texels of more taps than are kept in memory: the mean is the flux over 4π.
TEST(Resample, ATexelOfTheWholeSphereIsItsMean) {
  const EnvMap source = make_map("latlong", 2048, 1024, lights);
  const double mean = integrate(source)[0] / (4.0 * std::numbers::pi);
  const EnvMap whole = resample(source, parse_projection("latlong"), 1, 1);
  EXPECT_NEAR(whole.values[0] / mean, 1.0, 1e-6);
  const EnvMap cube = resample(source, parse_projection("cube"), 1, 1);
  EXPECT_NEAR(integrate(cube)[0] / (4.0 * std::numbers::pi) / mean, 1.0, 1e-3);
}

// Interpolation, too: it is integrated over the texel. Maps of about as many texels; the coarse ones of the
// test data in test_envmap.py are harder.
TEST(Resample, AutomaticKeepsTheFluxOfLights) {
  const EnvMap source = make_map("latlong", 512, 256, lights);
  const std::pair<const char*, int> targets[] = {
      {"cube", 209}, {"dual_paraboloid", 362}, {"sphere_map", 512}, {"angular", 512}, {"cube", 400}};
  for (const auto& [to, size] : targets) {
    const EnvMap result = resample(source, parse_projection(to), size, size);
    EXPECT_NEAR(integrate(result)[0] / integrate(source)[0], 1.0, 1e-3) << to << " of " << size;
    const EnvMap back = resample(result, parse_projection("latlong"), 512, 256);
    EXPECT_NEAR(integrate(back)[0] / integrate(result)[0], 1.0, 1e-3) << to << " of " << size << " and back";
  }
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
