#include "mirrorbake/surface/vertex_lookups.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace {

// Two triangles of a mesh, the second without area, and one sample on each.
struct Mesh {
  std::vector<glm::vec3> positions{{0, 0, 0}, {2, 0, 0}, {0, 0, -4}, {1, 1, 1}, {2, 2, 2}};
  std::vector<glm::uvec3> triangles{{0, 1, 2}, {0, 3, 4}};
};

SurfaceSamples two_samples() {
  SurfaceSamples s;
  s.width = s.height = s.samples_per_pixel = 1;
  s.pixel = {0, 0};
  s.part = {0, 0};
  s.triangle = {0, 1};
  s.barycentric = {{0.25F, 0.5F}, {0.5F, 0.25F}};
  s.position = {{0.5F, 0, -2}, {1, 1, 1}};
  s.normal = s.reflection = {{0, 1, 0}, {0, 1, 0}};
  s.dposition_dx = {{0.5F, 0, 0}, {1, 1, 1}};
  s.dposition_dy = {{-0.5F, 0, 1}, {0, 1, 0}};
  s.dreflection_dx = s.dreflection_dy = {{9, 9, 9}, {9, 9, 9}};
  s.fresnel = {{1, 1, 1}, {1, 1, 1}};
  return s;
}

// A lookup that is linear in the position is what interpolation gives, and so is its change per pixel.
TEST(VertexLookups, AreALinearFunctionOfThePosition) {
  const Mesh mesh;
  const auto linear = [](glm::vec3 p) { return glm::vec3(0.5F * p.x + p.z, p.x - 0.25F * p.z, 3.0F); };
  std::vector<glm::vec3> lookups;
  for (const glm::vec3& p : mesh.positions) lookups.push_back(linear(p));
  const SurfaceSamples samples = two_samples();
  const SurfaceSamples read = with_vertex_lookups(samples, mesh.positions, mesh.triangles, lookups);
  const glm::vec3 zero = linear(glm::vec3(0.0F));
  EXPECT_EQ(read.reflection[0], linear(samples.position[0]));
  EXPECT_EQ(read.dreflection_dx[0], linear(samples.dposition_dx[0]) - zero);
  EXPECT_EQ(read.dreflection_dy[0], linear(samples.dposition_dy[0]) - zero);
  EXPECT_EQ(read.position[0], samples.position[0]);
}

TEST(VertexLookups, DoNotChangeAlongATriangleWithoutArea) {
  const Mesh mesh;
  const std::vector<glm::vec3> lookups{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}};
  const SurfaceSamples read = with_vertex_lookups(two_samples(), mesh.positions, mesh.triangles, lookups);
  EXPECT_EQ(read.reflection[1], glm::vec3(1.0F, 0.75F, 0.0F));
  EXPECT_EQ(read.dreflection_dx[1], glm::vec3(0.0F));
  EXPECT_EQ(read.dreflection_dy[1], glm::vec3(0.0F));
}

TEST(VertexLookups, LengthsAndIndicesAreChecked) {
  Mesh mesh;
  const std::vector<glm::vec3> lookups(mesh.positions.size());
  const std::vector<glm::vec3> few(2);
  EXPECT_THROW(with_vertex_lookups(two_samples(), mesh.positions, mesh.triangles, few), InvalidArgument);
  SurfaceSamples beyond = two_samples();
  beyond.triangle[1] = 2;
  EXPECT_THROW(with_vertex_lookups(beyond, mesh.positions, mesh.triangles, lookups), InvalidArgument);
  mesh.triangles[0].z = 5;
  EXPECT_THROW(with_vertex_lookups(two_samples(), mesh.positions, mesh.triangles, lookups), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
