#include "mirrorbake/proxy/hull.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace {

struct Mesh {
  std::vector<glm::vec3> positions;
  std::vector<glm::uvec3> triangles;
};

/// A torus about the y axis, or, with `ring` 0, a sphere.
Mesh torus(float ring, float tube, unsigned segments, unsigned rings) {
  Mesh mesh;
  constexpr float kTwoPi = 2 * std::numbers::pi_v<float>;
  for (unsigned i = 0; i < segments; ++i) {
    for (unsigned j = 0; j < rings; ++j) {
      const float u = kTwoPi * static_cast<float>(i) / static_cast<float>(segments);
      const float v = kTwoPi * static_cast<float>(j) / static_cast<float>(rings);
      const float r = ring + tube * std::cos(v);
      mesh.positions.push_back({r * std::cos(u), tube * std::sin(v), -r * std::sin(u)});
    }
  }
  for (unsigned i = 0; i < segments; ++i) {
    for (unsigned j = 0; j < rings; ++j) {
      const unsigned i1 = (i + 1) % segments;
      const unsigned j1 = (j + 1) % rings;
      mesh.triangles.push_back({i * rings + j, i1 * rings + j, i1 * rings + j1});
      mesh.triangles.push_back({i * rings + j, i1 * rings + j1, i * rings + j1});
    }
  }
  return mesh;
}

// Outside of the top and bottom circles (x² + z² > ring²) a torus is its own convex hull, inside it is the
// dent.
TEST(HullTriangles, AreTheOuterHalfOfATorus) {
  const Mesh mesh = torus(1.0F, 0.4F, 90, 60);
  const auto on_hull = hull_triangles(mesh.positions, mesh.triangles);
  int inside = 0;
  int outside = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3 t = mesh.triangles[i];
    const glm::vec3 c = (mesh.positions[t.x] + mesh.positions[t.y] + mesh.positions[t.z]) / 3.0F;
    const float r = std::hypot(c.x, c.z);
    // A facet at the very top leans either way within half a step of the tessellation, 0.4·π/60.
    if (r > 1.03F) {
      EXPECT_EQ(on_hull[i], 1) << r;
      ++outside;
    }
    if (r < 0.97F) {
      EXPECT_EQ(on_hull[i], 0) << r;
      ++inside;
    }
  }
  EXPECT_GT(inside, 4000);
  EXPECT_GT(outside, 4000);
}

TEST(HullTriangles, AreAllOfAConvexSolidDespiteFloatVertices) {
  // An icosphere-like solid far from the origin, where vertices are rounded coarsely.
  Mesh mesh;
  for (unsigned i = 0; i <= 100; ++i) {
    for (unsigned j = 0; j < 200; ++j) {
      const double theta = std::numbers::pi * i / 100;
      const double phi = 2 * std::numbers::pi * j / 200;
      mesh.positions.emplace_back(5 + 0.1 * std::sin(theta) * std::cos(phi), 3 + 0.1 * std::cos(theta),
                                  0.1 * std::sin(theta) * std::sin(phi));
    }
  }
  for (unsigned i = 0; i < 100; ++i) {
    for (unsigned j = 0; j < 200; ++j) {
      const unsigned j1 = (j + 1) % 200;
      if (i > 0) mesh.triangles.push_back({i * 200 + j, i * 200 + j1, (i + 1) * 200 + j1});
      if (i < 99) mesh.triangles.push_back({i * 200 + j, (i + 1) * 200 + j1, (i + 1) * 200 + j});
    }
  }
  std::size_t count = 0;
  for (std::uint8_t on : hull_triangles(mesh.positions, mesh.triangles)) count += on;
  // Next to the poles triangles are slivers of 1e-4 m whose planes the rounding (2.4e-7 m) turns by
  // milliradians.
  EXPECT_GT(count, mesh.triangles.size() - 250);
}

TEST(HullTriangles, OfADentedBoxAreItsOuterFaces) {
  // A pyramid pushed into the top of a cube: four dent faces see each other.
  const std::vector<glm::vec3> p = {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1},         {0, 1, 0},
                                    {1, 1, 0}, {1, 1, 1}, {0, 1, 1}, {0.5F, 0.5F, 0.5F}};
  const std::vector<glm::uvec3> t = {{0, 1, 2}, {0, 2, 3}, {0, 5, 1}, {0, 4, 5}, {1, 6, 2},
                                     {1, 5, 6}, {2, 7, 3}, {2, 6, 7}, {3, 4, 0}, {3, 7, 4},
                                     {4, 8, 5}, {5, 8, 6}, {6, 8, 7}, {7, 8, 4}};
  const std::vector<std::uint8_t> expected = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0};
  EXPECT_EQ(hull_triangles(p, t), expected);
}

TEST(HullTriangles, ForgiveDentsWithinTheTolerance) {
  std::vector<glm::vec3> p = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {1, 0, 1}};
  const std::vector<glm::uvec3> t = {{0, 2, 1}, {1, 2, 3}};  // both face +Y
  p[3].y = 0.01F;
  EXPECT_EQ(hull_triangles(p, t), (std::vector<std::uint8_t>{0, 0}));
  EXPECT_EQ(hull_triangles(p, t, 0.02), (std::vector<std::uint8_t>{1, 1}));
}

TEST(HullTriangles, OfATorusAreThoseWithNoVertexInFront) {
  const Mesh mesh = torus(0.5F, 0.2F, 40, 30);
  constexpr double kTolerance = 1e-3;
  glm::vec3 low = mesh.positions[0];
  glm::vec3 high = low;
  for (const glm::vec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const double slack = kTolerance * static_cast<double>(glm::length(high - low));
  const std::vector<std::uint8_t> on_hull = hull_triangles(mesh.positions, mesh.triangles, kTolerance);
  std::size_t count = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3 t = mesh.triangles[i];
    const glm::dvec3 a(mesh.positions[t.x]);
    const glm::dvec3 n =
        glm::normalize(glm::cross(glm::dvec3(mesh.positions[t.y]) - a, glm::dvec3(mesh.positions[t.z]) - a));
    double farthest = 0;
    for (const glm::vec3& p : mesh.positions) farthest = std::max(farthest, glm::dot(n, glm::dvec3(p) - a));
    // At the limit itself rounding decides.
    if (std::abs(farthest - slack) > 1e-9) {
      EXPECT_EQ(on_hull[i] != 0, farthest < slack) << i;
    }
    count += on_hull[i];
  }
  EXPECT_GT(count, mesh.triangles.size() / 4);
  EXPECT_LT(count, 3 * mesh.triangles.size() / 4);
}

TEST(HullTriangles, RejectBadInput) {
  std::vector<glm::vec3> p = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  EXPECT_THROW(hull_triangles(p, std::vector<glm::uvec3>{{0, 1, 3}}), InvalidArgument);
  EXPECT_THROW(hull_triangles(p, std::vector<glm::uvec3>{{0, 1, 2}}, -1), InvalidArgument);
  EXPECT_TRUE(hull_triangles(p, {}).empty());
  EXPECT_EQ(hull_triangles(p, std::vector<glm::uvec3>{{0, 1, 1}}), (std::vector<std::uint8_t>{0}));
  p[0].x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(hull_triangles(p, std::vector<glm::uvec3>{{0, 1, 2}}), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
