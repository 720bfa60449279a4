#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/proxy/fit.hpp"

namespace mirrorbake {
namespace {

std::vector<glm::vec3> cloud(int count, std::uint32_t seed, glm::vec3 scale, glm::vec3 centre) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<glm::vec3> points;
  for (int i = 0; i < count; ++i) {
    points.push_back(centre + scale * glm::vec3(normal(random), normal(random), normal(random)));
  }
  return points;
}

double largest_gauge(const Ellipsoid& e, std::span<const glm::vec3> points) {
  double largest = 0;
  for (const glm::vec3& p : points) {
    largest = std::max(largest, glm::length((glm::dvec3(p) - glm::dvec3(e.centre)) / glm::dvec3(e.radii)));
  }
  return largest;
}

double volume(const Ellipsoid& e) {
  return static_cast<double>(e.radii.x) * static_cast<double>(e.radii.y) * static_cast<double>(e.radii.z);
}

TEST(AreaWeightedCentroid, OfATetrahedronsFacesIsTheirMean) {
  // A cube's corner cut off: three right triangles of area ½ and one of area √3/2.
  const std::vector<glm::vec3> p = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<glm::uvec3> t = {{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}};
  const double area = 1.5 + std::sqrt(3.0) / 2;
  const double expected = (0.5 / 3 + 0.5 / 3 + 0.0 + std::sqrt(3.0) / 2 / 3) / area;
  const glm::vec3 centroid = area_weighted_centroid(p, t);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(centroid[i], expected, 1e-7);
}

TEST(AreaWeightedCentroid, DoesNotDependOnTheTessellation) {
  // A rectangle in two halves, one cut into many slivers.
  std::vector<glm::vec3> p = {{0, 0, 0}, {4, 0, 0}, {4, 0, 2}, {0, 0, 2}};
  std::vector<glm::uvec3> t = {{0, 1, 2}};
  for (unsigned i = 0; i < 100; ++i) {
    const float s = static_cast<float>(i) / 99;
    p.push_back({4 * s, 0, 2 * s});
    if (i > 0) t.push_back({3, 3 + i, 4 + i});
  }
  const glm::vec3 centroid = area_weighted_centroid(p, t);
  EXPECT_NEAR(centroid.x, 2, 1e-6);
  EXPECT_NEAR(centroid.y, 0, 1e-6);
  EXPECT_NEAR(centroid.z, 1, 1e-6);
}

TEST(AreaWeightedCentroid, RejectsMeshesWithoutArea) {
  const std::vector<glm::vec3> p = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  EXPECT_THROW(area_weighted_centroid(p, std::vector<glm::uvec3>{{0, 1, 2}}), InvalidArgument);
  EXPECT_THROW(area_weighted_centroid(p, std::vector<glm::uvec3>{}), InvalidArgument);
  EXPECT_THROW(area_weighted_centroid(p, std::vector<glm::uvec3>{{0, 1, 3}}), InvalidArgument);
  EXPECT_THROW(area_weighted_centroid({}, std::vector<glm::uvec3>{}), InvalidArgument);
}

// Closed forms: the smallest ellipsoid around a box's corners has √3 times its half extents (by symmetry
// under scaling each axis it is that of the cube), around the ends of the axes exactly the half extents.
TEST(FitEllipsoid, KnowsTheAnswersForBoxesAndCrosses) {
  const glm::vec3 centre(3, -1, 0.5F);
  const glm::vec3 half(2, 0.25F, 30);
  std::vector<glm::vec3> corners, ends;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(centre + half * glm::vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  }
  for (int axis = 0; axis < 3; ++axis) {
    glm::vec3 d(0.0F);
    d[axis] = half[axis];
    ends.push_back(centre + d);
  }
  const Ellipsoid of_corners = fit_ellipsoid(corners, centre);
  const Ellipsoid of_ends = fit_ellipsoid(ends, centre);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(of_corners.radii[axis] / (std::sqrt(3.0F) * half[axis]), 1, 1e-6);
    EXPECT_NEAR(of_ends.radii[axis] / half[axis], 1, 1e-6);
  }
}

// Weak duality gives a bound that no ellipsoid can beat: for any weights u ≥ 0 of the points with Σu = 1, the
// volume is at least Π_i (3 Σ_j u_j d_ji²)^½. Multiplicative updates of u (Titterington 1976) converge
// slowly, but need not converge to prove the fit: 1e-6 is the excess that may remain, of which the radii's
// rounding up takes 4e-7.
TEST(FitEllipsoid, IsWithinOneMillionthOfTheDualBound) {
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    const glm::vec3 centre(0.1F, 0.2F, -0.3F);
    const auto points = cloud(300, seed, {1.0F, seed % 2 ? 0.3F : 5.0F, seed % 3 ? 1.0F : 0.001F}, {0, 0, 0});
    const Ellipsoid e = fit_ellipsoid(points, centre);
    EXPECT_LE(largest_gauge(e, points), 1.0);
    std::vector<double> u(points.size(), 1.0 / static_cast<double>(points.size()));
    double bound = 0;
    for (int step = 0; step < 200000; ++step) {
      glm::dvec3 moment(0.0);
      for (std::size_t j = 0; j < points.size(); ++j) {
        const glm::dvec3 d = glm::dvec3(points[j]) - glm::dvec3(centre);
        moment += u[j] * d * d;
      }
      bound = std::sqrt(27.0 * moment.x * moment.y * moment.z);
      double worst = 0;
      for (std::size_t j = 0; j < points.size(); ++j) {
        if (u[j] == 0) continue;
        const glm::dvec3 d = glm::dvec3(points[j]) - glm::dvec3(centre);
        const double leverage = glm::dot(d * d / moment, glm::dvec3(1.0)) / 3.0;
        worst = std::max(worst, leverage);
        u[j] *= leverage;
        if (u[j] < 1e-14) u[j] = 0;
      }
      if (worst < 1 + 1e-9) break;
    }
    EXPECT_LT(volume(e), bound * (1 + 1e-6)) << "seed " << seed;
    EXPECT_GE(volume(e), bound * (1 - 1e-9)) << "seed " << seed;
  }
}

TEST(FitEllipsoid, EnclosesEveryVertexAsStoredInFloat) {
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> exponent(-4, 6);
    const glm::vec3 scale(std::pow(10.0F, exponent(random)));
    const auto points = cloud(1000, seed, scale, scale * 3.0F);
    const Ellipsoid e = fit_ellipsoid(points, scale * 2.5F);
    const double gauge = largest_gauge(e, points);
    EXPECT_LE(gauge, 1.0);
    EXPECT_GT(gauge, 1.0 - 3e-7);  // rounding up, not slack
  }
}

TEST(FitEllipsoid, GivesFlatInputTheDocumentedThickness) {
  const std::vector<glm::vec3> line = {{-2, 0, 0}, {2, 0, 0}};
  const Ellipsoid e = fit_ellipsoid(line, {0, 0, 0});
  EXPECT_NEAR(e.radii.x, 2, 1e-6);
  EXPECT_NEAR(e.radii.y, 2 * kMinExtentRatio, 1e-9);
  EXPECT_NEAR(e.radii.z, 2 * kMinExtentRatio, 1e-9);
  const std::vector<glm::vec3> square = {{1, 0, 1}, {-1, 0, 1}, {1, 0, -1}, {-1, 0, -1}};
  const Ellipsoid disc = fit_ellipsoid(square, {0, 0, 0});
  EXPECT_NEAR(disc.radii.x, std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(disc.radii.y, kMinExtentRatio, 1e-9);
  EXPECT_NEAR(disc.radii.z, std::sqrt(2.0), 1e-6);
}

TEST(FitEllipsoid, RejectsWhatHasNoAnswer) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(fit_ellipsoid({}, {0, 0, 0}), InvalidArgument);
  EXPECT_THROW(fit_ellipsoid(std::vector<glm::vec3>{{1, 1, 1}}, {1, 1, 1}), InvalidArgument);
  EXPECT_THROW(fit_ellipsoid(std::vector<glm::vec3>{{1, nan, 1}}, {0, 0, 0}), InvalidArgument);
  EXPECT_THROW(fit_ellipsoid(std::vector<glm::vec3>{{1, 1, 1}}, {nan, 0, 0}), InvalidArgument);
}

/// Hits on the inside of a box as rays from `origin` in random directions see them.
std::vector<glm::vec3> box_hits(glm::vec3 low, glm::vec3 high, glm::vec3 origin, int count,
                                std::uint32_t seed) {
  const Proxy proxy{Box{0.5F * (low + high), 0.5F * (high - low)}, origin};
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<glm::vec3> hits;
  for (int i = 0; i < count; ++i) {
    hits.push_back(
        origin + lookup_direction(proxy, origin, glm::vec3(normal(random), normal(random), normal(random))));
  }
  return hits;
}

TEST(FitBoxMeanDistance, AveragesEachSideAndKeepsTheFloor) {
  const std::vector<glm::vec3> hits = {{2, 0, 0},  {4, 1, 0},     {-1, 0, 0.5F}, {0, 5, 1},
                                       {1, 7, -2}, {0, -0.9F, 0}, {0, 0, 3},     {0.5F, 0, -6}};
  const Box box = fit_box_mean_distance(hits, {0, 0, 0}, -0.5F);
  EXPECT_EQ(box.centre - box.half_extent, glm::vec3(-1, -0.5F, -6));
  EXPECT_EQ(box.centre + box.half_extent, glm::vec3(3, 6, 3));
}

TEST(FitBoxMeanDistance, PlacesSidesWithoutHitsLikeTheirOpposites) {
  const std::vector<glm::vec3> hits = {{2, 0, 0}, {0, 4, 0}};
  const Box box = fit_box_mean_distance(hits, {0, 0, 0}, -1);
  EXPECT_EQ(box.centre - box.half_extent, glm::vec3(-2, -1, -3));  // z: the mean of 2, 4
  EXPECT_EQ(box.centre + box.half_extent, glm::vec3(2, 4, 3));
}

TEST(FitBoxMeanDistance, RejectsAnOriginBelowTheFloor) {
  const std::vector<glm::vec3> hits = {{2, 0, 0}};
  EXPECT_THROW(fit_box_mean_distance(hits, {0, 0, 0}, 0), InvalidArgument);
  EXPECT_THROW(fit_box_mean_distance({}, {0, 0, 0}, -1), InvalidArgument);
  EXPECT_THROW(fit_box_mean_distance(std::vector<glm::vec3>{{0, 0, 0}}, {0, 0, 0}, -1), InvalidArgument);
}

TEST(FitBoxRobust, FindsTheRoom) {
  const glm::vec3 low(-3, -0.8F, -2), high(4, 2.5F, 6);
  const Box box = fit_box_robust(box_hits(low, high, {0.2F, 0, 0.3F}, 4000, 7), {0.2F, 0, 0.3F});
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(box.centre[axis] - box.half_extent[axis], low[axis], 1e-4);
    EXPECT_NEAR(box.centre[axis] + box.half_extent[axis], high[axis], 1e-4);
  }
}

// As many hits on every side: those on floor and ceiling of a flat room lie before all of its far walls.
TEST(FitBoxRobust, FindsFlatRooms) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  for (float flat : {0.3F, 0.03F, 0.003F}) {
    const glm::vec3 half(3.0F, 3.0F * flat, 2.0F);
    std::vector<glm::vec3> hits;
    for (int i = 0; i < 3000; ++i) {
      glm::vec3 place(uniform(random), uniform(random), uniform(random));
      place[i % 3] = i % 2 == 0 ? -1.0F : 1.0F;
      hits.push_back(place * half);
    }
    const Box box = fit_box_robust(hits, {0, 0, 0});
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(box.centre[axis], 0.0F, 1e-4F * half[axis]) << flat;
      EXPECT_NEAR(box.half_extent[axis], half[axis], 1e-4F * half[axis]) << flat;
    }
  }
}

// A third of the rays end on furniture, one in ten far away behind a window. The mean-distance box is off by
// decimetres; the robust one by at most centimetres, its threshold (1 % of the mean distance) times the odds
// of outliers.
TEST(FitBoxRobust, IgnoresFurnitureAndWindows) {
  const glm::vec3 low(-3, -0.8F, -2), high(4, 2.5F, 6);
  auto hits = box_hits(low, high, {0, 0, 0}, 4000, 8);
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(0.3F, 0.9F);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (i % 3 == 0) hits[i] *= uniform(random);
    if (i % 10 == 1 && hits[i].x > 3.9F) hits[i] *= 10.0F;
  }
  const Box box = fit_box_robust(hits, {0, 0, 0});
  const Box mean = fit_box_mean_distance(hits, {0, 0, 0}, -0.8F);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(box.centre[axis] - box.half_extent[axis], low[axis], 0.05) << axis;
    EXPECT_NEAR(box.centre[axis] + box.half_extent[axis], high[axis], 0.05) << axis;
  }
  EXPECT_GT(std::abs(mean.centre.z + mean.half_extent.z - high.z), 0.2F);
}

}  // namespace
}  // namespace mirrorbake
