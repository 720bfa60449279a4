#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
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

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Document = testing::GltfScene;

// IEC 61966-2-1.
double linear_from_srgb(int byte) {
  const double v = byte / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

class GltfSceneFile : public testing::FileTest {
 protected:
  // A PNG whose bytes are these.
  std::string png(const std::string& name, int width, int height, const std::vector<int>& bytes) const {
    const int channels = static_cast<int>(bytes.size()) / (width * height);
    Image image(width, height, default_channels(channels));
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      const bool is_alpha = channels == 4 && i % 4 == 3;
      image.pixels[i] = static_cast<float>(is_alpha ? bytes[i] / 255.0 : linear_from_srgb(bytes[i]));
      // save_image takes premultiplied colour.
      if (channels == 4 && !is_alpha) image.pixels[i] *= static_cast<float>(bytes[i / 4 * 4 + 3]) / 255.0F;
    }
    const std::string path = (directory_ / name).string();
    std::filesystem::create_directories((directory_ / name).parent_path());
    save_image(path, image);
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  LoadedScene load(const Document& document, const SceneOptions& options = {}) const {
    return load_scene(write("scene.gltf", document.json()), options);
  }

  Material load_material(const std::string& material, const std::string& extra = "") const {
    Document document;
    document.materials = "[" + material + "]";
    document.extra = extra;
    return load(document).scene.materials.at(0);
  }

  void expect_error(const Document& document, const std::string& message,
                    const SceneOptions& options = {}) const {
    try {
      load(document, options);
      ADD_FAILURE() << "accepted: " << message;
    } catch (const FileError& error) {
      EXPECT_THAT(error.what(), HasSubstr(message));
      EXPECT_THAT(error.what(), HasSubstr(directory_.string()));
    }
  }
};

std::vector<std::string> messages(const LoadedScene& loaded) {
  std::vector<std::string> result;
  for (const SceneWarning& w : loaded.warnings) result.push_back(w.message + " x" + std::to_string(w.count));
  return result;
}

TEST_F(GltfSceneFile, HasOneObjectPerNodeAndMaterialWithUniqueNames) {
  Document document;
  document.materials = R"([{"name":"red"},{"name":"blue"}])";
  document.primitives = R"([{"attributes":{"POSITION":0},"indices":3,"material":1},
      {"attributes":{"POSITION":0},"material":0,"mode":5},{"attributes":{"POSITION":0},"indices":3,"material":1}])";
  document.meshes =
      R"(,{"name":"other","primitives":[{"attributes":{"POSITION":0},"indices":3,"material":0}]})";
  document.nodes = R"([{"mesh":0,"name":"chair"},{"mesh":1,"name":"table","translation":[0,0,5]},{"mesh":1},
      {"mesh":1,"name":"table","scale":[2,2,2]}])";
  document.roots = "[0,1,2,3]";
  const Scene scene = load(document).scene;
  std::vector<std::string> names;
  for (const Object& object : scene.objects) names.push_back(object.name);
  EXPECT_THAT(names, ElementsAre("chair/blue", "chair/red", "table", "other", "table#2"));
  ASSERT_EQ(scene.materials.size(), 2U);
  EXPECT_EQ(scene.materials[static_cast<std::size_t>(scene.objects[0].material)].name, "blue");
  EXPECT_EQ(scene.objects[0].mesh.triangles.size(), 4U);   // two primitives of one material
  EXPECT_EQ(scene.objects[0].mesh.positions.size(), 12U);  // without normals, facets share no vertices
  EXPECT_EQ(scene.objects[2].mesh.positions[2], glm::vec3(1, 1, 5));
  EXPECT_EQ(scene.objects[4].mesh.positions[2], glm::vec3(2, 2, 0));
}

TEST_F(GltfSceneFile, MeshesWithoutAMaterialHaveTheDefaultOne) {
  Document document;
  document.primitives = R"([{"attributes":{"POSITION":0},"indices":3}])";
  const Scene scene = load(document).scene;
  ASSERT_EQ(scene.materials.size(), 1U);
  EXPECT_EQ(scene.materials[0].name, "default");
  // glTF's default is a white metal of roughness 1.
  EXPECT_EQ(scene.materials[0].albedo, glm::vec3(0.0F));
  EXPECT_EQ(scene.materials[0].fresnel.r0, glm::vec3(1.0F));
  EXPECT_EQ(scene.materials[0].roughness, 1.0F);
}

TEST_F(GltfSceneFile, FactorsGiveLambertUnderSchlick) {
  const Material m = load_material(
      R"({"pbrMetallicRoughness":{"baseColorFactor":[0.8,0.4,0.2,1],"metallicFactor":0.25,"roughnessFactor":0.5}})");
  EXPECT_TRUE(m.specular);
  EXPECT_EQ(m.layers, LayerModel::coated);
  EXPECT_EQ(m.fresnel.model, FresnelModel::schlick);
  EXPECT_EQ(m.lobe, SpecularLobe::ggx);
  EXPECT_FLOAT_EQ(m.roughness, 0.25F);
  for (int i = 0; i < 3; ++i) {
    const float base = std::vector<float>{0.8F, 0.4F, 0.2F}[static_cast<std::size_t>(i)];
    EXPECT_NEAR(m.albedo[i], 0.75F * base, 1e-7);
    EXPECT_NEAR(m.fresnel.r0[i], 0.75F * 0.04F + 0.25F * base, 1e-7);
  }
  EXPECT_EQ(m.albedo_texture.texture, -1);
  EXPECT_EQ(m.emission, glm::vec3(0.0F));
}

TEST_F(GltfSceneFile, SmoothMaterialsAreMirrors) {
  const std::string smooth = R"({"pbrMetallicRoughness":{"roughnessFactor":0.03}})";
  EXPECT_EQ(load_material(smooth).lobe, SpecularLobe::mirror);
  EXPECT_EQ(load_material(R"({"pbrMetallicRoughness":{"roughnessFactor":0.1}})").lobe, SpecularLobe::ggx);
}

TEST_F(GltfSceneFile, TheIndexOfRefractionGivesTheDielectricsReflectance) {
  const auto r0 = [&](const std::string& ior) {
    return load_material(
        R"({"pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_ior":{"ior":)" + ior +
        "}}}");
  };
  EXPECT_NEAR(r0("1.33").fresnel.r0.x, std::pow(0.33 / 2.33, 2), 1e-7);
  EXPECT_NEAR(r0("2.42").fresnel.r0.x, std::pow(1.42 / 3.42, 2), 1e-7);
  EXPECT_EQ(r0("0").fresnel.r0.x, 1.0F);
  EXPECT_FALSE(r0("1").specular);
}

TEST_F(GltfSceneFile, EmissionIsFactorTimesStrengthOverEfficacy) {
  Document document;
  document.materials =
      R"([{"emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":40}}}])";
  EXPECT_EQ(load(document).scene.materials[0].emission, glm::vec3(40, 20, 0));
  SceneOptions options;
  options.luminous_efficacy = 4.0F;
  EXPECT_EQ(load(document, options).scene.materials[0].emission, glm::vec3(10, 5, 0));
  const Material unlit = load_material(
      R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0,1]},"extensions":{"KHR_materials_unlit":{}}})");
  EXPECT_EQ(unlit.emission, glm::vec3(0.5F, 0.25F, 0.0F));
  EXPECT_EQ(unlit.albedo, glm::vec3(0.0F));
  EXPECT_FALSE(unlit.specular);
}

TEST_F(GltfSceneFile, ColourImagesAreDecodedFromSrgbWhereverTheyAre) {
  const std::vector<int> texels = {0, 10, 11, 128, 200, 255};
  const std::string bytes = png("maps of it/my colour.png", 2, 1, texels);
  const auto expect_texels = [&](const Scene& scene) {
    const Material& m = scene.materials.at(0);
    ASSERT_EQ(m.albedo_texture.texture, 0);
    const Texture& texture = scene.textures.at(0);
    ASSERT_EQ(texture.image.pixels.size(), texels.size());
    for (std::size_t i = 0; i < texels.size(); ++i) {
      EXPECT_NEAR(texture.image.pixels[i], linear_from_srgb(texels[i]), 1e-6);
    }
    EXPECT_EQ(texture.wrap_u, TextureWrap::mirror);
    EXPECT_EQ(texture.wrap_v, TextureWrap::clamp);
  };
  Document document;
  document.materials =
      R"([{"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicFactor":0,"roughnessFactor":0}}])";
  const std::string textures =
      R"("textures":[{"source":0,"sampler":0}],"samplers":[{"wrapS":33648,"wrapT":33071}],)";
  document.extra =
      textures + R"("images":[{"uri":"data:image/png;base64,)" + testing::base64(bytes) + R"("}],)";
  expect_texels(load(document).scene);
  document.extra = textures + R"("images":[{"uri":"maps%20of%20it/my%20colour.png"}],)";
  expect_texels(load(document).scene);
  document.extra = textures + R"("images":[{"bufferView":4,"mimeType":"image/png"}],)";
  std::string json = document.json();
  const std::string buffers = R"("buffers":[)";
  json.replace(json.find(R"(],)"
                         "\n      " +
                         buffers),
               2, R"(,{"buffer":1,"byteLength":)" + std::to_string(bytes.size()) + "}],");
  json.insert(json.size() - 2, R"(,{"uri":"data:application/octet-stream;base64,)" + testing::base64(bytes) +
                                   R"(","byteLength":)" + std::to_string(bytes.size()) + "}");
  expect_texels(load_scene(write("view.gltf", json)).scene);
}

TEST_F(GltfSceneFile, AlphaDoesNotDarkenTheColour) {
  png("a.png", 1, 1, {200, 100, 50, 128});
  const std::string extra = R"("textures":[{"source":0}],"images":[{"uri":"a.png"}],)";
  Document document;
  document.materials =
      R"([{"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicFactor":0}}])";
  document.extra = extra;
  const LoadedScene loaded = load(document);
  EXPECT_THAT(messages(loaded), ElementsAre());
  const int albedo = loaded.scene.materials.at(0).albedo_texture.texture;
  const Image& image = loaded.scene.textures.at(static_cast<std::size_t>(albedo)).image;
  ASSERT_EQ(image.pixels.size(), 3U);
  // One unit of the 8 bits is up to 0.9 % of these; the test's own premultiplied PNG may be off by one.
  EXPECT_NEAR(image.pixels[0], linear_from_srgb(200), 0.01);
  EXPECT_NEAR(image.pixels[2], linear_from_srgb(50), 0.005);
}

// glTF 2.0 §3.9.4.
TEST_F(GltfSceneFile, AlphaModesDecideWhatBecomesOfAlpha) {
  png("a.png", 2, 1, {200, 100, 50, 51, 10, 20, 30, 204});
  png("opaque.png", 1, 1, {200, 100, 50});
  const auto material = [&](const std::string& mode, const std::string& file) {
    Document document;
    document.materials = "[{" + mode + R"("pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5],
        "baseColorTexture":{"index":0},"metallicFactor":0}}])";
    document.extra = R"("textures":[{"source":0}],"images":[{"uri":")" + file + R"("}],)";
    return load(document).scene;
  };
  const auto opacities = [](const Scene& scene) {
    const Material& m = scene.materials.at(0);
    return std::pair(opacity_at(scene, m, {0.25F, 0.5F}), opacity_at(scene, m, {0.75F, 0.5F}));
  };
  // Alpha is linear: 51/255 and 204/255, times the factor.
  const std::pair blend = opacities(material(R"("alphaMode":"BLEND",)", "a.png"));
  EXPECT_FLOAT_EQ(blend.first, 0.1F);
  EXPECT_FLOAT_EQ(blend.second, 0.4F);
  EXPECT_EQ(opacities(material("", "a.png")), std::pair(1.0F, 1.0F));
  EXPECT_EQ(opacities(material(R"("alphaMode":"OPAQUE",)", "a.png")), std::pair(1.0F, 1.0F));
  EXPECT_EQ(opacities(material(R"("alphaMode":"MASK",)", "a.png")), std::pair(0.0F, 0.0F));
  EXPECT_EQ(opacities(material(R"("alphaMode":"MASK","alphaCutoff":0.25,)", "a.png")), std::pair(0.0F, 1.0F));
  EXPECT_EQ(opacities(material(R"("alphaMode":"MASK","alphaCutoff":1.5,)", "a.png")), std::pair(0.0F, 0.0F));
  const Scene opaque = material(R"("alphaMode":"BLEND",)", "opaque.png");
  EXPECT_EQ(opaque.materials.at(0).opacity_texture.texture, -1);
  EXPECT_EQ(opaque.materials.at(0).opacity, 0.5F);
  Document wrong;
  wrong.materials = R"([{"alphaMode":"GLASS"}])";
  expect_error(wrong, "material 0 alphaMode is 'GLASS', expected OPAQUE, MASK or BLEND");
  wrong.materials = R"([{"alphaMode":"MASK","alphaCutoff":-1}])";
  expect_error(wrong, "material 0 alphaCutoff is -1");
}

TEST_F(GltfSceneFile, MetallicTexturesAreMixedIntoAlbedoAndReflectance) {
  // Roughness is green, metallicity blue, both linear; the images have different sizes.
  const std::vector<int> mr = {0, 255, 0, 0, 128, 128, 0, 64, 255, 0, 0, 51};
  const std::vector<int> base = {200, 100, 50, 30, 60, 90};
  png("mr.png", 4, 1, mr);
  png("base.png", 2, 1, base);
  Document document;
  document.materials =
      R"([{"pbrMetallicRoughness":{"baseColorFactor":[0.5,1,1,1],"baseColorTexture":{"index":0},
      "metallicRoughnessTexture":{"index":1},"metallicFactor":0.75,"roughnessFactor":0.9}}])";
  document.extra =
      R"("textures":[{"source":0},{"source":1}],"images":[{"uri":"base.png"},{"uri":"mr.png"}],)";
  const Scene scene = load(document).scene;
  const Material& m = scene.materials.at(0);
  const glm::vec3 factor(0.5F, 1.0F, 1.0F);
  for (std::size_t x = 0; x < 4; ++x) {
    const double metallic = 0.75 * mr[3 * x + 2] / 255.0;
    const double roughness = 0.9 * mr[3 * x + 1] / 255.0;
    const glm::vec2 uv((static_cast<float>(x) + 0.5F) / 4.0F, 0.5F);
    const glm::vec3 albedo = m.albedo * texture_lookup(scene, m.albedo_texture, uv);
    const glm::vec3 r0 = m.fresnel.r0 * texture_lookup(scene, m.specular_texture, uv);
    EXPECT_NEAR(m.roughness * texture_lookup(scene, m.roughness_texture, uv).x, roughness * roughness, 1e-6);
    // Bilinear between the base colour's two texels, clamped beyond their middles.
    const double t = std::vector<double>{0.0, 0.25, 0.75, 1.0}[x];
    for (int c = 0; c < 3; ++c) {
      const std::size_t channel = static_cast<std::size_t>(c);
      const double colour = static_cast<double>(factor[c]) * ((1.0 - t) * linear_from_srgb(base[channel]) +
                                                              t * linear_from_srgb(base[3 + channel]));
      EXPECT_NEAR(albedo[c], colour * (1.0 - metallic), 1e-6);
      EXPECT_NEAR(r0[c], 0.04 * (1.0 - metallic) + colour * metallic, 1e-6);
    }
  }
}

TEST_F(GltfSceneFile, MetalsUseTheColourAsReflectanceWithoutACopy) {
  png("base.png", 1, 1, {200, 100, 50});
  const std::string extra = R"("textures":[{"source":0}],"images":[{"uri":"base.png"}],)";
  const Material metal = load_material(
      R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,1,1,1],"baseColorTexture":{"index":0}}})", extra);
  EXPECT_EQ(metal.albedo, glm::vec3(0.0F));
  EXPECT_EQ(metal.albedo_texture.texture, -1);
  EXPECT_EQ(metal.fresnel.r0, glm::vec3(0.5F, 1.0F, 1.0F));
  EXPECT_EQ(metal.specular_texture.texture, 0);
}

TEST_F(GltfSceneFile, TextureTransformsAndSetsOfCoordinatesAreKept) {
  png("a.png", 1, 1, {200, 100, 50});
  Document document;
  document.materials =
      R"([{"pbrMetallicRoughness":{"metallicFactor":0,"baseColorTexture":{"index":0,"texCoord":0,"extensions":
      {"KHR_texture_transform":{"offset":[0.25,0.5],"rotation":0.7,"scale":[2,3],"texCoord":1}}}},
      "emissiveFactor":[1,1,1],"emissiveTexture":{"index":0}}])";
  document.extra = R"("textures":[{"source":0}],"images":[{"uri":"a.png"}],)";
  const LoadedScene loaded = load(document);
  const TextureReference& reference = loaded.scene.materials.at(0).albedo_texture;
  EXPECT_EQ(reference, (TextureReference{0, {0.25F, 0.5F}, {2, 3}, 0.7F}));
  EXPECT_EQ(loaded.scene.materials[0].emission_texture, (TextureReference{0, {}, glm::vec2(1.0F), 0.0F}));
  // Set 1 is twice set 0; v is counted upwards here.
  EXPECT_EQ(loaded.scene.objects.at(0).mesh.uvs.at(1), glm::vec2(2.0F, -1.0F));
  EXPECT_THAT(messages(loaded), ElementsAre(HasSubstr("several sets of texture coordinates")));
}

TEST_F(GltfSceneFile, OriginIsSubtractedBeforeRounding) {
  Document document;
  // A node of a node: offsets that floats cannot hold at 1e7 add up in double precision.
  document.nodes =
      R"([{"translation":[10000000,0,-5000000],"children":[1,2,3]},
      {"mesh":0,"translation":[0.125,0.01,0.25]},
      {"translation":[0.5,0.01,0.125],"extensions":{"KHR_lights_punctual":{"light":0}}},
      {"translation":[0.75,0.02,0.375],"camera":0}])";
  document.roots = "[0]";
  document.extra = R"("extensionsUsed":["KHR_lights_punctual"],
      "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":8}]}},
      "cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.1}}],)";
  document.materials = "[{}]";
  SceneOptions options;
  options.origin = {1e7, 0.0, -5e6};
  const LoadedScene loaded = load(document, options);
  EXPECT_LT(glm::distance(loaded.scene.objects.at(0).mesh.positions.at(0), glm::vec3(0.125F, 0.01F, 0.25F)),
            1e-7F);
  EXPECT_LT(glm::distance(loaded.scene.point_lights.at(0).position, glm::vec3(0.5F, 0.01F, 0.125F)), 1e-7F);
  EXPECT_LT(glm::distance(loaded.cameras.at(0).eye, glm::vec3(0.75F, 0.02F, 0.375F)), 1e-7F);
}

TEST_F(GltfSceneFile, LightsShineAlongTheirNodes) {
  Document document;
  document.materials = "[{}]";
  // Turned by 90° about x, −Z points up; then scaled, which does not change a light.
  document.nodes =
      R"([{"mesh":0},{"rotation":[0.70710678,0,0,0.70710678],"scale":[3,3,3],"translation":[1,2,3],
      "extensions":{"KHR_lights_punctual":{"light":0}}},
      {"translation":[4,5,6],"extensions":{"KHR_lights_punctual":{"light":1}}},
      {"extensions":{"KHR_lights_punctual":{"light":2}}}])";
  document.roots = "[0,1,2,3]";
  document.extra = R"("extensionsUsed":["KHR_lights_punctual"],"extensions":{"KHR_lights_punctual":{"lights":[
      {"type":"spot","intensity":10,"color":[1,0.5,0],"spot":{"innerConeAngle":0.2,"outerConeAngle":0.6}},
      {"type":"point","intensity":8},{"type":"directional","intensity":4,"color":[0.5,1,1]}]}},)";
  SceneOptions options;
  options.luminous_efficacy = 2.0F;
  const Scene scene = load(document, options).scene;
  ASSERT_EQ(scene.spot_lights.size(), 1U);
  const SpotLight& spot = scene.spot_lights[0];
  EXPECT_EQ(spot.position, glm::vec3(1, 2, 3));
  EXPECT_LT(glm::distance(spot.direction, glm::vec3(0, 1, 0)), 1e-6F);
  EXPECT_EQ(spot.intensity, glm::vec3(5, 2.5F, 0));
  EXPECT_NEAR(spot.inner_degrees, 0.2 * 180.0 / 3.14159265, 1e-5);
  EXPECT_NEAR(spot.outer_degrees, 0.6 * 180.0 / 3.14159265, 1e-5);
  ASSERT_EQ(scene.point_lights.size(), 1U);
  EXPECT_EQ(scene.point_lights[0].position, glm::vec3(4, 5, 6));
  EXPECT_EQ(scene.point_lights[0].intensity, glm::vec3(4.0F));
  ASSERT_EQ(scene.directional_lights.size(), 1U);
  EXPECT_EQ(scene.directional_lights[0].direction, glm::vec3(0, 0, -1));
  EXPECT_EQ(scene.directional_lights[0].irradiance, glm::vec3(1, 2, 2));
}

TEST_F(GltfSceneFile, CamerasAreViewpoints) {
  Document document;
  document.materials = "[{}]";
  document.nodes =
      R"([{"mesh":0},{"name":"eye","camera":0,"translation":[1,2,3],"rotation":[0,0.70710678,0,0.70710678]},
      {"camera":1}])";
  document.roots = "[0,1,2]";
  document.extra = R"("cameras":[{"type":"perspective","perspective":{"yfov":0.5,"znear":0.1}},
      {"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"zfar":9,"znear":1}}],)";
  const LoadedScene loaded = load(document);
  ASSERT_EQ(loaded.cameras.size(), 1U);
  const SceneCamera& camera = loaded.cameras[0];
  EXPECT_EQ(camera.name, "eye");
  EXPECT_EQ(camera.eye, glm::vec3(1, 2, 3));
  EXPECT_LT(glm::distance(camera.direction, glm::vec3(-1, 0, 0)), 1e-6F);  // −Z turned by 90° about +Y
  EXPECT_LT(glm::distance(camera.up, glm::vec3(0, 1, 0)), 1e-6F);
  EXPECT_NEAR(camera.vertical_fov_degrees, 0.5 * 180.0 / 3.14159265, 1e-5);
  EXPECT_THAT(messages(loaded), ElementsAre(HasSubstr("cameras other than perspective ones")));
}

TEST_F(GltfSceneFile, UnknownExtensionsAreCountedUnlessTheyAreRequired) {
  Document document;
  document.materials = R"([{"occlusionTexture":{"index":0}},{"occlusionTexture":{"index":0}}])";
  document.primitives = R"([{"attributes":{"POSITION":0},"indices":3,"material":0},
      {"attributes":{"POSITION":0},"indices":3,"material":1}])";
  document.extra = R"("extensionsUsed":["KHR_texture_transform","KHR_materials_clearcoat"],)";
  EXPECT_THAT(messages(load(document)),
              ElementsAre("the extension KHR_materials_clearcoat is not supported x1",
                          "occlusion textures are not used: the ray tracer finds what is occluded x2"));
  document.extra += R"("extensionsRequired":["KHR_materials_clearcoat"],)";
  expect_error(document, "requires the extension KHR_materials_clearcoat");
}

// What a defective file says, and part of the message.
struct Defect {
  std::string message;
  std::function<void(Document&)> make;
};

class GltfSceneDefects : public GltfSceneFile {
 protected:
  void expect_named(const std::vector<Defect>& defects) {
    for (const Defect& defect : defects) {
      Document document;
      document.materials = "[{}]";
      defect.make(document);
      expect_error(document, defect.message);
    }
  }
};

TEST_F(GltfSceneDefects, OfMaterialsAndTexturesAreNamed) {
  const auto material = [](const std::string& text) {
    return [text](Document& d) { d.materials = "[" + text + "]"; };
  };
  const auto texture = [](const std::string& extra) {
    return [extra](Document& d) {
      d.materials = R"([{"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicFactor":0}}])";
      d.extra = extra;
    };
  };
  write("text.png", "no image");
  const std::vector<Defect> defects = {
      {"material index is 0, the file has 0", [](Document& d) { d.materials = "[]"; }},
      {"baseColorFactor is (-", material(R"({"pbrMetallicRoughness":{"baseColorFactor":[-1,0,0,1]}})")},
      {"emission is (0, -1", material(R"({"emissiveFactor":[0,-1,0]})")},
      {"emission is (inf", material(R"({"emissiveFactor":[1e300,0,0]})")},
      {"emission is (-", material(R"({"emissiveFactor":[1,1,1],"extensions":
          {"KHR_materials_emissive_strength":{"emissiveStrength":-2}}})")},
      {"emissiveStrength is not a finite number", material(R"({"emissiveFactor":[1,1,1],"extensions":
          {"KHR_materials_emissive_strength":{"emissiveStrength":"much"}}})")},
      {"ior is 0.5", material(R"({"extensions":{"KHR_materials_ior":{"ior":0.5}}})")},
      {"base colour texture index is 7",
       material(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":7}}})")},
      {"base colour texture index is -2",
       material(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":-2}}})")},
      {"emissive texture index is 7",
       material(R"({"emissiveFactor":[1,1,1],"emissiveTexture":{"index":7}})")},
      {"base colour image index is 3", texture(R"("textures":[{"source":3}],)")},
      {"base colour sampler index is 5",
       texture(R"("textures":[{"source":0,"sampler":5}],"images":[{"uri":"text.png"}],)")},
      {"wrap mode is 12", texture(R"("textures":[{"source":0,"sampler":0}],"samplers":[{"wrapS":12}],
          "images":[{"uri":"text.png"}],)")},
      {"text.png: is not an EXR", texture(R"("textures":[{"source":0}],"images":[{"uri":"text.png"}],)")},
      {"missing.png: does not exist",
       texture(R"("textures":[{"source":0}],"images":[{"uri":"missing.png"}],)")},
      {"'../text.png', which is not inside",
       texture(R"("textures":[{"source":0}],"images":[{"uri":"../text.png"}],)")},
      {"%2e/x.png: does not exist",
       texture(R"("textures":[{"source":0}],"images":[{"uri":"%252e/x.png"}],)")},
      {"'/etc/passwd', which is not inside",
       texture(R"("textures":[{"source":0}],"images":[{"uri":"/etc/passwd"}],)")},
      {"image 0: is not an EXR",
       texture(R"("textures":[{"source":0}],"images":[{"bufferView":0,"mimeType":"image/png"}],)")},
      {"bufferView \"99\" not found",
       texture(R"("textures":[{"source":0}],"images":[{"bufferView":99,"mimeType":"image/png"}],)")},
      {"scale is not two finite numbers", material(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0,
          "extensions":{"KHR_texture_transform":{"scale":[1]}}}}}],"textures":[{"source":0}],
          "images":[{"uri":"text.png"}],"x":[0)")},
      {"rotation is not a finite number", material(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0,
          "extensions":{"KHR_texture_transform":{"rotation":[1]}}}}}],"textures":[{"source":0}],
          "images":[{"uri":"text.png"}],"x":[0)")},
      {"texCoord is negative",
       material(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":-3}}}],
          "textures":[{"source":0}],"images":[{"uri":"text.png"}],"x":[0)")},
  };
  expect_named(defects);
}

TEST_F(GltfSceneDefects, OfLightsCamerasAndNodesAreNamed) {
  const auto light = [](const std::string& node, const std::string& text) {
    return [=](Document& d) {
      d.nodes = R"([{"mesh":0},{)" + node + R"("extensions":{"KHR_lights_punctual":{"light":0}}}])";
      d.roots = "[0,1]";
      d.extra = R"("extensions":{"KHR_lights_punctual":{"lights":[)" + text + "]}},";
    };
  };
  const auto camera = [](const std::string& node, const std::string& yfov) {
    return [=](Document& d) {
      d.nodes = R"([{"mesh":0},{"camera":0)" + node + "}]";
      d.roots = "[0,1]";
      d.extra = R"("cameras":[{"type":"perspective","perspective":{"yfov":)" + yfov + R"(,"znear":1}}],)";
    };
  };
  const std::vector<Defect> defects = {
      {"light index is -1", light("", "")},
      {"type is 'laser'", light("", R"({"type":"laser"})")},
      {"intensity is (-", light("", R"({"type":"point","intensity":-1})")},
      {"color is not three numbers", light("", R"({"type":"point","color":[1,1]})")},
      {"cone angles are",
       light("", R"({"type":"spot","spot":{"innerConeAngle":-0.1,"outerConeAngle":0.6}})")},
      {"cone angles are", light("", R"({"type":"spot","spot":{"outerConeAngle":0}})")},
      {"has no direction", light(R"("scale":[0,0,0],)", R"({"type":"directional"})")},
      {"beyond 1e12", light(R"("translation":[1e13,0,0],)", R"({"type":"point"})")},
      {"yfov is 0", camera("", "0")},
      {"yfov is 3.2", camera("", "3.2")},
      {"has no direction", camera(R"(,"scale":[1,1,0])", "1")},
      {"flat camera", camera(R"(,"matrix":[1,0,0,0, 0,0,1,0, 0,0,1,0, 0,0,0,1])", "1")},
      {"reached twice", [](Document& d) { d.nodes = R"([{"mesh":0,"children":[1]},{"children":[0]}])"; }},
  };
  expect_named(defects);
}

TEST_F(GltfSceneFile, ImagesThatClaimMoreThanTheirBytesAreRefusedBeforeAnyIsAllocated) {
  // The header of a PNG of 16384 × 16384 pixels of 16-bit RGBA, its checksum right, and no pixels.
  std::string header = png("small.png", 1, 1, {1, 2, 3});
  const auto put = [&](std::size_t at, std::uint32_t value) {
    for (std::size_t k = 0; k < 4; ++k) header[at + k] = static_cast<char>(value >> (24 - 8 * k));
  };
  put(16, 16384);
  put(20, 16384);
  header[24] = 16;
  header[25] = 6;
  std::uint32_t crc = ~0U;
  for (std::size_t i = 12; i < 29; ++i) {
    crc ^= static_cast<unsigned char>(header[i]);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (0xEDB88320U & (0U - (crc & 1U)));
  }
  put(29, ~crc);
  write("bomb.png", header);
  Document document;
  document.materials = R"([{"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicFactor":0}}])";
  document.extra = R"("textures":[{"source":0}],"images":[{"uri":"bomb.png"}],)";
  // OpenImageIO 3 refuses it by itself, in its own words.
  expect_error(document, "claims ");
}

TEST_F(GltfSceneFile, DecodedTexturesStayWithinTheLimits) {
  png("a.png", 64, 64, std::vector<int>(64 * 64 * 3, 7));
  Document document;
  document.materials = R"([{"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicFactor":0}},
      {"pbrMetallicRoughness":{"baseColorTexture":{"index":1},"metallicFactor":0}}])";
  document.primitives = R"([{"attributes":{"POSITION":0},"indices":3,"material":0},
      {"attributes":{"POSITION":0},"indices":3,"material":1}])";
  document.extra = R"("textures":[{"source":0},{"source":1}],"images":[{"uri":"a.png"},{"uri":"a.png"}],)";
  SceneOptions options;
  options.max_texture_bytes = 2 * 64 * 64 * 3 * sizeof(float);
  EXPECT_EQ(load(document, options).scene.textures.size(), 2U);
  options.max_texture_bytes -= 1;
  expect_error(document, "a.png: is too large", options);
  options = {};
  options.max_texture_side = 63;
  expect_error(document, "a.png: is too large: 64 x 64", options);
}

TEST_F(GltfSceneFile, ImagesThatAreOnlyMixedIntoOthersDoNotCount) {
  png("a.png", 64, 64, std::vector<int>(64 * 64 * 3, 100));
  Document document;
  document.materials = R"([{"pbrMetallicRoughness":{"baseColorTexture":{"index":0},
      "metallicRoughnessTexture":{"index":0}}}])";
  document.extra = R"("textures":[{"source":0}],"images":[{"uri":"a.png"}],)";
  SceneOptions options;
  // Albedo and reflectance of three channels, roughness of one, and two images to make them from.
  options.max_texture_bytes = (3 + 3 + 1 + 3 + 3) * 64 * 64 * sizeof(float);
  EXPECT_EQ(load(document, options).scene.textures.size(), 3U);
  options.max_texture_bytes = (3 + 3 + 3 + 3) * 64 * 64 * sizeof(float) - 1;
  expect_error(document, "limit on decoded textures", options);
}

TEST_F(GltfSceneFile, AChainOfAHundredThousandNodesIsNoRecursion) {
  Document document;
  document.materials = "[{}]";
  document.nodes = "[";
  constexpr int kNodes = 100'000;
  for (int i = 0; i + 1 < kNodes; ++i) document.nodes += R"({"children":[)" + std::to_string(i + 1) + "]},";
  document.nodes += R"({"mesh":0}])";
  EXPECT_EQ(load(document).scene.objects.size(), 1U);
}

TEST_F(GltfSceneFile, OneFileIsNotReadOverAndOver) {
  std::filesystem::resize_file(write("big.bin", ""), 1 << 26);  // takes no room on the disk
  Document document;
  document.materials = "[{}]";
  for (int i = 0; i < 6; ++i)
    document.extra += i == 0 ? R"("images":[{"uri":"big.bin"})" : R"(,{"uri":"big.bin"})";
  document.extra += "],";
  expect_error(document, "refers to one file so often");
}

TEST(LoadScene, RefusesOptionsOutOfRange) {
  SceneOptions options;
  options.max_texture_side = 0;
  EXPECT_THROW(load_scene("a.gltf", options), InvalidArgument);
  options = {};
  options.luminous_efficacy = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(load_scene("a.gltf", options), InvalidArgument);
  EXPECT_THROW(load_scene("a.stl"), FileError);
}

}  // namespace
}  // namespace mirrorbake
