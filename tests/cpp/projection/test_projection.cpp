#include "mirrorbake/projection/projection.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/projection/dual_paraboloid.hpp"

namespace mirrorbake {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<glm::vec3> random_directions(std::size_t count) {
  std::vector<glm::vec3> directions;
  for (std::uint32_t i = 0; i < count; ++i) {
    const glm::vec2 u = sobol_2d(i, 11);
    const double z = 1.0 - 2.0 * static_cast<double>(u.x);
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
    const double phi = 2.0 * kPi * static_cast<double>(u.y);
    directions.emplace_back(r * std::cos(phi), r * std::sin(phi), z);
  }
  return directions;
}

double angle_between(glm::dvec3 a, glm::dvec3 b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

class EveryProjection : public testing::TestWithParam<const char*> {
 protected:
  const Projection projection_ = parse_projection(GetParam());
};

// Half a unit in the last place of a coordinate is 3e-8, or 9e-8 rad where 1 is π, on two axes, and a float32
// direction is itself rounded by some 5e-8 rad. The sphere map stretches the error by 1/cos(θ/2) towards its
// singularity.
TEST_P(EveryProjection, RoundTripInFloat32IsWithin2e7Radians) {
  std::vector<glm::vec3> directions = random_directions(100000);
  for (float x : {1.0F, -1.0F, 0.0F, -0.0F}) {
    for (float y : {1.0F, -1.0F, 0.0F, -0.0F}) {
      for (float z : {1.0F, -1.0F, 0.0F, -0.0F}) {
        for (float scale : {1.0F, 1e30F, 1e-30F, 1e-40F}) {
          if (x != 0 || y != 0 || z != 0) directions.emplace_back(scale * x, scale * y, scale * z);
        }
      }
    }
  }
  std::vector<std::int32_t> faces(directions.size());
  std::vector<glm::vec2> points(directions.size());
  std::vector<glm::vec3> again(directions.size());
  EXPECT_EQ(points_from_directions(projection_, directions, faces, points), 0u);
  directions_from_points(projection_, faces, points, again);
  std::size_t compared = 0;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    EXPECT_LE(std::max(std::abs(points[i].x), std::abs(points[i].y)), 1.0F);
    const glm::dvec3 d(directions[i]);
    if (!point_from_direction(projection_, d).covered) continue;
    double tolerance = 2e-7;
    if (projection_.kind == ProjectionKind::sphere_map) {
      const double cosine = std::cos(0.5 * std::atan2(std::hypot(d.x, d.y), d.z));
      if (cosine < 1e-3) continue;
      tolerance /= cosine;
    }
    // Half a unit in the last place of the sine of latitude, by the cosine.
    if (projection_.kind == ProjectionKind::equal_area) {
      const double cosine = std::hypot(d.x, d.z) / glm::length(d);
      if (cosine < 1e-3) continue;
      tolerance /= cosine;
    }
    ++compared;
    EXPECT_LE(angle_between(d, glm::dvec3(again[i])), tolerance) << d.x << ' ' << d.y << ' ' << d.z;
  }
  EXPECT_GT(compared, 10000u);
}

TEST_P(EveryProjection, EveryTexelCentreRoundTripsToItsTexel) {
  constexpr int kWidth = 64;
  constexpr int kHeight = 64;
  for (int face = 0; face < face_count(projection_); ++face) {
    for (int row = 0; row < kHeight; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        const double x = column_center(column, kWidth);
        const double y = row_center(row, kHeight);
        const bool round = projection_.kind != ProjectionKind::cube && !is_panorama(projection_.kind);
        if (round && x * x + y * y >= 1.0) continue;
        const MapPoint point =
            point_from_direction(projection_, direction_from_point(projection_, face, x, y));
        EXPECT_EQ(point.face, face);
        EXPECT_EQ(texel_index(point.x, kWidth), column);
        EXPECT_EQ(texel_index(-point.y, kHeight), row);
        EXPECT_TRUE(point.covered);
      }
    }
  }
}

TEST_P(EveryProjection, SolidAnglesSumToWhatTheMapCovers) {
  const double whole =
      projection_.kind == ProjectionKind::fisheye
          ? 2.0 * kPi * (1.0 - std::cos(0.5 * static_cast<double>(projection_.field_of_view) * kPi / 180.0))
          : 4.0 * kPi;
  for (const auto& [width, height] :
       {std::pair{1, 1}, {2, 2}, {3, 3}, {5, 7}, {31, 31}, {64, 64}, {256, 256}}) {
    if (projection_.kind == ProjectionKind::cube && width != height) continue;
    const std::vector<double> angles = texel_solid_angles(projection_, width, height);
    const double sum = face_count(projection_) * std::accumulate(angles.begin(), angles.end(), 0.0);
    EXPECT_NEAR(sum / whole, 1.0, 2e-12) << width << " x " << height;
  }
}

// Away from the rim a texel of 2/16384 has the solid angle of its area times the density, here integrated
// with Simpson's rule in long double: the density's fourth derivative times (1/16384)⁴ is below 1e-15 of it.
TEST_P(EveryProjection, SolidAnglesKeepTheirDigitsAt16384) {
  constexpr int kSize = 16384;
  for (int column : {8191, 8192, 9000, 11000, 13500}) {
    for (int row : {8191, 7000, 4500, 4000}) {
      const double step = 1.0 / kSize;
      long double expected = 0.0L;
      constexpr long double kSimpson[3] = {1.0L / 6.0L, 4.0L / 6.0L, 1.0L / 6.0L};
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          const double x = column_center(column, kSize) + (i - 1) * step;
          const double y = row_center(row, kSize) + (j - 1) * step;
          expected +=
              kSimpson[i] * kSimpson[j] * static_cast<long double>(solid_angle_density(projection_, 0, x, y));
        }
      }
      expected *= 4.0L * static_cast<long double>(step) * static_cast<long double>(step);
      EXPECT_NEAR(texel_solid_angle(projection_, kSize, kSize, column, row) / static_cast<double>(expected),
                  1.0, 1e-12)
          << column << ' ' << row;
    }
  }
}

TEST_P(EveryProjection, JacobianIsTheDerivativeOfTheDirection) {
  constexpr double kStep = 1e-6;
  for (int face = 0; face < face_count(projection_); ++face) {
    for (double x : {-0.6, -0.1, 0.0, 1e-5, 0.33}) {
      for (double y : {-0.5, 0.0, 2e-6, 0.7}) {
        const MapJacobian j = map_jacobian(projection_, face, x, y);
        const auto at = [&](double u, double v) { return direction_from_point(projection_, face, u, v); };
        // Central differences: kStep² from the third derivative, 1e-16/kStep from rounding.
        EXPECT_LT(glm::length((at(x + kStep, y) - at(x - kStep, y)) / (2 * kStep) - j.dx), 1e-8)
            << x << ' ' << y;
        EXPECT_LT(glm::length((at(x, y + kStep) - at(x, y - kStep)) / (2 * kStep) - j.dy), 1e-8)
            << x << ' ' << y;
      }
    }
  }
}

TEST_P(EveryProjection, HostileDirectionsAreNotCoveredAndStayInsideTheMap) {
  const float inf = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float values[] = {0.0F, -0.0F, 1.0F, -1.0F, 1e30F, -3e38F, 1e-30F, 1e-45F, inf, -inf, nan};
  std::size_t unusable = 0;
  std::vector<glm::vec3> directions;
  for (float x : values) {
    for (float y : values) {
      for (float z : values) {
        directions.emplace_back(x, y, z);
        const bool finite = std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
        const bool usable = finite && (x != 0 || y != 0 || z != 0);
        if (!usable) ++unusable;
        const MapPoint point = point_from_direction(projection_, glm::dvec3(x, y, z));
        EXPECT_TRUE(usable || !point.covered);
        EXPECT_TRUE(point.face >= 0 && point.face < face_count(projection_));
        EXPECT_TRUE(std::abs(point.x) <= 1.0 && std::abs(point.y) <= 1.0) << x << ' ' << y << ' ' << z;
        for (int count : {1, 7, 16384}) {
          EXPECT_TRUE(texel_index(point.x, count) >= 0 && texel_index(point.x, count) < count);
          EXPECT_TRUE(texel_index(-point.y, count) >= 0 && texel_index(-point.y, count) < count);
        }
      }
    }
  }
  std::vector<std::int32_t> faces(directions.size());
  std::vector<glm::vec2> points(directions.size());
  EXPECT_EQ(points_from_directions(projection_, directions, faces, points), unusable);
}

INSTANTIATE_TEST_SUITE_P(Projection, EveryProjection,
                         testing::Values("cube", "dual_paraboloid", "sphere_map", "latlong", "angular",
                                         "fisheye:180", "fisheye:97.5", "equal_area"),
                         [](const auto& p) {
                           std::string name = p.param;
                           std::replace_if(
                               name.begin(), name.end(), [](char c) { return !std::isalnum(c); }, '_');
                           return name;
                         });

double density_ratio(const char* name) {
  const Projection projection = parse_projection(name);
  double smallest = std::numeric_limits<double>::infinity();
  double largest = 0.0;
  for (int i = -1000; i <= 1000; ++i) {
    for (int j = -1000; j <= 1000; j += 8) {
      const double x = i / 1000.0;
      const double y = j / 1000.0;
      if (projection.kind != ProjectionKind::cube && x * x + y * y >= 1.0) continue;
      const double density = solid_angle_density(projection, 0, x, y);
      smallest = std::min(smallest, density);
      largest = std::max(largest, density);
    }
  }
  return largest / smallest;
}

// [EMT] §2: the samples lie at most 3√3 times as dense in a cube map, 4 times in a paraboloid; a sphere map
// is even.
TEST(Projection, DensityRatiosAreThoseOfTheTutorial) {
  EXPECT_NEAR(density_ratio("cube"), 3.0 * std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(density_ratio("dual_paraboloid"), 4.0, 0.01);  // the grid ends just short of the rim
  EXPECT_NEAR(density_ratio("sphere_map"), 1.0, 1e-9);
}

TEST(Projection, ParaboloidDensityIsFourOverOnePlusR2Squared) {
  for (double x : {-0.9, 0.0, 0.4}) {
    for (double y : {-0.3, 0.0, 0.8}) {
      const double q = 1.0 + x * x + y * y;
      for (int face : {0, 1}) {
        EXPECT_NEAR(solid_angle_density({ProjectionKind::dual_paraboloid}, face, x, y), 4.0 / (q * q), 1e-14);
      }
    }
  }
}

// The antiderivative of 4/(1+x²+y²)² by corners, in long double; it cancels, hence only for a coarse texel.
TEST(Projection, ParaboloidTexelMeetsItsClosedForm) {
  const auto corner = [](long double x, long double y) {
    const long double a = std::sqrt(1.0L + x * x);
    const long double b = std::sqrt(1.0L + y * y);
    return 2.0L * (x / a * std::atan(y / a) + y / b * std::atan(x / b));
  };
  for (const auto& [column, row] : {std::pair{8, 8}, {7, 5}, {10, 4}, {3, 9}}) {
    const long double x0 = 2.0L * column / 16 - 1.0L;
    const long double y0 = 1.0L - 2.0L * (row + 1) / 16;
    const long double x1 = x0 + 0.125L;
    const long double y1 = y0 + 0.125L;
    const double expected =
        static_cast<double>(corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0));
    EXPECT_NEAR(texel_solid_angle({ProjectionKind::dual_paraboloid}, 16, 16, column, row) / expected, 1.0,
                1e-13);
  }
}

TEST(Projection, ParaboloidIsContinuousAcrossItsRim) {
  for (int i = 0; i < 360; ++i) {
    const double phi = i * kPi / 180.0;
    const MapPoint front = dual_paraboloid_from_direction({std::cos(phi), std::sin(phi), 1e-12});
    const MapPoint back = dual_paraboloid_from_direction({std::cos(phi), std::sin(phi), -1e-12});
    EXPECT_EQ(front.face, 0);
    EXPECT_EQ(back.face, 1);
    EXPECT_NEAR(front.x, back.x, 1e-11);
    EXPECT_NEAR(front.y, back.y, 1e-11);
    // Beyond the rim of one face lie the directions of the other.
    const glm::dvec3 beyond = direction_from_dual_paraboloid(0, 1.1 * front.x, 1.1 * front.y);
    const MapPoint other = dual_paraboloid_from_direction(beyond);
    EXPECT_EQ(other.face, 1);
    EXPECT_NEAR(other.x, front.x / 1.1, 1e-9);
  }
}

TEST(Projection, ParaboloidTextureMatrixGivesTheMapsTextureCoordinates) {
  const glm::mat3 rotation(glm::normalize(glm::vec3(1, 2, 2)), glm::normalize(glm::vec3(2, 1, -2)),
                           glm::normalize(glm::vec3(-2, 2, -1)));
  for (const glm::vec3& r : random_directions(1000)) {
    const MapPoint point = dual_paraboloid_from_direction(glm::dvec3(r));
    const glm::vec4 h = dual_paraboloid_texture_matrix(rotation, point.face) * glm::vec4(rotation * r, 1.0F);
    EXPECT_GT(h.w, 0.9F);
    EXPECT_NEAR(h.x / h.w, 0.5 + 0.5 * point.x, 1e-6);
    EXPECT_NEAR(h.y / h.w, 0.5 - 0.5 * point.y, 1e-6);
  }
  EXPECT_THROW(dual_paraboloid_texture_matrix(2.0F * rotation, 0), InvalidArgument);
  EXPECT_THROW(dual_paraboloid_texture_matrix(rotation, 2), InvalidArgument);
}

TEST(Projection, LatitudeLongitudeLooksAlongMinusZWithXToTheRightAndYUp) {
  const Projection p = parse_projection("latlong");
  EXPECT_EQ(direction_from_point(p, 0, 0, 0), glm::dvec3(0, 0, -1));
  EXPECT_LT(glm::length(direction_from_point(p, 0, 0.5, 0) - glm::dvec3(1, 0, 0)), 1e-15);
  EXPECT_LT(glm::length(direction_from_point(p, 0, 0.3, 1) - glm::dvec3(0, 1, 0)), 1e-15);
}

// Hall's map as [WP] has it: longitude against the sine of latitude.
TEST(Projection, EqualAreaHasTheSineOfLatitudeForHeightAndGoesOnOverThePoles) {
  const Projection map = parse_projection("equal_area");
  const MapPoint up = point_from_direction(map, {std::sqrt(0.75), 0.5, 0.0});
  EXPECT_NEAR(up.x, 0.5, 1e-15);
  EXPECT_NEAR(up.y, 0.5, 1e-15);
  EXPECT_EQ(texel_solid_angle(map, 8, 4, 0, 0), texel_solid_angle(map, 8, 4, 5, 2));
  for (const double y : {1.0, -1.0}) {
    const glm::dvec3 beyond = direction_from_point(map, 0, 0.2, 1.25 * y);
    EXPECT_LT(angle_between(beyond, direction_from_point(map, 0, -0.8, 0.75 * y)), 1e-15);
  }
}

TEST(Projection, SphereMapShowsTheReflectionInABall) {
  // n = (0.6, 0, 0.8), v₀ = +Z: r = 2·0.8·n − v₀ = (0.96, 0, 0.28).
  const Projection p = parse_projection("sphere_map");
  EXPECT_LT(glm::length(direction_from_point(p, 0, 0.6, 0.0) - glm::dvec3(0.96, 0, 0.28)), 1e-15);
  EXPECT_EQ(direction_from_point(p, 0, 1.0, 0.0), glm::dvec3(0, 0, -1));
  const MapPoint singular = point_from_direction(p, {0, 0, -5});
  EXPECT_TRUE(singular.covered);
  EXPECT_EQ(singular.x, 1.0);
  EXPECT_EQ(singular.y, 0.0);
}

TEST(Projection, FisheyeSaysWhatItDoesNotCover) {
  const Projection omnimax = parse_projection("fisheye:180");
  EXPECT_TRUE(point_from_direction(omnimax, {1, 0, -0.01}).covered);
  EXPECT_TRUE(point_from_direction(omnimax, {0, 1, 0}).covered);
  const MapPoint behind = point_from_direction(omnimax, {1, 0, 1});
  EXPECT_FALSE(behind.covered);
  EXPECT_EQ(behind.x, 1.0);
}

TEST(Projection, TheListIsInTheOrderOfTheKinds) {
  EXPECT_EQ(parse_projection("cube").kind, ProjectionKind::cube);
  EXPECT_EQ(parse_projection("dual_paraboloid").kind, ProjectionKind::dual_paraboloid);
  EXPECT_EQ(parse_projection("sphere_map").kind, ProjectionKind::sphere_map);
  EXPECT_EQ(parse_projection("latlong").kind, ProjectionKind::latlong);
  EXPECT_EQ(parse_projection("angular").kind, ProjectionKind::angular);
  EXPECT_EQ(parse_projection("fisheye").kind, ProjectionKind::fisheye);
  EXPECT_EQ(parse_projection("equal_area").kind, ProjectionKind::equal_area);
  EXPECT_EQ(projection_names(),
            "cube, dual_paraboloid, sphere_map, latlong, angular, fisheye, fisheye:DEGREES, equal_area");
}

TEST(Projection, NamesRoundTripAndBadOnesAreNamed) {
  for (const char* name :
       {"cube", "dual_paraboloid", "sphere_map", "latlong", "angular", "fisheye:97.5", "equal_area"}) {
    EXPECT_EQ(to_string(parse_projection(name)), name);
  }
  for (const char* bad :
       {"", "globe", "cube:90", "fisheye:", "fisheye:0", "fisheye:361", "fisheye:nan", "fisheye:1x"}) {
    EXPECT_THROW(parse_projection(bad), InvalidArgument) << bad;
  }
}

TEST(Projection, BatchesRejectWhatIsNotThere) {
  const Projection cube = parse_projection("cube");
  const std::vector<std::int32_t> faces = {6};
  std::vector<glm::vec2> points = {{0, 0}};
  std::vector<glm::vec3> directions(1);
  EXPECT_THROW(directions_from_points(cube, faces, points, directions), InvalidArgument);
  const std::vector<std::int32_t> face = {0};
  points[0].x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(directions_from_points(cube, face, points, directions), InvalidArgument);
  EXPECT_THROW(texel_solid_angles(cube, 0, 4), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
