#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include "mesh_checks.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/load.hpp"
#include "temporary_files.hpp"

namespace mirrorbake {
namespace {

using ::testing::HasSubstr;
using Obj = testing::FileTest;

constexpr const char* kCube =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 4 1 5 8\n";

TEST_F(Obj, ReadsFacesOfEveryNotation) {
  const std::string path =
      write("a.obj",
            "# comment\nmtllib missing.mtl\r\no thing\nv 0 0 0 1.0\nv 2 0 0\nv 0 2 0\nv 0 0 2\n"
            "vt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 5\nusemtl nothing\n"
            "f 1/1/1 2/2/1 3/3/1\nf 1//1 2//1 4//1\nf -4/1 -3/2 -1/3\nf 2 3 4\nl 1 2\np 1");
  const TriangleMesh mesh = load_mesh(path);
  ASSERT_EQ(mesh.triangles.size(), 4U);
  ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
  ASSERT_EQ(mesh.uvs.size(), mesh.positions.size());
  const glm::uvec3 first = mesh.triangles[0];
  EXPECT_EQ(mesh.positions[first.y], glm::vec3(2, 0, 0));
  EXPECT_EQ(mesh.uvs[first.y], glm::vec2(1, 0));
  EXPECT_EQ(mesh.normals[first.y], glm::vec3(0, 0, 1));  // normalised
  EXPECT_EQ(mesh.positions[mesh.triangles[2].z], glm::vec3(0, 0, 2));
}

TEST_F(Obj, MakesMissingNormalsByAngleWeightedAveraging) {
  // Whatever the triangulation, the three right angles at a cube's corner give the diagonal; area weights
  // would not.
  const TriangleMesh mesh = load_mesh(write("cube.obj", kCube));
  EXPECT_EQ(mesh.positions.size(), 8U);
  EXPECT_EQ(mesh.triangles.size(), 12U);
  for (std::size_t i = 0; i < 8; ++i) {
    const glm::vec3 expected = glm::normalize(mesh.positions[i] - glm::vec3(0.5F));
    EXPECT_LT(glm::length(mesh.normals[i] - expected), 1e-6F);
  }
}

TEST_F(Obj, SplitVerticesAtOnePlaceShareTheirNormal) {
  // The same two triangles of a bent sheet, once with shared corners, once with all of them split.
  const TriangleMesh shared =
      load_mesh(write("shared.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 1\nf 1 2 3\nf 1 3 4\n"));
  const TriangleMesh split = load_mesh(
      write("split.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv 0 1 0\nv -1 0 1\nf 1 2 3\nf 4 5 6\n"));
  ASSERT_EQ(shared.positions.size(), 4U);
  ASSERT_EQ(split.positions.size(), 6U);
  for (int t = 0; t < 2; ++t) {
    for (int k = 0; k < 3; ++k) {
      const std::size_t i = static_cast<std::size_t>(t);
      EXPECT_LT(glm::length(shared.normals[shared.triangles[i][k]] - split.normals[split.triangles[i][k]]),
                1e-6F);
    }
  }
}

TEST_F(Obj, TriangulatesConcavePolygonsWithoutOverlap) {
  // An arrowhead with four corners and a comb with twelve; both have known areas and lie in the plane z = 0.
  const std::string arrow = "v 0 0 0\nv 2 -1 0\nv 1 0 0\nv 2 1 0\nf 1 2 3 4\nf 4 3 2 1\n";
  const std::string comb =
      "v 0 0 0\nv 5 0 0\nv 5 3 0\nv 4 3 0\nv 4 1 0\nv 3 1 0\nv 3 3 0\nv 2 3 0\nv 2 1 0\nv 1 1 0\nv 1 3 0\nv "
      "0 3 0\n"
      "f 1 2 3 4 5 6 7 8 9 10 11 12\n";
  double z = 0.0;
  const TriangleMesh a = load_mesh(write("arrow.obj", arrow));
  EXPECT_NEAR(testing::total_area(a), 2 * 1.0, 1e-12);
  for (const glm::uvec3 t : a.triangles) z += testing::area_vector(a, t).z;
  EXPECT_NEAR(z, 0.0, 1e-12);
  const TriangleMesh b = load_mesh(write("comb.obj", comb));
  EXPECT_EQ(b.triangles.size(), 10U);
  EXPECT_NEAR(testing::total_area(b), 5 + 3 * 2, 1e-12);
  for (const glm::uvec3 t : b.triangles) EXPECT_GT(testing::area_vector(b, t).z, 0.0);
}

TEST_F(Obj, DropsDegenerateTrianglesAndUnusedVertices) {
  const TriangleMesh mesh =
      load_mesh(write("a.obj", "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 2 3 4\nf 2 3 5\nf 2 2 3\n"));
  EXPECT_EQ(mesh.triangles.size(), 1U);
  EXPECT_EQ(mesh.positions.size(), 3U);
  EXPECT_EQ(bounds(mesh).max, glm::vec3(1, 1, 0));
}

TEST_F(Obj, EveryDefectIsAFileErrorThatSaysWhatIsWrong) {
  struct Defect {
    std::string text, expected;
  };
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const std::vector<Defect> defects = {
      {"", "has no triangles"},
      {triangle, "has no triangles"},
      {"\x7f\x45\x4c\x46 binary", "has no triangles"},
      {"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "no triangle with an area"},
      {triangle + "v nan 0 0\nf 1 2 3\n", "line 4 has 'nan'"},
      {triangle + "v 1 inf 0\nf 1 2 4\n", "line 4 has 'inf'"},
      {triangle + "v 1 1e999 0\nf 1 2 4\n", "line 4 has '1e999'"},
      {triangle + "vt 0 1e39\nf 1/1 2/1 3/1\n", "line 4 has '1e39', expected a finite float32"},
      {triangle + "\r\nv 1 abc 0\r\nf 1 2 4\n", "line 5 has 'abc'"},
      {triangle + "v 1 2\nf 1 2 4\n", "line 4 has 2 numbers"},
      {triangle + "vn 0 1\nf 1 2 3\n", "line 4 has 2 numbers"},
      {triangle + "v 1 1e30 0\nf 1 2 4\n", "expected finite coordinates"},
      {triangle + "f 1 2 4\n", "face 1 has the vertex index 4, 3 are defined"},
      {triangle + "f 1 2 0\n", "face 1 has the vertex index 0"},
      {triangle + "f 1 2 -4\n", "face 1 has the vertex index -4"},
      {triangle + "f 1 2 3\nf 1 x 3\n", "line 5 has 'x'"},
      {triangle + "f 1 2\n", "has no triangles"},
      {triangle + "f 1/1/1/1 2 3\n", "line 4 has '1/1/1/1'"},
      {triangle + "f 1/1 2/1 3/1\n", "texture coordinate index 1, 0 are defined"},
      {triangle + "f 1//1 2//1 3//1\n", "normal index 1, 0 are defined"},
      {triangle + "f 1 2 99999999999999999999\n", "line 4 has '99999999999999999999'"},
  };
  for (const Defect& defect : defects) {
    const std::string path = write("defect.obj", defect.text);
    try {
      load_mesh(path);
      ADD_FAILURE() << "accepted: " << defect.text;
    } catch (const FileError& error) {
      EXPECT_THAT(error.what(), HasSubstr(path));
      EXPECT_THAT(error.what(), HasSubstr(defect.expected)) << defect.text;
    }
  }
}

TEST_F(Obj, ReadsLinesAsOtherProgramsWriteThem) {
  const std::string vertices = "v 0 0 0\nv 1 0 0 # corner\nv 1 1 0\nv 0 1 1e-400\nvt 0 0\n";
  const std::vector<std::string> quads = {
      "f 1 2 3 4 # quad\n",    "f 1 2 \\\n 3 4\n",    "f 1 2 \\\r\n 3 \\ \n4", "f 1/ 2/ 3/ 4/\n",
      "f 1/1/ 2/1/ 3/1/ 4/1/", "f 1// 2// 3// 4//\n", "\tf\t1  2\t3 4 \r\n"};
  for (const std::string& quad : quads) {
    const TriangleMesh mesh = load_mesh(write("a.obj", "\xef\xbb\xbf# made\n" + vertices + quad));
    EXPECT_EQ(mesh.triangles.size(), 2U) << quad;
    EXPECT_NEAR(testing::total_area(mesh), 1.0, 1e-12) << quad;
  }
}

// A roof of two quadrilaterals that meet at a right angle.
TEST_F(Obj, SmoothingGroupsDecideWhichFacetsShareANormal) {
  const std::string roof = "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 1\nv 0 2 0\nv 1 2 0\n";
  const auto ridge = [&](const std::string& first, const std::string& second) {
    const TriangleMesh mesh =
        load_mesh(write("roof.obj", roof + first + "f 1 2 3 4\n" + second + "f 4 3 6 5\n"));
    float least = 1.0F;  // cosine between normals and the facets they belong to
    for (const glm::uvec3 t : mesh.triangles) {
      const glm::vec3 facet(glm::normalize(testing::area_vector(mesh, t)));
      for (int k = 0; k < 3; ++k) least = std::min(least, glm::dot(facet, mesh.normals[t[k]]));
    }
    return least;
  };
  EXPECT_NEAR(ridge("", ""), std::sqrt(0.5F), 1e-6);
  EXPECT_NEAR(ridge("s 1\n", ""), std::sqrt(0.5F), 1e-6);
  EXPECT_NEAR(ridge("s off\n", ""), 1.0, 1e-6);
  EXPECT_NEAR(ridge("s 0\n", "s 0\n"), 1.0, 1e-6);
  EXPECT_NEAR(ridge("s 1\n", "s 2\n"), 1.0, 1e-6);
  // Each triangle for itself, in all of a fan of many about one vertex.
  std::string fan = "s off\nv 0 0 1\n";
  constexpr int kFacets = 20'000;
  for (int i = 0; i <= kFacets; ++i) {
    const double angle = 2.0 * M_PI * i / kFacets;
    fan += "v " + std::to_string(std::cos(angle)) + " " + std::to_string(std::sin(angle)) + " 0\n";
    if (i > 0) fan += "f 1 -2 -1\n";
  }
  EXPECT_EQ(load_mesh(write("fan.obj", fan)).positions.size(), 3U * kFacets);
}

// Teeth of 1 x 2 on a bar of height 1, too many for the search for ears among all corners.
TEST_F(Obj, LargeConcavePolygonsAreNoFan) {
  constexpr int kTeeth = 5000;
  std::string text = "v 0 0 7\nv " + std::to_string(2 * kTeeth) + " 0 7\n";
  for (int i = kTeeth; i-- > 0;) {
    for (const auto& [x, y] :
         {std::pair(2 * i + 2, 1), std::pair(2 * i + 1, 1), std::pair(2 * i + 1, 3), std::pair(2 * i, 3)}) {
      text += "v " + std::to_string(x) + " " + std::to_string(y) + " 7\n";
    }
  }
  text += "f";
  for (int i = 1; i <= 4 * kTeeth + 2; ++i) text += " " + std::to_string(i);
  const TriangleMesh mesh = load_mesh(write("comb.obj", text));
  EXPECT_NEAR(testing::total_area(mesh), 4.0 * kTeeth, 1e-6);  // an overlap would count twice
}

TEST_F(Obj, FilesThatAreNotMeshesAreRejected) {
  EXPECT_THROW(load_mesh((directory_ / "missing.obj").string()), FileError);
  EXPECT_THROW(load_mesh(directory_.string()), FileError);
  EXPECT_THROW(load_mesh(write("a.stl", kCube)), FileError);
  EXPECT_THROW(load_mesh(""), FileError);
  std::filesystem::create_directory(directory_ / "folder.obj");
  EXPECT_THROW(load_mesh((directory_ / "folder.obj").string()), FileError);
}

TEST_F(Obj, LimitsHoldBeforeTheMemoryIsUsed) {
  const std::string path = write("cube.obj", kCube);
  EXPECT_NO_THROW(load_mesh(path, {8, 12}));
  EXPECT_THROW(load_mesh(path, {7, 12}), FileError);
  EXPECT_THROW(load_mesh(path, {8, 11}), FileError);
}

TEST_F(Obj, HugePolygonsAreReadInTime) {
  std::string text;
  constexpr int kCorners = 100'000;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * M_PI * i / kCorners;
    text += "v " + std::to_string(std::cos(angle)) + " " + std::to_string(std::sin(angle)) + " 0\n";
  }
  text += "f";
  for (int i = 1; i <= kCorners; ++i) text += " " + std::to_string(i);
  const TriangleMesh mesh = load_mesh(write("disc.obj", text));
  EXPECT_NEAR(testing::total_area(mesh), M_PI, 1e-4);  // coordinates are written with six digits
}

TEST_F(Obj, ReadsThePublicTestMeshes) {
  const char* data = std::getenv("MIRRORBAKE_TEST_DATA");
  if (data == nullptr) GTEST_SKIP() << "MIRRORBAKE_TEST_DATA is not set";
  for (const char* name : {"spot.obj", "suzanne.obj", "rocker-arm.obj"}) {
    const TriangleMesh mesh = load_mesh((std::filesystem::path(data) / name).string());
    EXPECT_NO_THROW(validate(mesh)) << name;
    EXPECT_GT(mesh.triangles.size(), 900U) << name;
    // Most normals are on the same side as their facets.
    std::size_t agreeing = 0;
    for (const glm::uvec3 t : mesh.triangles) {
      agreeing += glm::dot(testing::area_vector(mesh, t), glm::dvec3(mesh.normals[t.x])) > 0.0 ? 1U : 0U;
    }
    EXPECT_GT(static_cast<double>(agreeing), 0.98 * static_cast<double>(mesh.triangles.size())) << name;
  }
}

}  // namespace
}  // namespace mirrorbake
