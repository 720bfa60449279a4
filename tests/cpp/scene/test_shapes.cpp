#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <glm/geometric.hpp>

#include "mesh_checks.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/shapes.hpp"

namespace mirrorbake {
namespace {

using testing::area_vector;
using testing::boundary_loops;
using testing::directed_edges;
using testing::total_area;
using testing::weld;
using testing::WeldedMesh;

constexpr double kPi = std::numbers::pi;

double volume(const TriangleMesh& mesh) {
  std::vector<std::array<glm::dvec3, 3>> triangles;
  for (const glm::uvec3 t : mesh.triangles) {
    triangles.push_back(
        {glm::dvec3(mesh.positions[t.x]), glm::dvec3(mesh.positions[t.y]), glm::dvec3(mesh.positions[t.z])});
  }
  return testing::signed_volume(triangles);
}

struct Solid {
  const char* name;
  TriangleMesh mesh;
  double volume;  // closed form
  double area;    // closed form
};

std::vector<Solid> solids() {
  const glm::vec3 c(0.3F, -0.2F, 0.5F);
  const double slant = std::hypot(0.5, 1.5);
  return {
      {"box", make_box({-1, 0, 2}, {1, 3, 2.5F}), 2 * 3 * 0.5, 2 * (2 * 3 + 3 * 0.5 + 2 * 0.5)},
      {"sphere", make_sphere(c, 0.5F, 512), kPi / 6, kPi},
      {"cylinder", make_cylinder(c, 0.5F, 1.5F, 512), kPi * 0.25 * 1.5, 2 * kPi * 0.25 + kPi * 1.5},
      {"cone", make_cone(c, 0.5F, 1.5F, 512), kPi * 0.25 * 0.5, kPi * 0.25 + kPi * 0.5 * slant},
      {"torus", make_torus(c, 1.0F, 0.25F, 512), 2 * kPi * kPi * 0.0625, 4 * kPi * kPi * 0.25},
  };
}

TEST(Shapes, SolidsHaveTheVolumeAndAreaOfTheirFormulas) {
  // A regular n-gon has (2π/n)²/6 less area than its circle: 2.5e-5 at 512 segments, 1e-4 at the torus' 256.
  constexpr double kTessellation = 2e-4;
  for (const Solid& solid : solids()) {
    EXPECT_NEAR(volume(solid.mesh) / solid.volume, 1.0, kTessellation) << solid.name;
    EXPECT_NEAR(total_area(solid.mesh) / solid.area, 1.0, kTessellation) << solid.name;
  }
}

TEST(Shapes, SolidsAreClosedAndHaveNoDegenerateTriangle) {
  for (const Solid& solid : solids()) {
    const WeldedMesh welded = weld(solid.mesh);
    EXPECT_EQ(welded.collapsed, 0U) << solid.name;
    EXPECT_TRUE(boundary_loops(welded).empty()) << solid.name;
    for (const auto& [edge, count] : directed_edges(welded)) EXPECT_EQ(count, 1) << solid.name;
  }
}

TEST(Shapes, NormalsAreUnitAndOnTheOutsideOfTheirTriangles) {
  std::vector<Solid> all = solids();
  for (int segments : {3, 4, 5, 48}) {
    all.push_back({"sphere", make_sphere({1, 2, 3}, 2.0F, segments), 0, 0});
    all.push_back({"cylinder", make_cylinder({1, 2, 3}, 2.0F, 1.0F, segments), 0, 0});
    all.push_back({"cone", make_cone({1, 2, 3}, 2.0F, 1.0F, segments), 0, 0});
    all.push_back({"torus", make_torus({1, 2, 3}, 2.0F, 1.0F, segments), 0, 0});
  }
  for (const Solid& solid : all) {
    ASSERT_EQ(solid.mesh.normals.size(), solid.mesh.positions.size());
    ASSERT_EQ(solid.mesh.uvs.size(), solid.mesh.positions.size());
    for (const glm::vec3 n : solid.mesh.normals) EXPECT_NEAR(glm::length(n), 1.0F, 1e-6F) << solid.name;
    for (const glm::uvec3 t : solid.mesh.triangles) {
      const glm::dvec3 mean = glm::dvec3(solid.mesh.normals[t.x]) + glm::dvec3(solid.mesh.normals[t.y]) +
                              glm::dvec3(solid.mesh.normals[t.z]);
      EXPECT_GT(glm::dot(mean, area_vector(solid.mesh, t)), 0.0) << solid.name;
    }
  }
}

TEST(Shapes, RectangleFacesUCrossVAndCarriesTheUnitSquare) {
  const TriangleMesh mesh = make_rectangle({1, 1, 1}, {2, 0, 0}, {0, 0, -3});
  const std::vector<glm::vec3> corners = {{1, 1, 1}, {3, 1, 1}, {3, 1, -2}, {1, 1, -2}};
  const std::vector<glm::vec2> uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  EXPECT_EQ(mesh.positions, corners);
  EXPECT_EQ(mesh.uvs, uvs);
  for (const glm::vec3 n : mesh.normals) EXPECT_EQ(n, glm::vec3(0, 1, 0));
  for (const glm::uvec3 t : mesh.triangles) EXPECT_GT(area_vector(mesh, t).y, 0.0);
  EXPECT_DOUBLE_EQ(total_area(mesh), 6.0);
}

// A texture seen from outside is not mirrored: (u, v) is right-handed about the outward normal.
TEST(Shapes, TexturesAreNotMirrored) {
  std::vector<Solid> all = solids();
  all.push_back({"teapot", make_teapot(4), 0, 0});
  for (const Solid& solid : all) {
    for (const glm::uvec3 t : solid.mesh.triangles) {
      const glm::vec2 a = solid.mesh.uvs[t.y] - solid.mesh.uvs[t.x];
      const glm::vec2 b = solid.mesh.uvs[t.z] - solid.mesh.uvs[t.x];
      EXPECT_GT(a.x * b.y - a.y * b.x, 0.0F) << solid.name;
    }
  }
}

TEST(Shapes, BadArgumentsAreRejectedByName) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(make_box({0, 0, 0}, {1, 0, 1}), InvalidArgument);
  EXPECT_THROW(make_box({nan, 0, 0}, {1, 1, 1}), InvalidArgument);
  EXPECT_THROW(make_sphere({0, 0, 0}, 0.0F), InvalidArgument);
  EXPECT_THROW(make_sphere({0, 0, 0}, 1.0F, 2), InvalidArgument);
  EXPECT_THROW(make_cylinder({0, 0, 0}, 1.0F, nan), InvalidArgument);
  EXPECT_THROW(make_cone({0, 0, nan}, 1.0F, 1.0F), InvalidArgument);
  EXPECT_THROW(make_torus({0, 0, 0}, 1.0F, 1.0F), InvalidArgument);
  EXPECT_THROW(make_rectangle({0, 0, 0}, {1, 0, 0}, {2, 0, 0}), InvalidArgument);
  EXPECT_THROW(make_teapot(0), InvalidArgument);
  EXPECT_THROW(make_teapot(513), InvalidArgument);
  EXPECT_THROW(make_teapot(25, -1.0F), InvalidArgument);
  EXPECT_THROW(make_teapot(25, nan), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
