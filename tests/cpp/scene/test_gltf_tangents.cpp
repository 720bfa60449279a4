// Tangents of normal textures: those of the file, and those that are derived where it has none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include "gltf_files.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/scene/load.hpp"

namespace mirrorbake {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

// Two quadrilaterals that share the edge x = 0, facing +Z, with a normal texture. As in every mirrored model,
// u grows away from the edge on both sides.
class GltfTangents : public testing::FileTest {
 protected:
  void SetUp() override {
    testing::FileTest::SetUp();
    Image image(1, 1, {"R", "G", "B"});
    image.pixels = {0.5F, 0.5F, 1.0F};
    save_image((directory_ / "n.exr").string(), image, PixelFormat::float32);
  }

  std::vector<float> tangents;  // of six vertices; empty: none
  bool has_normals = true;
  bool has_texture = true;
  std::string node = R"({"mesh":0})";

  LoadedScene load() const {
    const std::vector<float> positions = {-1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 1, 0, 0, 1, 0, 1, 1, 0};
    const std::vector<float> normals = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    const std::vector<float> uvs = {1, 1, 0, 1, 1, 1, 1, 0, 0, 0, 1, 0};  // v down
    const std::vector<std::uint16_t> triangles = {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4};
    std::string buffer;
    std::string views, accessors;
    std::size_t count = 0;
    const auto add = [&](const std::string& bytes, const std::string& accessor) {
      const std::string comma = count++ > 0 ? "," : "";
      views += comma + R"({"buffer":0,"byteOffset":)" + std::to_string(buffer.size()) + R"(,"byteLength":)" +
               std::to_string(bytes.size()) + "}";
      accessors += comma + R"({"bufferView":)" + std::to_string(count - 1) + "," + accessor + "}";
      buffer += bytes;
    };
    add(testing::bytes_of(positions), R"("componentType":5126,"count":6,"type":"VEC3")");
    add(testing::bytes_of(uvs), R"("componentType":5126,"count":6,"type":"VEC2")");
    add(testing::bytes_of(triangles), R"("componentType":5123,"count":12,"type":"SCALAR")");
    add(testing::bytes_of(normals), R"("componentType":5126,"count":6,"type":"VEC3")");
    std::string attributes = R"("POSITION":0,"TEXCOORD_0":1)";
    if (has_normals) attributes += R"(,"NORMAL":3)";
    if (!tangents.empty()) {
      add(testing::bytes_of(tangents), R"("componentType":5126,"count":6,"type":"VEC4")");
      attributes += R"(,"TANGENT":4)";
    }
    return load_scene(
        write("scene.gltf",
              R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[)" + node +
                  R"(],"meshes":[{"primitives":[{"attributes":{)" + attributes +
                  R"(},"indices":2,"material":0}]}],"images":[{"uri":"n.exr"}],"textures":[{"source":0}],)" +
                  R"("materials":[{)" + (has_texture ? R"("normalTexture":{"index":0})" : "") +
                  R"(}],"accessors":[)" + accessors + R"(],"bufferViews":[)" + views +
                  R"(],"buffers":[{"uri":"data:application/octet-stream;base64,)" + testing::base64(buffer) +
                  R"(","byteLength":)" + std::to_string(buffer.size()) + "}]}"));
  }
  TriangleMesh loaded_mesh() const {
    const LoadedScene loaded = load();
    EXPECT_THAT(loaded.warnings, IsEmpty());
    return loaded.scene.objects.at(0).mesh;
  }
  // The same tangent at every vertex.
  static std::vector<float> everywhere(glm::vec4 tangent) {
    std::vector<float> values;
    for (int i = 0; i < 6; ++i) values.insert(values.end(), {tangent.x, tangent.y, tangent.z, tangent.w});
    return values;
  }
};

TEST_F(GltfTangents, ThoseOfTheFileAreTakenOver) {
  tangents = everywhere({0.6F, 0.8F, 0.0F, -1.0F});
  for (const glm::vec4 t : loaded_mesh().tangents) EXPECT_EQ(t, glm::vec4(0.6F, 0.8F, 0.0F, -1.0F));
  has_texture = false;
  EXPECT_THAT(loaded_mesh().tangents, IsEmpty());
}

TEST_F(GltfTangents, NodesTurnThemAndMirrorsTurnTheSign) {
  tangents = everywhere({1.0F, 0.0F, 0.0F, 1.0F});
  node = R"({"mesh":0,"rotation":[0,0,0.7071067811865476,0.7071067811865476],"scale":[2,3,4]})";
  for (const glm::vec4 t : loaded_mesh().tangents) {
    EXPECT_LT(glm::length(t - glm::vec4(0, 1, 0, 1)), 1e-6F);  // a quarter turn about Z
  }
  // The mirror image has the texture's mirror image: what pointed up the texture still does.
  node = R"({"mesh":0,"scale":[-1,1,1]})";
  const TriangleMesh mesh = loaded_mesh();
  ASSERT_THAT(mesh.tangents, Not(IsEmpty()));
  for (std::size_t i = 0; i < mesh.tangents.size(); ++i) {
    const glm::vec3 along(mesh.tangents[i]);
    EXPECT_EQ(along, glm::vec3(-1, 0, 0));
    EXPECT_EQ(mesh.tangents[i].w * glm::cross(mesh.normals[i], along), glm::vec3(0, 1, 0));
  }
}

// Flat to a node, however large it makes what is not there: no number overflows into the mesh.
TEST_F(GltfTangents, OnesThatANodeMakesTooLargeAreDerived) {
  tangents = everywhere({0.0F, 0.0F, 1.0F, 1.0F});
  node = R"({"mesh":0,"scale":[1,1,1e200]})";
  const TriangleMesh mesh = loaded_mesh();
  EXPECT_NO_THROW(validate(mesh));
  for (const glm::vec4 t : mesh.tangents) EXPECT_EQ(std::abs(t.x), 1.0F);
}

TEST_F(GltfTangents, WithoutNormalsThoseOfTheFileAreIgnored) {  // glTF 2.0 §3.7.2.1, a MUST
  tangents = everywhere({0.6F, 0.8F, 0.0F, -1.0F});
  has_normals = false;
  for (const glm::vec4 t : loaded_mesh().tangents) EXPECT_EQ(std::abs(t.x), 1.0F);
}

// u grows towards −X on the left, where the texture is mirrored, and towards +X on the right.
TEST_F(GltfTangents, WithoutAnyTheyFollowTheCoordinatesAndMirroredHalvesAreKeptApart) {
  const TriangleMesh mesh = loaded_mesh();
  ASSERT_THAT(mesh.tangents, SizeIs(8));  // the two vertices of the seam are there twice
  ASSERT_THAT(mesh.triangles, SizeIs(4));
  for (const glm::uvec3 t : mesh.triangles) {
    const float side =
        mesh.positions[t.x].x + mesh.positions[t.y].x + mesh.positions[t.z].x < 0.0F ? -1.0F : 1.0F;
    for (int k = 0; k < 3; ++k) EXPECT_EQ(mesh.tangents[t[k]], glm::vec4(side, 0, 0, side));
  }
}

TEST_F(GltfTangents, ZerosAreDerivedAndOthersKept) {
  tangents = everywhere({0.0F, 1.0F, 0.0F, 1.0F});
  for (std::size_t i = 20; i < 24; ++i) tangents[i] = 0.0F;  // of the last vertex
  const TriangleMesh mesh = loaded_mesh();
  ASSERT_THAT(mesh.tangents, SizeIs(6));
  for (std::size_t i = 0; i < 6; ++i) {
    const bool is_last = mesh.positions[i] == glm::vec3(1, 1, 0);
    EXPECT_EQ(mesh.tangents[i], is_last ? glm::vec4(1, 0, 0, 1) : glm::vec4(0, 1, 0, 1));
  }
}

TEST_F(GltfTangents, OnesThatAreNotFiniteAreNamed) {
  tangents = everywhere({1.0F, 0.0F, 0.0F, 1.0F});
  tangents[5] = std::numeric_limits<float>::quiet_NaN();
  try {
    load();
    FAIL();
  } catch (const FileError& e) {
    EXPECT_THAT(e.what(), HasSubstr("scene.gltf"));
    EXPECT_THAT(e.what(), HasSubstr("tangent 1 is not finite"));
  }
}

}  // namespace
}  // namespace mirrorbake
