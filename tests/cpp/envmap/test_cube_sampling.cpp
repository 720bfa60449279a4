#include "mirrorbake/envmap/cube_sampling.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/projection/cube.hpp"

namespace mirrorbake {
namespace {

glm::vec3 random_direction(std::uint32_t i) {
  const glm::vec2 u = sobol_2d(i, 5);
  const float z = 1.0F - 2.0F * u.x;
  const float r = std::sqrt(std::max(0.0F, 1.0F - z * z));
  const float phi = 2.0F * std::numbers::pi_v<float> * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

float lookup(const CubeFootprint& footprint, const std::vector<float>& map) {
  float value = 0;
  for (int i = 0; i < footprint.count; ++i) {
    const TexelWeight& t = footprint.texels[static_cast<std::size_t>(i)];
    value += t.weight * map[t.texel];
  }
  return value;
}

TEST(CubeSampling, WeightsSumToOneOnEveryLevel) {
  for (int size : {1, 2, 4, 64}) {
    const CubePyramidLayout layout = CubePyramidLayout::full(size);
    for (std::uint32_t i = 0; i < 2000; ++i) {
      const float lod = static_cast<float>(layout.levels) * unit_float(static_cast<std::uint32_t>(hash64(i)));
      const CubeFootprint footprint = trilinear_footprint(layout, random_direction(i), lod);
      float sum = 0;
      for (int k = 0; k < footprint.count; ++k) {
        const TexelWeight& t = footprint.texels[static_cast<std::size_t>(k)];
        EXPECT_LT(t.texel, layout.texels());
        EXPECT_GE(t.weight, 0.0F);
        sum += t.weight;
      }
      EXPECT_NEAR(sum, 1.0F, 1e-6F);
    }
  }
}

// The texel across an edge is the one whose centre is nearest among those outside of the face, and crossing back returns.
TEST(CubeSampling, TexelsAcrossEdgesAreTheNearestAndMutual) {
  for (int n : {1, 2, 3, 8}) {
    const CubePyramidLayout layout{n, 1};
    std::vector<glm::vec3> centres(layout.texels());
    const float scale = 1.0F / static_cast<float>(n);
    const auto centre = [&](int face, int row, int column) {
      return glm::normalize(direction_from_cube(face, (static_cast<float>(column) + 0.5F) * scale,
                                                (static_cast<float>(row) + 0.5F) * scale));
    };
    for (int face = 0; face < 6; ++face) {
      for (int row = 0; row < n; ++row) {
        for (int column = 0; column < n; ++column) {
          centres[layout.index(0, face, row, column)] = centre(face, row, column);
        }
      }
    }
    const std::size_t face_texels = static_cast<std::size_t>(n * n);
    for (int face = 0; face < 6; ++face) {
      for (int i = 0; i < n; ++i) {
        const int inside[4][2] = {{0, i}, {n - 1, i}, {i, 0}, {i, n - 1}};
        const int outside[4][2] = {{-1, i}, {n, i}, {i, -1}, {i, n}};
        for (int edge = 0; edge < 4; ++edge) {
          const std::size_t from = layout.index(0, face, inside[edge][0], inside[edge][1]);
          const std::size_t to = cube_texel_across_edges(layout, 0, face, outside[edge][0], outside[edge][1]);
          ASSERT_NE(to / face_texels, from / face_texels);
          float nearest = -1.0F;
          for (std::size_t t = 0; t < centres.size(); ++t) {
            if (t / face_texels != from / face_texels)
              nearest = std::max(nearest, glm::dot(centres[t], centres[from]));
          }
          // A corner texel has two equally near ones, one across each edge.
          EXPECT_NEAR(glm::dot(centres[to], centres[from]), nearest, 1e-6F);
          const int other = static_cast<int>(to / face_texels);
          const int row = static_cast<int>(to % face_texels) / n;
          const int column = static_cast<int>(to % face_texels) % n;
          int back = 0;
          for (const auto& [dr, dc] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
            const bool leaves = row + dr < 0 || row + dr >= n || column + dc < 0 || column + dc >= n;
            back += leaves && cube_texel_across_edges(layout, 0, other, row + dr, column + dc) == from;
          }
          EXPECT_EQ(back, 1);
        }
      }
    }
  }
}

// Along a great circle the filtered map has no step: a bilinear, seamless lookup is continuous, so over a step of
// angle h it changes by at most (texels per radian, at most n at a face's centre... n/2·2) · h · range, here 64 h.
TEST(CubeSampling, LookupIsContinuousAcrossEdgesAndCorners) {
  const CubePyramidLayout layout = CubePyramidLayout::full(16);
  std::vector<float> map(layout.texels());
  for (std::size_t i = 0; i < map.size(); ++i) map[i] = unit_float(static_cast<std::uint32_t>(hash64(i)));
  for (std::uint32_t k = 0; k < 40; ++k) {
    // Circles through a corner of the cube among others.
    const glm::vec3 a = k % 2 ? glm::normalize(glm::vec3(1, 1, 1)) : random_direction(k);
    const glm::vec3 b = glm::normalize(glm::cross(a, random_direction(k + 100)));
    constexpr int kSteps = 20000;
    constexpr float kStep = 2.0F * std::numbers::pi_v<float> / kSteps;
    float previous = lookup(trilinear_footprint(layout, a, 0.0F), map);
    for (int i = 1; i <= kSteps; ++i) {
      const float angle = kStep * static_cast<float>(i);
      const float value =
          lookup(trilinear_footprint(layout, std::cos(angle) * a + std::sin(angle) * b, 0.0F), map);
      ASSERT_LT(std::abs(value - previous), 64.0F * kStep) << "circle " << k << ", step " << i;
      previous = value;
    }
  }
}

// A map that holds the direction's own y component is reproduced to the curvature of that function over a texel.
TEST(CubeSampling, ReproducesASmoothFunction) {
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
    // Half a texel of 2/64 beyond an edge lies (2/64)²-close to the neighbour's plane extended; corners average three.
    EXPECT_NEAR(lookup(trilinear_footprint(layout, d, 0.0F), map), d.y, 2e-2F);
  }
}

TEST(CubeSampling, LevelOfDetailCountsTexels) {
  const CubePyramidLayout layout = CubePyramidLayout::full(256);
  // At a face's centre a texel is 2/256 of the direction's length.
  const float texel = 2.0F / 256;
  for (float texels : {1.0F, 2.0F, 4.0F, 8.0F, 64.0F}) {
    for (float length : {1e-3F, 1.0F, 1e3F}) {
      const glm::vec3 d(0, 0, -length);
      EXPECT_NEAR(cube_level_of_detail(layout, d, {texels * texel * length, 0, 0}, {0, 0, 0}),
                  std::log2(texels), 1e-5F);
      // A differential along the ray changes nothing.
      EXPECT_EQ(cube_level_of_detail(layout, d, {0, 0, length}, {0, 0, 0}), 0.0F);
    }
  }
  EXPECT_EQ(cube_level_of_detail(layout, {1, 0, 0}, {0, 0, 0}, {0, 0, 0}), 0.0F);
  EXPECT_EQ(cube_level_of_detail(layout, {1, 0, 0}, {0, 1e30F, 0}, {0, 0, 0}), 8.0F);
}

}  // namespace
}  // namespace mirrorbake
