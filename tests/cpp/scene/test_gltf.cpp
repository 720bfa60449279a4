#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include "mesh_checks.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/load.hpp"
#include "temporary_files.hpp"

namespace mirrorbake {
namespace {

using testing::base64;
using testing::bytes_of;
using testing::glb;
using ::testing::HasSubstr;
using Gltf = testing::FileTest;

// One quadrilateral as two triangles: 4 positions, 4 normals, 4 uvs (float), 6 indices (uint16), in this
// order.
std::string quad_buffer() {
  return bytes_of(std::vector<float>{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}) +
         bytes_of(std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}) +
         bytes_of(std::vector<float>{0, 1, 1, 1, 1, 0, 0, 0}) +
         bytes_of(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3});
}

// The parts of the file that describe the quadrilateral; each may be replaced by something wrong.
struct Quad {
  std::string uri = "\"uri\":\"data:application/octet-stream;base64," + base64(quad_buffer()) + "\",";
  std::string byte_length = "140";
  std::string views = R"({"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":48},
      {"buffer":0,"byteOffset":96,"byteLength":32},{"buffer":0,"byteOffset":128,"byteLength":12})";
  std::string position = R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"})";
  std::string index = R"({"bufferView":3,"componentType":5123,"count":6,"type":"SCALAR"})";
  std::string primitive = R"({"attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2},"indices":3})";
  std::string nodes = R"([{"mesh":0}])";
  std::string scene = R"("scenes":[{"nodes":[0]}],"scene":0,)";
  std::string extra;

  std::string json() const {
    return R"({"asset":{"version":"2.0"},)" + scene + extra + R"("nodes":)" + nodes +
           R"(,"meshes":[{"primitives":[)" + primitive + R"(]}],"accessors":[)" + position +
           R"(,{"bufferView":1,"componentType":5126,"count":4,"type":"VEC3"},
      {"bufferView":2,"componentType":5126,"count":4,"type":"VEC2"},)" +
           index + R"(],"bufferViews":[)" + views + R"(],"buffers":[{)" + uri + R"("byteLength":)" +
           byte_length + "}]}";
  }
};

void expect_quad(const TriangleMesh& mesh) {
  ASSERT_EQ(mesh.positions.size(), 4U);
  ASSERT_EQ(mesh.triangles.size(), 2U);
  EXPECT_EQ(mesh.positions[2], glm::vec3(1, 1, 0));
  EXPECT_EQ(mesh.normals[2], glm::vec3(0, 0, 1));
  EXPECT_EQ(mesh.uvs[0], glm::vec2(0, 0));  // v up: (0,1) in the file
  EXPECT_EQ(mesh.uvs[2], glm::vec2(1, 1));
  EXPECT_EQ(mesh.triangles[1], glm::uvec3(0, 2, 3));
}

TEST_F(Gltf, ReadsEmbeddedExternalAndBinaryBuffersAlike) {
  Quad embedded;
  expect_quad(load_mesh(write("embedded.gltf", embedded.json())));
  Quad external;
  external.uri = R"("uri":"parts/quad%20data.bin",)";
  write("parts/quad data.bin", quad_buffer());
  expect_quad(load_mesh(write("external.gltf", external.json())));
  Quad binary;
  binary.uri = "";
  expect_quad(load_mesh(write("binary.glb", glb(binary.json(), quad_buffer()))));
}

TEST_F(Gltf, AppliesNodeTransformsDownTheTree) {
  Quad quad;
  // World = translate(10,0,0) · rotate 90° about +Z · scale(2,1,1): (1,1,0) goes to (9,2,0).
  quad.nodes = R"([{"children":[1],"translation":[10,0,0]},
      {"children":[2],"rotation":[0,0,0.7071067811865476,0.7071067811865476]},
      {"mesh":0,"matrix":[2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}])";
  const TriangleMesh mesh = load_mesh(write("a.gltf", quad.json()));
  EXPECT_LT(glm::length(mesh.positions[2] - glm::vec3(9, 2, 0)), 1e-6F);
  EXPECT_LT(glm::length(mesh.normals[2] - glm::vec3(0, 0, 1)), 1e-6F);
}

TEST_F(Gltf, MirroredInstancesKeepTheirOutside) {
  Quad quad;
  quad.scene = R"("scenes":[{"nodes":[0,1]}],)";
  quad.nodes = R"([{"mesh":0},{"mesh":0,"scale":[-1,1,3],"translation":[0,0,5]}])";
  const TriangleMesh mesh = load_mesh(write("a.gltf", quad.json()));
  ASSERT_EQ(mesh.triangles.size(), 4U);
  for (const glm::uvec3 t : mesh.triangles) {
    EXPECT_GT(glm::dot(testing::area_vector(mesh, t), glm::dvec3(mesh.normals[t.x])), 0.0);
  }
  EXPECT_EQ(bounds(mesh).min, glm::vec3(-1, 0, 0));
  EXPECT_EQ(bounds(mesh).max, glm::vec3(1, 1, 5));
}

TEST_F(Gltf, NormalsFollowUnevenScalesAsNormalsDo) {
  Quad quad;
  // The plane z = 0 turned by 45° about +X and then stretched along Y: its normal turns towards Z.
  quad.nodes =
      R"([{"children":[1],"scale":[1,2,1]},{"mesh":0,"rotation":[0.3826834323650898,0,0,0.9238795325112867]}])";
  const TriangleMesh mesh = load_mesh(write("a.gltf", quad.json()));
  EXPECT_LT(glm::length(mesh.normals[0] - glm::normalize(glm::vec3(0, -0.5F, 1))), 1e-6F);
}

TEST_F(Gltf, ReadsStripsFansAndUnindexedTriangles) {
  Quad strip;
  strip.primitive = R"({"attributes":{"POSITION":0},"mode":5})";
  const TriangleMesh a = load_mesh(write("strip.gltf", strip.json()));
  ASSERT_EQ(a.triangles.size(), 2U);
  // Without normals every facet has vertices of its own.
  const auto corner = [](const TriangleMesh& mesh, int k) { return mesh.positions[mesh.triangles[1][k]]; };
  const TriangleMesh shared = load_mesh(write("a.gltf", Quad().json()));
  for (int k = 0; k < 3; ++k) EXPECT_EQ(corner(a, k), shared.positions[glm::uvec3(2, 1, 3)[k]]);
  Quad fan;
  fan.primitive = R"({"attributes":{"POSITION":0},"mode":6})";
  const TriangleMesh b = load_mesh(write("fan.gltf", fan.json()));
  for (int k = 0; k < 3; ++k) EXPECT_EQ(corner(b, k), shared.positions[glm::uvec3(0, 2, 3)[k]]);
  Quad points;
  points.primitive += R"(,{"attributes":{"POSITION":0},"mode":0})";  // skipped
  expect_quad(load_mesh(write("points.gltf", points.json())));
}

TEST_F(Gltf, ReadsNormalizedIntegersAndSparseReplacements) {
  const std::string buffer = bytes_of(std::vector<std::int16_t>{0, 0, 0, 0, 32767, 0, 0, 0, 0, 32767, 0, 0}) +
                             bytes_of(std::vector<std::uint8_t>{2, 0, 0, 0}) +
                             bytes_of(std::vector<std::int16_t>{-32768, 16384, 0, 0});
  const std::string json =
      R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_mesh_quantization"],"nodes":[{"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
      "accessors":[{"bufferView":0,"componentType":5122,"normalized":true,"count":3,"type":"VEC3",
        "sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":2}}}],
      "bufferViews":[{"buffer":0,"byteLength":24,"byteStride":8},{"buffer":0,"byteOffset":24,"byteLength":4},
        {"buffer":0,"byteOffset":28,"byteLength":6}],
      "buffers":[{"byteLength":36}]})";
  const TriangleMesh mesh = load_mesh(write("a.glb", glb(json, buffer)));
  ASSERT_EQ(mesh.positions.size(), 3U);
  EXPECT_EQ(mesh.positions[1], glm::vec3(1, 0, 0));
  EXPECT_FLOAT_EQ(mesh.positions[2].x, -1.0F);  // −32768 is clamped
  EXPECT_FLOAT_EQ(mesh.positions[2].y, 16384.0F / 32767.0F);
}

TEST_F(Gltf, MakesMissingNormals) {
  Quad quad;
  quad.primitive = R"({"attributes":{"POSITION":0},"indices":3})";
  const TriangleMesh mesh = load_mesh(write("a.gltf", quad.json()));
  for (const glm::vec3 n : mesh.normals) EXPECT_EQ(n, glm::vec3(0, 0, 1));
  EXPECT_TRUE(mesh.uvs.empty());
}

class GltfDefects : public Gltf {
 protected:
  struct Defect {
    std::string json, expected;
  };

  // A quad with something wrong.
  template <typename Spoil>
  void add(const std::string& expected, const Spoil& spoil) {
    Quad quad;
    spoil(quad);
    defects.push_back({quad.json(), expected});
  }

  void expect_named() {
    for (const Defect& defect : defects) {
      const std::string path = write("defect.gltf", defect.json);
      try {
        load_mesh(path);
        ADD_FAILURE() << "accepted, expected: " << defect.expected << "\n" << defect.json.substr(0, 2000);
      } catch (const FileError& error) {
        EXPECT_THAT(error.what(), HasSubstr(path));
        EXPECT_THAT(error.what(), HasSubstr(defect.expected));
      }
    }
  }

  std::vector<Defect> defects;
};

TEST_F(GltfDefects, OfBuffersAndAccessorsAreFileErrorsThatSayWhatIsWrong) {
  const auto with_positions = [](std::vector<float> positions) {
    std::string buffer = quad_buffer();
    const std::string bytes = bytes_of(positions);
    buffer.replace(0, bytes.size(), bytes);
    return "\"uri\":\"data:application/octet-stream;base64," + base64(buffer) + "\",";
  };
  defects.push_back({"", "not a valid glTF"});
  defects.push_back({"{", "not a valid glTF"});
  defects.push_back({"{}", "not a valid glTF"});
  defects.push_back({R"({"asset":{"version":"2.0"}})", "has no triangles"});
  defects.push_back({std::string(100'000, '['), "nested deeper than 256"});
  defects.push_back(
      {R"({"asset":{"version":"2.0","extras":)" + std::string(300, '[') + std::string(300, ']') + "}}",
       "nested deeper than 256"});
  add("vertex 1 is (nan", [&](Quad& q) { q.uri = with_positions({0, 0, 0, std::nanf(""), 0, 0}); });
  add("vertex 0 is (inf", [&](Quad& q) { q.uri = with_positions({std::numeric_limits<float>::infinity()}); });
  add("no triangle with an area", [&](Quad& q) { q.uri = with_positions(std::vector<float>(12, 1.0F)); });
  add("ends beyond its buffer view",
      [](Quad& q) { q.position = R"({"bufferView":0,"componentType":5126,"count":5,"type":"VEC3"})"; });
  add("ends beyond its buffer view", [](Quad& q) {
    q.position = R"({"bufferView":0,"componentType":5126,"count":40000000,"type":"VEC3"})";
  });
  add("vertices or more, the limit is", [](Quad& q) {
    q.position = R"({"bufferView":0,"componentType":5126,"count":4000000000,"type":"VEC3"})";
  });
  add("count is negative",
      [](Quad& q) { q.position = R"({"bufferView":0,"componentType":5126,"count":-1,"type":"VEC3"})"; });
  add("ends beyond its buffer view", [](Quad& q) {
    q.position = R"({"bufferView":0,"byteOffset":44,"componentType":5126,"count":4,"type":"VEC3"})";
  });
  add("byteOffset is negative", [](Quad& q) {
    q.position = R"({"bufferView":0,"byteOffset":-4,"componentType":5126,"count":4,"type":"VEC3"})";
  });
  add("buffer view index is 9",
      [](Quad& q) { q.position = R"({"bufferView":9,"componentType":5126,"count":4,"type":"VEC3"})"; });
  add("no triangle with an area",
      [](Quad& q) { q.position = R"({"componentType":5126,"count":4,"type":"VEC3"})"; });
  add("has the wrong type",
      [](Quad& q) { q.position = R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC2"})"; });
  add("wrong type",
      [](Quad& q) { q.index = R"({"bufferView":3,"componentType":5126,"count":3,"type":"SCALAR"})"; });
  add("expected a multiple of 3",
      [](Quad& q) { q.index = R"({"bufferView":3,"componentType":5123,"count":5,"type":"SCALAR"})"; });
  add("vertex index is 65536",
      [](Quad& q) { q.index = R"({"bufferView":3,"componentType":5125,"count":3,"type":"SCALAR"})"; });
  add("byteStride is negative",
      [](Quad& q) { q.views.replace(q.views.find("48}"), 3, R"(48,"byteStride":-12})"); });
  add("byte stride is 8", [](Quad& q) { q.views.replace(q.views.find("48}"), 3, R"(48,"byteStride":8})"); });
  add("byteStride", [](Quad& q) { q.views.replace(q.views.find("48}"), 3, R"(48,"byteStride":1000})"); });
  add("ends beyond its buffer of", [](Quad& q) { q.views.replace(q.views.find("48}"), 3, "480}"); });
  add("buffer index is 1", [](Quad& q) { q.views.replace(q.views.find("0,"), 2, "1,"); });
  add("accessor index is 7", [](Quad& q) { q.primitive = R"({"attributes":{"POSITION":7},"indices":3})"; });
  add("has no positions", [](Quad& q) { q.primitive = R"({"attributes":{"NORMAL":1},"indices":3})"; });
  add("number of normals is 6", [](Quad& q) {
    q.primitive = R"({"attributes":{"POSITION":0,"NORMAL":4},"indices":3})";
    q.index += R"(,{"bufferView":0,"componentType":5121,"count":6,"type":"VEC3"})";
  });
  expect_named();
}

TEST_F(GltfDefects, OfNodesAndFilesAreFileErrorsThatSayWhatIsWrong) {
  add("node 0 is reached twice", [](Quad& q) { q.nodes = R"([{"mesh":0,"children":[0]}])"; });
  add("is reached twice",
      [](Quad& q) { q.nodes = R"([{"children":[1]},{"children":[2]},{"children":[1],"mesh":0}])"; });
  add("has no triangles", [](Quad& q) {
    q.scene = "";
    q.nodes = R"([{"children":[1]},{"children":[0],"mesh":0}])";
  });
  add("node index is 5", [](Quad& q) { q.nodes = R"([{"mesh":0,"children":[5]}])"; });
  add("mesh index is 3", [](Quad& q) { q.nodes = R"([{"mesh":3}])"; });
  add("default scene index is 4", [](Quad& q) { q.scene = R"("scenes":[{"nodes":[0]}],"scene":4,)"; });
  add("not finite",
      [](Quad& q) { q.nodes = R"([{"scale":[1e300,1,1],"children":[1]},{"mesh":0,"scale":[1e300,1,1]}])"; });
  add("finite coordinates", [](Quad& q) { q.nodes = R"([{"mesh":0,"scale":[1e30,1,1]}])"; });
  add("rotation is zero", [](Quad& q) { q.nodes = R"([{"mesh":0,"rotation":[0,0,0,0]}])"; });
  add("no triangle with an area", [](Quad& q) { q.nodes = R"([{"mesh":0,"scale":[0,0,0]}])"; });
  add("KHR_texture_basisu", [](Quad& q) { q.extra = R"("extensionsRequired":["KHR_texture_basisu"],)"; });
  add("not a valid glTF", [](Quad& q) { q.uri = R"("uri":"missing.bin",)"; });
  add("not a valid glTF", [](Quad& q) { q.uri = ""; });
  add("not a valid glTF", [](Quad& q) { q.byte_length = "141"; });
  expect_named();
}

TEST_F(Gltf, ReferencesOutOfTheDirectoryAreRefused) {
  write("secret.bin", quad_buffer());
  const std::string secret = (directory_ / "secret.bin").string();
  std::filesystem::create_directory(directory_ / "scene");
  std::filesystem::create_symlink(directory_ / "secret.bin", directory_ / "scene" / "link.bin");
  for (const std::string& uri :
       {std::string("../secret.bin"), secret, std::string("%2e%2e/secret.bin"), std::string("link.bin"),
        "file://" + secret, std::string("sub/../../secret.bin")}) {
    Quad quad;
    quad.uri = R"("uri":")" + uri + R"(",)";
    const std::string path = write("scene/a.gltf", quad.json());
    EXPECT_THROW(load_mesh(path), FileError) << uri;
  }
  // The same file from inside is fine, also by a path with dots.
  write("scene/inside.bin", quad_buffer());
  Quad quad;
  quad.uri = R"("uri":"../scene/inside.bin",)";
  EXPECT_NO_THROW(load_mesh(write("scene/a.gltf", quad.json())));
}

TEST_F(Gltf, InstancesCountTowardsTheLimits) {
  Quad quad;
  quad.scene = "";
  quad.nodes = "[";
  for (int i = 0; i < 10; ++i) quad.nodes += R"({"mesh":0},)";
  quad.nodes.back() = ']';
  const std::string path = write("a.gltf", quad.json());
  EXPECT_EQ(load_mesh(path, {40, 20}).triangles.size(), 20U);
  EXPECT_THROW(load_mesh(path, {39, 20}), FileError);
  EXPECT_THROW(load_mesh(path, {40, 19}), FileError);
}

TEST_F(Gltf, TruncatedBinariesAreFileErrors) {
  Quad quad;
  quad.uri = "";
  const std::string whole = glb(quad.json(), quad_buffer());
  for (std::size_t length = 0; length + 1 < whole.size(); length += 7) {
    EXPECT_THROW(load_mesh(write("cut.glb", whole.substr(0, length))), FileError) << length;
  }
}

}  // namespace
}  // namespace mirrorbake
