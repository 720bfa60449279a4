#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <vector>
#include <glm/geometric.hpp>

#include "mesh_checks.hpp"
#include "mirrorbake/scene/shapes.hpp"

namespace mirrorbake {
namespace {

using testing::area_vector;
using testing::boundary_loops;
using testing::directed_edges;
using testing::weld;
using testing::WeldedMesh;

constexpr int kSubdivisions = 25;
constexpr std::size_t kPoles =
    8;  // patches with an edge that is a point: four in the knob, four in the bottom

TEST(Teapot, HasTheFortyThousandTrianglesOfThePaper) {
  const TriangleMesh mesh = make_teapot();
  EXPECT_EQ(mesh.triangles.size(), 40'000U);
  EXPECT_EQ(mesh.positions.size(), 32U * 26U * 26U);
  EXPECT_EQ(std::count(mesh.parts.begin(), mesh.parts.end(), 0), 24 * 1250);
  EXPECT_EQ(std::count(mesh.parts.begin(), mesh.parts.end(), 1), 8 * 1250);
  EXPECT_EQ(teapot_part_names(), (std::vector<std::string>{"body", "lid"}));
}

TEST(Teapot, IsAValidReflector) {
  Scene scene;
  scene.materials.emplace_back();
  scene.objects.push_back({"teapot", make_teapot(), 0, teapot_part_names()});
  EXPECT_NO_THROW(validate(scene));
}

TEST(Teapot, StandsOnTheGroundWithItsAxisUpAndItsSpoutAlongX) {
  const Bounds box = bounds(make_teapot(kSubdivisions, 3.15F));  // in the units of the data
  EXPECT_FLOAT_EQ(box.min.y, 0.0F);
  EXPECT_FLOAT_EQ(box.max.y, 3.15F);
  EXPECT_FLOAT_EQ(box.max.z, 2.0F);
  EXPECT_FLOAT_EQ(box.min.z, -2.0F);
  EXPECT_FLOAT_EQ(box.min.x, -3.0F);        // the handle's outermost control points, on the surface at v = 1
  EXPECT_NEAR(box.max.x, 3.43413F, 1e-3F);  // the lip of the spout, below its control point 3.525
}

TEST(Teapot, OnlyTheTrianglesAtThePolesAreDegenerate) {
  const TriangleMesh mesh = make_teapot();
  const WeldedMesh welded = weld(mesh);
  EXPECT_EQ(welded.collapsed, kPoles * kSubdivisions);
  for (const glm::uvec3 t : mesh.triangles) {
    const glm::vec3 a = mesh.positions[t.x];
    const glm::vec3 b = mesh.positions[t.y];
    if (a == b) {
      EXPECT_TRUE(a.x == 0.0F && a.z == 0.0F);
    } else {
      EXPECT_GT(glm::length(area_vector(mesh, t)), 1e-9);
    }
  }
}

TEST(Teapot, NormalsAreFiniteUnitVectorsOnTheOutsideOfEveryTriangle) {
  for (int subdivisions : {1, 2, 3, 25, 100}) {
    const TriangleMesh mesh = make_teapot(subdivisions);
    for (const glm::vec3 n : mesh.normals) ASSERT_NEAR(glm::length(n), 1.0F, 1e-6F);
    if (subdivisions < 25) continue;  // coarser facets may turn away from the surface
    for (const glm::uvec3 t : mesh.triangles) {
      const glm::dvec3 facet = area_vector(mesh, t);
      for (int k = 0; k < 3; ++k) ASSERT_GE(glm::dot(facet, glm::dvec3(mesh.normals[t[k]])), 0.0);
    }
  }
}

TEST(Teapot, NormalsAtThePolesAreVertical) {
  const TriangleMesh mesh = make_teapot();
  int tip = 0;
  int bottom = 0;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (mesh.positions[i].x != 0.0F || mesh.positions[i].z != 0.0F) continue;
    if (mesh.positions[i].y == 0.0F) {
      EXPECT_NEAR(mesh.normals[i].y, -1.0F, 1e-7F);
      ++bottom;
    } else {
      EXPECT_FLOAT_EQ(mesh.positions[i].y, 0.15F);
      EXPECT_NEAR(mesh.normals[i].y, 1.0F, 1e-7F);
      ++tip;
    }
  }
  EXPECT_EQ(tip, 4 * 26);
  EXPECT_EQ(bottom, 4 * 26);
}

// Facets of a sixteen times finer mesh around a vertex tilt to both sides of its true normal: their mean
// converges to it.
TEST(Teapot, NormalsAreThoseOfTheSurface) {
  constexpr int kCoarse = 8;
  constexpr int kFine = 128;
  const TriangleMesh coarse = make_teapot(kCoarse);
  const TriangleMesh fine = make_teapot(kFine);
  const std::size_t fine_side = kFine + 1;
  std::vector<glm::dvec3> facet_sum(fine.positions.size(), glm::dvec3(0.0));
  for (const glm::uvec3 t : fine.triangles) {
    for (int k = 0; k < 3; ++k) facet_sum[t[k]] += area_vector(fine, t);
  }
  double largest = 0.0;
  int compared = 0;
  for (std::size_t patch = 0; patch < 32; ++patch) {
    for (std::size_t j = 1; j < kCoarse; ++j) {  // inner vertices only: seams see one side
      for (std::size_t i = 1; i < kCoarse; ++i) {
        const std::size_t c = (patch * (kCoarse + 1) + j) * (kCoarse + 1) + i;
        const std::size_t f = (patch * fine_side + j * 16) * fine_side + i * 16;
        ASSERT_EQ(coarse.positions[c], fine.positions[f]);
        const glm::dvec3 expected = glm::normalize(facet_sum[f]);
        largest = std::max(largest, glm::length(expected - glm::dvec3(coarse.normals[c])));
        ++compared;
      }
    }
  }
  EXPECT_EQ(compared, 32 * 49);
  EXPECT_LT(largest, 4e-3);  // radians; first order in the cell size of 1/128 where cells are uneven
}

TEST(Teapot, IsMirrorSymmetricToTheLastBit) {
  const TriangleMesh mesh = make_teapot();
  std::set<std::tuple<float, float, float>> points;
  for (const glm::vec3 p : mesh.positions) points.insert({p.x, p.y, p.z});
  for (const glm::vec3 p : mesh.positions) EXPECT_TRUE(points.contains({p.x, p.y, -p.z}));
}

// Patches join without cracks: welded by exact equality, every edge has one neighbour, of opposite direction,
// but for the six rims that are open in the classic data.
TEST(Teapot, PatchesJoinWithoutCracksAndOpenOnlyAtTheSixKnownRims) {
  const TriangleMesh mesh = make_teapot();
  const WeldedMesh welded = weld(mesh);
  for (const auto& [edge, count] : directed_edges(welded)) {
    ASSERT_EQ(count, 1) << "an edge is used twice in the same direction: orientations differ";
  }
  std::map<unsigned, unsigned> next = boundary_loops(welded);
  std::vector<std::size_t> lengths;
  while (!next.empty()) {
    const unsigned start = next.begin()->first;
    std::size_t length = 0;
    for (unsigned v = start; next.contains(v); ++length) {
      const unsigned to = next[v];
      next.erase(v);
      v = to;
    }
    lengths.push_back(length);
  }
  std::sort(lengths.begin(), lengths.end());
  // Two ends of the handle and two of the spout (two patches around), inner edge of the rim and edge of the
  // lid (four).
  EXPECT_EQ(lengths, (std::vector<std::size_t>{50, 50, 50, 50, 100, 100}));
}

// With its open rims capped, each of the four pieces (pot, lid, handle, spout) encloses a positive volume: as
// neighbouring triangles agree in orientation, all of them face outwards.
TEST(Teapot, EveryPieceFacesOutwards) {
  const WeldedMesh welded = weld(make_teapot());
  // Triangles that share an edge belong together (a vertex is not enough: the handle touches the pot in one).
  std::vector<std::size_t> parent(welded.triangles.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](std::size_t t) {
    while (parent[t] != t) t = parent[t] = parent[parent[t]];
    return t;
  };
  std::map<std::pair<unsigned, unsigned>, std::size_t> triangle_of_edge;
  for (std::size_t i = 0; i < welded.triangles.size(); ++i) {
    const glm::uvec3 t = welded.triangles[i];
    for (int k = 0; k < 3; ++k) {
      triangle_of_edge[{t[k], t[(k + 1) % 3]}] = i;
      const auto neighbour = triangle_of_edge.find({t[(k + 1) % 3], t[k]});
      if (neighbour != triangle_of_edge.end()) parent[root(i)] = root(neighbour->second);
    }
  }
  std::map<std::size_t, std::vector<std::array<glm::dvec3, 3>>> pieces;
  const auto point = [&](unsigned v) { return glm::dvec3(welded.positions[v]); };
  for (std::size_t i = 0; i < welded.triangles.size(); ++i) {
    const glm::uvec3 t = welded.triangles[i];
    pieces[root(i)].push_back({point(t.x), point(t.y), point(t.z)});
  }
  std::map<unsigned, unsigned> next = boundary_loops(welded);
  while (!next.empty()) {
    const unsigned start = next.begin()->first;
    for (unsigned v = start; next.contains(v);) {
      const unsigned to = next[v];
      next.erase(v);
      pieces[root(triangle_of_edge.at({v, to}))].push_back({point(to), point(v), point(start)});
      v = to;
    }
  }
  EXPECT_EQ(pieces.size(), 4U);
  for (const auto& [piece, triangles] : pieces) EXPECT_GT(testing::signed_volume(triangles), 1e-6);
}

TEST(Teapot, TextureAtlasHasNoOverlaps) {
  const TriangleMesh mesh = make_teapot(3);
  std::set<std::pair<int, int>> cells;
  double area = 0.0;
  for (std::size_t patch = 0; patch < 32; ++patch) {
    std::set<std::pair<int, int>> cells_of_patch;
    for (std::size_t i = 0; i < 16; ++i) {
      const glm::vec2 uv = mesh.uvs[16 * patch + i];
      ASSERT_TRUE(uv.x > 0.0F && uv.x < 1.0F && uv.y > 0.0F && uv.y < 1.0F);
      cells_of_patch.insert({static_cast<int>(uv.x * 4.0F), static_cast<int>(uv.y * 8.0F)});
    }
    EXPECT_EQ(cells_of_patch.size(), 1U);
    EXPECT_TRUE(cells.insert(*cells_of_patch.begin()).second);
  }
  for (const glm::uvec3 t : mesh.triangles) {
    const glm::dvec2 a = glm::dvec2(mesh.uvs[t.y]) - glm::dvec2(mesh.uvs[t.x]);
    const glm::dvec2 b = glm::dvec2(mesh.uvs[t.z]) - glm::dvec2(mesh.uvs[t.x]);
    area += 0.5 * (a.x * b.y - a.y * b.x);
  }
  EXPECT_NEAR(area, std::pow(30.0 / 32.0, 2), 1e-6);  // 1/32 of each cell is margin on each side
}

}  // namespace
}  // namespace mirrorbake
