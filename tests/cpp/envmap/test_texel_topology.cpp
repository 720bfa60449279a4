#include "mirrorbake/envmap/texel_topology.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/projection/cube.hpp"

namespace mirrorbake {
namespace {

std::vector<TexelTopology> all_kinds() {
  return {TexelTopology::cube(8), TexelTopology::dual_paraboloid(8), TexelTopology::atlas(16, 4)};
}

TEST(TexelTopology, PlacesAndNumbersAreInverse) {
  for (const TexelTopology& topology : all_kinds()) {
    for (std::uint32_t texel = 0; texel < topology.texels(); ++texel) {
      ASSERT_EQ(topology.index(topology.place(texel)), texel);
    }
  }
}

// A regulariser's matrix is symmetric only if this holds.
TEST(TexelTopology, NeighboursAreMutualAndChildrenKnowTheirParent) {
  for (const TexelTopology& topology : all_kinds()) {
    for (std::uint32_t texel = 0; texel < topology.texels(); ++texel) {
      for (const std::uint32_t neighbour : topology.neighbours(texel)) {
        if (neighbour == kNoTexel) continue;
        const auto back = topology.neighbours(neighbour);
        ASSERT_NE(std::find(back.begin(), back.end(), texel), back.end());
      }
      for (const std::uint32_t child : topology.children(texel)) {
        if (child != kNoTexel) {
          ASSERT_EQ(topology.parent(child), texel);
        }
      }
      const std::uint32_t parent = topology.parent(texel);
      if (parent == kNoTexel) continue;
      const auto siblings = topology.children(parent);
      ASSERT_NE(std::find(siblings.begin(), siblings.end(), texel), siblings.end());
    }
  }
}

TEST(TexelTopology, SolidAnglesOfALevelCoverTheSphere) {
  for (const TexelTopology& topology : all_kinds()) {
    const double whole = topology.kind() == TopologyKind::atlas ? 1.0 : 4.0 * std::numbers::pi;
    for (int level = 0; level < topology.levels(); ++level) {
      double sum = 0.0;
      for (std::size_t i = topology.level_offset(level); i < topology.level_offset(level + 1); ++i) {
        sum += topology.solid_angle(static_cast<std::uint32_t>(i));
      }
      EXPECT_NEAR(sum, whole, 1e-9);
    }
  }
}

TEST(TexelTopology, RefusesSidesThatAreNoPowerOfTwo) {
  EXPECT_THROW(TexelTopology::cube(12), InvalidArgument);
  EXPECT_THROW(TexelTopology::dual_paraboloid(0), InvalidArgument);
  EXPECT_THROW(TexelTopology::atlas(8, 32768), InvalidArgument);
}

// The texel across an edge is the one whose centre is nearest among those outside of the face, and crossing
// back returns.
TEST(Reads, TexelsAcrossEdgesAreTheNearestAndMutual) {
  for (int n : {1, 2, 4, 8}) {
    const TexelTopology layout = TexelTopology::cube(n);
    std::vector<glm::vec3> centres(layout.level_offset(1));
    const float scale = 1.0F / static_cast<float>(n);
    const auto centre = [&](int face, int row, int column) {
      return glm::normalize(direction_from_cube(face, (static_cast<float>(column) + 0.5F) * scale,
                                                (static_cast<float>(row) + 0.5F) * scale));
    };
    for (int face = 0; face < 6; ++face) {
      for (int row = 0; row < n; ++row) {
        for (int column = 0; column < n; ++column) {
          centres[layout.index({0, face, row, column})] = centre(face, row, column);
        }
      }
    }
    const std::size_t face_texels = static_cast<std::size_t>(n * n);
    for (int face = 0; face < 6; ++face) {
      for (int i = 0; i < n; ++i) {
        const int inside[4][2] = {{0, i}, {n - 1, i}, {i, 0}, {i, n - 1}};
        const int outside[4][2] = {{-1, i}, {n, i}, {i, -1}, {i, n}};
        for (int edge = 0; edge < 4; ++edge) {
          const std::size_t from = layout.index({0, face, inside[edge][0], inside[edge][1]});
          const std::size_t to = layout.texel_at({0, face, outside[edge][0], outside[edge][1]});
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
            back += leaves && layout.texel_at({0, other, row + dr, column + dc}) == from;
          }
          EXPECT_EQ(back, 1);
        }
      }
    }
  }
}

}  // namespace
}  // namespace mirrorbake
