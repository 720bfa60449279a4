// Files damaged at random, by the entry points that libFuzzer uses too (tests/fuzz): each loads or is a
// FileError.
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "fuzz_targets.hpp"
#include "gltf_files.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/scene/load.hpp"
#include "temporary_files.hpp"

namespace mirrorbake {
namespace {

using DamagedFiles = testing::FileTest;

constexpr char kObj = 0;
constexpr char kGltf = 1;
constexpr char kGlb = 2;

void run(char format, const std::string& bytes,
         int (*entry)(const std::uint8_t*, std::size_t) = fuzz_load_mesh) {
  const std::string input = format + bytes;
  EXPECT_NO_THROW(entry(reinterpret_cast<const std::uint8_t*>(input.data()), input.size()));
}

// Overwrites, removes, repeats or inserts a few bytes; often with characters that mean something in the
// formats.
std::string damaged(std::string bytes, std::mt19937& random) {
  constexpr std::string_view kTelling = "0123456789-+.eE/ \n\r\t{}[]\",:vfnt\\\0\xff";
  const auto below = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  const std::size_t changes = 1 + below(6);
  for (std::size_t i = 0; i < changes && !bytes.empty(); ++i) {
    const std::size_t at = below(bytes.size());
    const char value = below(3) == 0 ? static_cast<char>(below(256)) : kTelling[below(kTelling.size())];
    switch (below(4)) {
      case 0: bytes[at] = value; break;
      case 1: bytes.erase(at, 1 + below(8)); break;
      case 2: bytes.insert(at, bytes.substr(below(bytes.size()), 1 + below(16))); break;
      default: bytes.insert(at, 1, value); break;
    }
  }
  return bytes;
}

const std::string& obj_file() {
  static const std::string text =
      "mtllib a.mtl\no a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\n"
      "usemtl m\nf 1/1/1 2/2/1 3/3/1 4/1/1\nf 1//1 2//1 5//1\nf -5 -4 -1\ng b\nf 1 2 3 4 5\n";
  return text;
}

std::string gltf_json(const std::string& buffer_uri) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"children":[1,2],"scale":[1,2,-1]},
      {"mesh":0,"translation":[1,2,3]},{"mesh":0,"rotation":[0,0,0.6,0.8]}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2},"indices":1,"mode":4}]}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3",
        "sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0}}},
        {"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"},
        {"bufferView":0,"componentType":5126,"count":4,"type":"VEC2"}],
      "bufferViews":[{"buffer":0,"byteLength":48,"byteStride":12},{"buffer":0,"byteOffset":48,"byteLength":12}],
      "buffers":[{)" +
         buffer_uri + R"("byteLength":60}]})";
}

std::string gltf_buffer() {
  return testing::bytes_of(std::vector<float>{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}) +
         testing::bytes_of(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3});
}

TEST_F(DamagedFiles, NeverCrashTheObjReader) {
  std::mt19937 random(1);
  ASSERT_NO_THROW(load_mesh(write("whole.obj", obj_file())));
  for (int i = 0; i < 1500; ++i) run(kObj, damaged(obj_file(), random));
}

TEST_F(DamagedFiles, NeverCrashTheGltfReader) {
  std::mt19937 random(2);
  const std::string file =
      gltf_json("\"uri\":\"data:application/octet-stream;base64," + testing::base64(gltf_buffer()) + "\",");
  ASSERT_NO_THROW(load_mesh(write("whole.gltf", file)));
  for (int i = 0; i < 1500; ++i) run(kGltf, damaged(file, random));
}

TEST_F(DamagedFiles, NeverCrashTheBinaryGltfReader) {
  std::mt19937 random(3);
  const std::string file = testing::glb(gltf_json(""), gltf_buffer());
  run(kGlb, file);
  for (int i = 0; i < 1500; ++i) run(kGlb, damaged(file, random));
}

TEST_F(DamagedFiles, RandomBytesNeverCrashAnyReader) {
  std::mt19937 random(4);
  for (int i = 0; i < 900; ++i) {
    std::string bytes(std::uniform_int_distribution<std::size_t>(0, 400)(random), '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    if (i % 3 == kGlb && i % 2 == 0) bytes = "glTF" + bytes;
    run(static_cast<char>(i % 3), bytes);
  }
}

// A glTF scene with all that the reader knows; its images are `image`.
std::string gltf_scene(const std::string& image) {
  testing::GltfScene scene;
  scene.nodes = R"([{"mesh":0,"children":[1,2,3]},{"mesh":0,"scale":[1,2,-1]},
      {"camera":0,"extensions":{"KHR_lights_punctual":{"light":0}}},{"extensions":{"KHR_lights_punctual":{"light":1}}}])";
  scene.materials = R"([{"name":"m","alphaMode":"MASK","emissiveFactor":[1,1,0],"emissiveTexture":{"index":1},
      "extensions":{"KHR_materials_ior":{"ior":1.4},"KHR_materials_emissive_strength":{"emissiveStrength":5}},
      "pbrMetallicRoughness":{"baseColorFactor":[1,0.5,0.2,1],"metallicFactor":0.5,"roughnessFactor":0.7,
      "baseColorTexture":{"index":0,"texCoord":1,"extensions":{"KHR_texture_transform":{"offset":[1,2],"rotation":1,"scale":[3,4]}}},
      "metallicRoughnessTexture":{"index":0,"texCoord":1,"extensions":{"KHR_texture_transform":{"offset":[1,2],"rotation":1,"scale":[3,4]}}}}}])";
  scene.extra =
      R"("extensionsUsed":["KHR_lights_punctual","VENDOR_x"],"extensions":{"KHR_lights_punctual":{"lights":[
      {"type":"spot","intensity":3,"color":[1,1,0],"spot":{"innerConeAngle":0.1,"outerConeAngle":0.5}},{"type":"directional"}]}},
      "cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.1}}],
      "textures":[{"source":0,"sampler":0},{"source":1}],"samplers":[{"wrapS":33648}],
      "images":[{"uri":"image.png"},{"uri":"data:image/png;base64,)" +
      testing::base64(image) + R"("}],)";
  return scene.json();
}

TEST_F(DamagedFiles, NeverCrashTheReadersOfScenes) {
  Image image(3, 2, {"R", "G", "B"});
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i) / 18.0F;
  save_image((directory_ / "image.png").string(), image);
  std::ifstream in(directory_ / "image.png", std::ios::binary);
  const std::string png{std::istreambuf_iterator<char>(in), {}};
  const std::string library =
      "newmtl m\nKd 0.1 0.2 0.3\nKs 1\nNs 20\nNi 1.5\nillum 3\nKe 1 2 3\nmap_Kd -s 1 2 -o 3 -clamp on "
      "image.png\n"
      "map_Ke image.png\nd 0.5\n";
  const std::string gltf = gltf_scene(png);
  const std::string obj = "mtllib library.mtl\n" + obj_file();
  // What is damaged has to be whole before.
  const std::string whole = write("scene.gltf", gltf);
  ASSERT_EQ(load_scene(whole).scene.textures.size(), 4U);
  write("library.mtl", library);
  ASSERT_EQ(load_scene(write("scene.obj", obj)).scene.textures.size(), 2U);

  std::mt19937 random(5);
  const auto join = [](const std::string& scene, const std::string& mtl, const std::string& bytes) {
    return scene + "\n%%library%%\n" + mtl + "\n%%image%%\n" + bytes;
  };
  for (int i = 0; i < 1200; ++i) {
    run(kGltf, join(i % 4 == 0 ? gltf : damaged(gltf, random), "", i % 4 == 0 ? damaged(png, random) : png),
        fuzz_load_scene);
    run(kObj, join(i % 4 == 1 ? damaged(obj, random) : obj, damaged(library, random), png), fuzz_load_scene);
  }
}

}  // namespace
}  // namespace mirrorbake
