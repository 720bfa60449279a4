// glTF files as real programs write them: compressed, sparse, coloured, slightly out of range.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>
#include <webp/encode.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include "gltf_files.hpp"
#include "mesh_checks.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/load.hpp"

namespace mirrorbake {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Document = testing::GltfScene;

class GltfVariants : public testing::FileTest {
 protected:
  LoadedScene load(const std::string& json) const { return load_scene(write("scene.gltf", json)); }
  LoadedScene load(const Document& document) const { return load(document.json()); }

  // A document of one mesh, whose accessors, views and buffer are given.
  static std::string document(const std::string& primitive, const std::string& accessors,
                              const std::string& views, const std::string& buffer,
                              const std::string& more_buffers = "", const std::string& extra = "") {
    return R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)" + extra +
           R"("meshes":[{"primitives":[)" + primitive + R"(]}],"accessors":[)" + accessors +
           R"(],"bufferViews":[)" + views +
           R"(],"buffers":[{"uri":"data:application/octet-stream;charset=utf-8;base64,)" +
           testing::base64(buffer) + R"(","byteLength":)" + std::to_string(buffer.size()) + "}" +
           more_buffers + "]}";
  }
  static std::string view(std::size_t offset, std::size_t length, const std::string& more = "") {
    return R"({"buffer":0,"byteOffset":)" + std::to_string(offset) + R"(,"byteLength":)" +
           std::to_string(length) + more + "}";
  }
  std::string error_of(const std::string& json) const {
    try {
      load(json);
    } catch (const FileError& e) {
      return e.what();
    }
    return "no error";
  }
};

const std::vector<float> kQuad = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
const std::vector<std::uint16_t> kTriangles = {0, 1, 2, 0, 2, 3};
constexpr const char* kPrimitive = R"({"attributes":{"POSITION":0},"indices":1})";
constexpr const char* kAccessors =
    R"({"componentType":5126,"count":4,"type":"VEC3"},{"componentType":5123,"count":6,"type":"SCALAR"})";

TEST_F(GltfVariants, SparseAccessorsReplaceZerosAndIndices) {
  const std::string buffer = testing::bytes_of(std::vector<std::uint16_t>{0, 1, 2, 3}) +
                             testing::bytes_of(kQuad) +
                             testing::bytes_of(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 1, 5, 0, 3, 0});
  const std::string json = document(
      kPrimitive,
      R"({"componentType":5126,"count":4,"type":"VEC3","sparse":{"count":4,"indices":{"bufferView":0,"componentType":5123},
          "values":{"bufferView":1}}},
         {"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR","sparse":{"count":1,
          "indices":{"bufferView":3,"componentType":5123},"values":{"bufferView":4}}})",
      view(0, 8) + "," + view(8, 48) + "," + view(56, 12) + "," + view(68, 2) + "," + view(72, 2), buffer);
  const LoadedScene loaded = load(json);
  EXPECT_NEAR(testing::total_area(loaded.scene.objects.at(0).mesh), 1.0,
              1e-6);  // of the quadrilateral, not twice a half
}

TEST_F(GltfVariants, ZerosAreNotAllocatedBeyondTheLimits) {
  EXPECT_THAT(error_of(document(kPrimitive, R"({"componentType":5126,"count":4000000000,"type":"VEC3"},
      {"bufferView":0,"componentType":5123,"count":3,"type":"SCALAR"})",
                                view(0, 6), std::string(6, '\0'))),
              HasSubstr("vertices"));
}

// glTF 2.0 §3.7.2.1: "When normals are not specified, client implementations MUST calculate flat normals".
TEST_F(GltfVariants, FacetsWithoutNormalsAreFlat) {
  const std::vector<float> positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};  // a tetrahedron
  const std::vector<std::uint16_t> faces = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  const std::string buffer = testing::bytes_of(positions) + testing::bytes_of(faces);
  const LoadedScene loaded =
      load(document(kPrimitive, R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
      {"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"})",
                    view(0, 48) + "," + view(48, 24), buffer));
  const TriangleMesh& mesh = loaded.scene.objects.at(0).mesh;
  ASSERT_EQ(mesh.positions.size(), 12U);
  for (const glm::uvec3 t : mesh.triangles) {
    const glm::vec3 facet(glm::normalize(testing::area_vector(mesh, t)));
    for (int k = 0; k < 3; ++k) EXPECT_LT(glm::length(mesh.normals[t[k]] - facet), 1e-6F);
  }
}

// A quadrilateral in Draco's form: positions of `Position`, and colours of bytes that Draco itself takes for
// whole numbers.
struct DracoQuad {
  std::string bytes;
  std::uint32_t positions = 0;
  std::uint32_t colors = 0;
};

template <typename Position>
DracoQuad draco_quad(draco::DataType type, const std::array<Position, 12>& corners) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(2);
  const int positions = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, type);
  const int colors = builder.AddAttribute(draco::GeometryAttribute::COLOR, 3, draco::DT_UINT8);
  const std::array<std::uint8_t, 3> color = {255, 51, 0};
  const auto corner = [&](std::uint16_t i) { return corners.data() + std::size_t{3} * i; };
  for (std::uint32_t f = 0; f < 2; ++f) {
    const std::uint16_t* t = kTriangles.data() + std::size_t{3} * f;
    builder.SetAttributeValuesForFace(positions, draco::FaceIndex(f), corner(t[0]), corner(t[1]),
                                      corner(t[2]));
    builder.SetAttributeValuesForFace(colors, draco::FaceIndex(f), color.data(), color.data(), color.data());
  }
  const auto mesh = builder.Finalize();
  draco::EncoderBuffer encoded;
  EXPECT_TRUE(draco::Encoder().EncodeMeshToBuffer(*mesh, &encoded).ok());
  return {std::string(encoded.data(), encoded.size()), mesh->attribute(positions)->unique_id(),
          mesh->attribute(colors)->unique_id()};
}

std::string draco_primitive(const DracoQuad& quad) {
  return R"({"attributes":{"POSITION":0,"COLOR_0":2},"indices":1,"extensions":{"KHR_draco_mesh_compression":
      {"bufferView":0,"attributes":{"POSITION":)" +
         std::to_string(quad.positions) + R"(,"COLOR_0":)" + std::to_string(quad.colors) + "}}}}";
}

constexpr const char* kColors = R"(,{"componentType":5121,"normalized":true,"count":4,"type":"VEC3"})";

TEST_F(GltfVariants, DracoMeshesAreDecoded) {
  const DracoQuad quad = draco_quad<float>(draco::DT_FLOAT32, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  const auto json = [&](const std::string& content) {
    return document(
        draco_primitive(quad), std::string(kAccessors) + kColors, view(0, content.size()), content, "",
        R"("extensionsRequired":["KHR_draco_mesh_compression"],"extensionsUsed":["KHR_draco_mesh_compression"],)");
  };
  const LoadedScene loaded = load(json(quad.bytes));
  EXPECT_THAT(loaded.warnings, IsEmpty());
  const TriangleMesh& mesh = loaded.scene.objects.at(0).mesh;
  EXPECT_NEAR(testing::total_area(mesh), 1.0, 1e-3);
  ASSERT_THAT(mesh.colors, SizeIs(mesh.positions.size()));
  for (const glm::vec3 color : mesh.colors) EXPECT_LT(glm::length(color - glm::vec3(1, 0.2F, 0)), 1e-6F);
  EXPECT_THAT(error_of(json(quad.bytes.substr(0, quad.bytes.size() / 2))),
              HasSubstr("Draco mesh that is damaged"));
  EXPECT_THAT(error_of(json(std::string(40, 'x'))), HasSubstr("Draco mesh that is damaged"));
}

// What whole numbers stand for is the accessor's to say; meshoptimizer may have packed Draco's bytes.
TEST_F(GltfVariants, DracoMeshesMayBeQuantisedAndPackedByMeshoptBesides) {
  const DracoQuad quad = draco_quad<std::int16_t>(
      draco::DT_INT16, {-32768, 0, 0, 32767, 0, 0, 32767, 32767, 0, -32768, 32767, 0});
  std::string padded = quad.bytes;  // vertices of four bytes, of which Draco reads what it needs
  padded.resize((padded.size() + 3) / 4 * 4, '\0');
  const std::size_t count = padded.size() / 4;
  std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(count, 4));
  packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), padded.data(), count, 4));
  const std::string accessor = R"({"componentType":5122,"count":4,"type":"VEC3","normalized":)";
  const std::string rest = std::string(R"(},{"componentType":5123,"count":6,"type":"SCALAR"})") + kColors;
  const std::string extra =
      R"("extensionsRequired":["KHR_draco_mesh_compression","KHR_mesh_quantization","EXT_meshopt_compression"],)";
  for (const auto& [normalized, size] : {std::pair("true", 2.0), std::pair("false", 65535.0 * 32767.0)}) {
    const std::string json =
        document(draco_primitive(quad), accessor + normalized + rest,
                 R"({"buffer":1,"byteLength":)" + std::to_string(padded.size()) +
                     R"(,"extensions":{"EXT_meshopt_compression":{"buffer":0,"byteLength":)" +
                     std::to_string(packed.size()) + R"(,"byteStride":4,"count":)" + std::to_string(count) +
                     R"(,"mode":"ATTRIBUTES"}}})",
                 std::string(packed.begin(), packed.end()),
                 R"(,{"byteLength":)" + std::to_string(padded.size()) +
                     R"(,"extensions":{"EXT_meshopt_compression":{"fallback":true}}})",
                 extra);
    const LoadedScene loaded = load(json);
    EXPECT_THAT(loaded.warnings, IsEmpty());
    // −32768 and −32767 are both −1, as glTF 2.0 §3.11 has it.
    EXPECT_NEAR(testing::total_area(loaded.scene.objects.at(0).mesh) / size, 1.0, 1e-6);
  }
}

TEST_F(GltfVariants, MeshoptViewsAreDecoded) {
  std::vector<unsigned char> vertices(meshopt_encodeVertexBufferBound(4, 12));
  vertices.resize(meshopt_encodeVertexBuffer(vertices.data(), vertices.size(), kQuad.data(), 4, 12));
  std::vector<unsigned char> indices(meshopt_encodeIndexBufferBound(6, 4));
  indices.resize(meshopt_encodeIndexBuffer(indices.data(), indices.size(), kTriangles.data(), 6));
  const std::string buffer(std::string(vertices.begin(), vertices.end()) +
                           std::string(indices.begin(), indices.end()));
  const auto compressed = [](std::size_t offset, std::size_t length, const std::string& mode, int stride,
                             int count) {
    return R"({"buffer":1,"byteLength":)" + std::to_string(stride * count) +
           R"(,"extensions":{"EXT_meshopt_compression":{"buffer":0,"byteOffset":)" + std::to_string(offset) +
           R"(,"byteLength":)" + std::to_string(length) + R"(,"byteStride":)" + std::to_string(stride) +
           R"(,"count":)" + std::to_string(count) + R"(,"mode":")" + mode + R"("}}})";
  };
  const std::string accessors = R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
      {"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"})";
  const std::string fallback =
      R"(,{"byteLength":60,"extensions":{"EXT_meshopt_compression":{"fallback":true}}})";
  const std::string extra =
      R"("extensionsRequired":["EXT_meshopt_compression"],"extensionsUsed":["EXT_meshopt_compression"],)";
  const std::string index_view = compressed(vertices.size(), indices.size(), "TRIANGLES", 2, 6);
  const LoadedScene loaded = load(
      document(kPrimitive, accessors, compressed(0, vertices.size(), "ATTRIBUTES", 12, 4) + "," + index_view,
               buffer, fallback, extra));
  EXPECT_THAT(loaded.warnings, IsEmpty());
  EXPECT_NEAR(testing::total_area(loaded.scene.objects.at(0).mesh), 1.0, 1e-6);
  for (const auto& [broken, message] :
       {std::pair(compressed(0, vertices.size() / 2, "ATTRIBUTES", 12, 4), "is damaged"),
        std::pair(compressed(0, vertices.size(), "SECRETS", 12, 4), "mode 'SECRETS'"),
        std::pair(compressed(0, 100000, "ATTRIBUTES", 12, 4), "ends beyond its buffer"),
        std::pair(compressed(0, vertices.size(), "ATTRIBUTES", 12, 100000000), "its sizes do not allow")}) {
    EXPECT_THAT(error_of(document(kPrimitive, accessors, broken + "," + index_view, buffer, fallback, extra)),
                HasSubstr(message));
  }
}

TEST_F(GltfVariants, VersionOneIsNamed) {
  EXPECT_THAT(error_of(R"({"asset":{"version":"1.0"},"scenes":{"s":{"nodes":[]}}})"),
              HasSubstr("is a glTF 1.0 file"));
  const std::string binary = "glTF" + testing::bytes_of(std::vector<std::uint32_t>{1, 20, 0, 0});
  try {
    load_scene(write("one.glb", binary));
    FAIL();
  } catch (const FileError& e) {
    EXPECT_THAT(e.what(), HasSubstr("is a glTF 1.0 file"));
  }
}

TEST_F(GltfVariants, FactorsAndAnglesALittleOutOfRangeAreCutWithAWarning) {
  Document d;
  d.materials = R"([{"pbrMetallicRoughness":{"roughnessFactor":1.0000001,"baseColorFactor":[1,1,1,2]}}])";
  d.nodes = R"([{"mesh":0},{"extensions":{"KHR_lights_punctual":{"light":0}}}])";
  d.roots = "[0,1]";
  d.extra = R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{"innerConeAngle":0.6,
      "outerConeAngle":0.6}}]}},)";
  const LoadedScene loaded = load(d);
  EXPECT_THAT(loaded.warnings, SizeIs(2));  // not of equal angles, which are a sharp edge
  EXPECT_EQ(loaded.scene.materials.at(0).roughness, 1.0F);
  const SpotLight& light = loaded.scene.spot_lights.at(0);
  EXPECT_NEAR(light.inner_degrees, light.outer_degrees, 1e-3F);
  d.materials = "[{}]";
  d.extra = R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{"innerConeAngle":0.7,
      "outerConeAngle":0.6}}]}},)";
  EXPECT_THAT(load(d).warnings, SizeIs(1));
}

TEST_F(GltfVariants, TexturesWithoutAKnownImageAreLeftOut) {
  Document d;
  d.materials = R"([{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])";
  d.extra = R"("textures":[{}],)";
  const LoadedScene loaded = load(d);
  EXPECT_EQ(loaded.scene.materials.at(0).albedo_texture.texture, -1);
  EXPECT_THAT(loaded.warnings, SizeIs(1));
}

TEST_F(GltfVariants, WebpTexturesAreRead) {
  const std::vector<std::uint8_t> pixels = {255, 0, 0, 0, 255, 0};
  std::uint8_t* encoded = nullptr;
  const std::size_t size = WebPEncodeLosslessRGB(pixels.data(), 2, 1, 6, &encoded);
  write("a.webp", {reinterpret_cast<const char*>(encoded), size});
  WebPFree(encoded);
  Document d;
  d.materials = R"([{"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicFactor":0}}])";
  d.extra =
      R"("extensionsUsed":["EXT_texture_webp"],"textures":[{"extensions":{"EXT_texture_webp":{"source":0}}}],
      "images":[{"uri":"a.webp"}],)";
  const LoadedScene loaded = load(d);
  EXPECT_THAT(loaded.warnings, IsEmpty());
  const TextureReference& texture = loaded.scene.materials.at(0).albedo_texture;
  EXPECT_EQ(texture_lookup(loaded.scene, texture, {0.25F, 0.5F}), glm::vec3(1, 0, 0));
  EXPECT_EQ(texture_lookup(loaded.scene, texture, {0.75F, 0.5F}), glm::vec3(0, 1, 0));
}

TEST_F(GltfVariants, ColoursAndNormalTexturesAreTakenOver) {
  Document d;
  // Colours are the positions: (0,0,0) … (1,1,0).
  d.primitives = R"([{"attributes":{"POSITION":0,"COLOR_0":0,"TEXCOORD_0":1},"indices":3,"material":0}])";
  d.materials = R"([{"normalTexture":{"index":0,"scale":0.5},"pbrMetallicRoughness":{"metallicFactor":1}}])";
  d.extra = R"("textures":[{"source":0}],"images":[{"uri":"n.exr"}],)";
  Image image(1, 1, {"R", "G", "B"});
  image.pixels = {0.5F, 0.5F, 1.0F};
  save_image((directory_ / "n.exr").string(), image, PixelFormat::float32);
  const LoadedScene loaded = load(d);
  EXPECT_THAT(loaded.warnings, IsEmpty());
  const Material& m = loaded.scene.materials.at(0);
  EXPECT_EQ(m.normal_scale, 0.5F);
  EXPECT_EQ(texture_lookup(loaded.scene, m.normal_texture, {0.5F, 0.5F}), glm::vec3(0.5F, 0.5F, 1.0F));
  EXPECT_TRUE(m.colors_tint_reflectance);
  const TriangleMesh& mesh = loaded.scene.objects.at(0).mesh;
  ASSERT_EQ(mesh.colors.size(), mesh.positions.size());
  for (std::size_t i = 0; i < mesh.colors.size(); ++i) EXPECT_EQ(mesh.colors[i], mesh.positions[i]);
}

// A file of its own may be named as often as its bytes fit in memory.
TEST_F(GltfVariants, OneImageMayBeNamedOften) {
  Image image(1, 1, {"R", "G", "B"});
  save_image((directory_ / "a.png").string(), image);
  Document d;
  std::string images, textures, materials, primitives;
  for (int i = 0; i < 40; ++i) {
    const std::string comma = i > 0 ? "," : "";
    images += comma + R"({"uri":"a.png"})";
    textures += comma + R"({"source":)" + std::to_string(i) + "}";
    materials +=
        comma + R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":)" + std::to_string(i) + "}}}";
    primitives += comma + R"({"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":3,"material":)" +
                  std::to_string(i) + "}";
  }
  d.materials = "[" + materials + "]";
  d.primitives = "[" + primitives + "]";
  d.extra = R"("textures":[)" + textures + R"(],"images":[)" + images + "],";
  EXPECT_THAT(load(d).scene.objects, SizeIs(40));
}

}  // namespace
}  // namespace mirrorbake
