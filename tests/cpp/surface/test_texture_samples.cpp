#include "mirrorbake/surface/texture_samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace {

// The lower left half of the texture, and a small triangle at its top right that lies on its back.
struct Mesh {
  std::vector<glm::vec3> positions{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 1}, {5, 6, 1}, {6, 6, 1}};
  std::vector<glm::vec2> uvs{{0, 0}, {1, 0}, {0, 1}, {0.75F, 0.75F}, {0.75F, 1}, {1, 1}};
  std::vector<glm::uvec3> triangles{{0, 1, 2}, {3, 4, 5}};

  SurfaceSamples samples(int size, int per_side) const {
    return texture_samples(positions, triangles, uvs, size, per_side);
  }
};

TEST(TextureSamples, ArePointsOfTheSurfaceAtTheirCoordinates) {
  const Mesh mesh;
  const SurfaceSamples samples = mesh.samples(8, 4);
  ASSERT_GT(samples.size(), 0U);
  EXPECT_EQ(samples.width, 8);
  EXPECT_EQ(samples.samples_per_pixel, 16);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const glm::uvec3 t = mesh.triangles[samples.triangle[i]];
    const glm::vec2 b = samples.barycentric[i];
    const float rest = 1.0F - b.x - b.y;
    EXPECT_GE(std::min({b.x, b.y, rest}), -1e-6F);
    const glm::vec2 uv = rest * mesh.uvs[t.x] + b.x * mesh.uvs[t.y] + b.y * mesh.uvs[t.z];
    EXPECT_NEAR(samples.reflection[i].x, uv.x, 1e-6);
    EXPECT_NEAR(samples.reflection[i].y, 1.0F - uv.y, 1e-6);
    const glm::vec3 p = rest * mesh.positions[t.x] + b.x * mesh.positions[t.y] + b.y * mesh.positions[t.z];
    EXPECT_LT(glm::distance(p, samples.position[i]), 1e-5F);
    const auto column = static_cast<std::uint32_t>(8.0F * uv.x);
    const auto row = static_cast<std::uint32_t>(8.0F * (1.0F - uv.y));
    EXPECT_EQ(samples.pixel[i], 8 * row + column);
  }
}

TEST(TextureSamples, AreOrderedByTexel) {
  const SurfaceSamples samples = Mesh{}.samples(8, 4);
  EXPECT_TRUE(std::is_sorted(samples.pixel.begin(), samples.pixel.end()));
}

TEST(TextureSamples, AreAsManyAsTheirTrianglesCover) {
  const Mesh mesh;
  const SurfaceSamples samples = mesh.samples(64, 4);
  std::vector<std::size_t> count(2, 0);
  for (const std::uint32_t triangle : samples.triangle) ++count[triangle];
  const double places = 256.0 * 256.0;
  EXPECT_NEAR(static_cast<double>(count[0]) / places, 0.5, 0.003);
  EXPECT_NEAR(static_cast<double>(count[1]) / places, 1.0 / 32.0, 0.001);
}

TEST(TextureSamples, OfPlacesOnSeveralTrianglesAreTheFirstOnes) {
  Mesh mesh;
  mesh.triangles.push_back({0, 1, 2});
  for (const std::uint32_t triangle : mesh.samples(16, 2).triangle) EXPECT_LT(triangle, 2U);
}

TEST(TextureSamples, LeaveOutWhatLiesBeyondTheTextureOrHasNoArea) {
  Mesh mesh;
  const float far = std::numeric_limits<float>::max();
  mesh.uvs = {{0.5F, 0.5F}, {0.5F, 0.5F}, {1, 1}, {2, 2}, {far, 2}, {2, far}};
  EXPECT_EQ(mesh.samples(8, 1).size(), 0U);
  // One that is larger than the texture covers all of it.
  mesh.uvs = {{-far, -far}, {far, -far}, {0, far}, {2, 2}, {3, 2}, {2, 3}};
  EXPECT_EQ(mesh.samples(8, 1).size(), 64U);
}

TEST(TextureSamples, SizesLengthsAndNumbersAreChecked) {
  Mesh mesh;
  EXPECT_THROW(mesh.samples(0, 2), InvalidArgument);
  EXPECT_THROW(mesh.samples(4097, 2), InvalidArgument);
  EXPECT_THROW(mesh.samples(8, 9), InvalidArgument);
  mesh.uvs[1].y = std::nanf("");
  EXPECT_THROW(mesh.samples(8, 2), InvalidArgument);
  mesh.uvs.pop_back();
  EXPECT_THROW(mesh.samples(8, 2), InvalidArgument);
  mesh = Mesh{};
  mesh.triangles[1].z = 6;
  EXPECT_THROW(mesh.samples(8, 2), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
