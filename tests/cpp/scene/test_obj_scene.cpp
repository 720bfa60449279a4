#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/scene/load.hpp"
#include "temporary_files.hpp"

namespace mirrorbake {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kTriangles =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\n"
    "o left\nusemtl red\nf 1/1 2/2 3/3\no right\nusemtl red\nf 1 3 4\nusemtl shiny\nf 1 4 2\n"
    "o left\nf 2 3 4\n";

class ObjSceneFile : public testing::FileTest {
 protected:
  LoadedScene load(const std::string& library, const std::string& triangles = kTriangles) const {
    write("my scene.mtl", library);
    return load_scene(write("scene.obj", "mtllib my scene.mtl\n" + triangles));
  }
  Material red(const std::string& definition) const {
    return load("newmtl red\n" + definition + "\nnewmtl shiny\n").scene.materials.at(0);
  }
  void expect_error(const std::string& library, const std::string& message) const {
    try {
      load(library);
      ADD_FAILURE() << "accepted: " << message;
    } catch (const FileError& error) {
      EXPECT_THAT(error.what(), HasSubstr(message));
    }
  }
};

std::vector<std::string> messages(const LoadedScene& loaded) {
  std::vector<std::string> result;
  for (const SceneWarning& w : loaded.warnings) result.push_back(w.message + " x" + std::to_string(w.count));
  return result;
}

// Floats at 1e7 are whole numbers: whatever is left of a hundredth was subtracted before rounding.
TEST_F(ObjSceneFile, OriginIsSubtractedBeforeRounding) {
  const std::string path = write("far.obj",
                                 "v 10000000.25 0 -5000000.5\nv 10000001.25 0.01 -5000000.5\n"
                                 "v 10000000.25 1 -5000000.49\nf 1 2 3\n");
  SceneOptions options;
  options.origin = {1e7, 0.0, -5e6};
  for (const TriangleMesh& mesh :
       {load_scene(path, options).scene.objects.at(0).mesh, load_mesh(path, {}, options.origin)}) {
    ASSERT_EQ(mesh.positions.size(), 3U);
    EXPECT_LT(glm::distance(mesh.positions[0], glm::vec3(0.25F, 0, -0.5F)), 1e-7F);
    EXPECT_LT(glm::distance(mesh.positions[1], glm::vec3(1.25F, 0.01F, -0.5F)), 1e-7F);
    EXPECT_LT(glm::distance(mesh.positions[2], glm::vec3(0.25F, 1, -0.49F)), 1e-7F);
  }
  options.origin.y = 2e12;
  EXPECT_THROW(load_scene(path, options), InvalidArgument);
  EXPECT_THROW(load_mesh(path, {}, options.origin), InvalidArgument);
}

TEST_F(ObjSceneFile, HasOneObjectPerNameAndMaterial) {
  const LoadedScene loaded = load("newmtl red\nKd 1 0 0\nnewmtl shiny\nKd 0 0 1\n");
  const Scene& scene = loaded.scene;
  std::vector<std::pair<std::string, std::string>> found;
  for (const Object& o : scene.objects) {
    found.emplace_back(o.name, scene.materials.at(static_cast<std::size_t>(o.material)).name);
  }
  // The last face comes back to the object "left" with the material in force, shiny.
  EXPECT_THAT(found, ElementsAre(std::pair("left/red", "red"), std::pair("right/red", "red"),
                                 std::pair("right/shiny", "shiny"), std::pair("left/shiny", "shiny")));
  EXPECT_EQ(scene.objects[0].mesh.triangles.size(), 1U);
  EXPECT_EQ(scene.objects[0].mesh.uvs.at(1), glm::vec2(1, 0));
  EXPECT_THAT(loaded.warnings, IsEmpty());
}

TEST_F(ObjSceneFile, KdIsLambertAndKsWithNsAPhongLobe) {
  const Material m = red("Kd 0.5 0.25 0.125\nKs 0.3 0.2 0.1\nNs 96\nNi 1.5\nillum 2\nKe 1 2 3\nKa 9 9 9");
  EXPECT_EQ(m.albedo, glm::vec3(0.5F, 0.25F, 0.125F));
  EXPECT_TRUE(m.specular);
  EXPECT_EQ(m.lobe, SpecularLobe::phong);
  EXPECT_EQ(m.exponent, 96.0F);
  EXPECT_EQ(m.fresnel.model, FresnelModel::constant);
  EXPECT_EQ(m.fresnel.r0, glm::vec3(0.3F, 0.2F, 0.1F));
  EXPECT_EQ(m.layers, LayerModel::additive);
  EXPECT_EQ(m.emission, glm::vec3(1, 2, 3));
  EXPECT_EQ(red("Ks 1\nNs 0").exponent, 1.0F);
  EXPECT_EQ(red("Ks 1").fresnel.r0, glm::vec3(1.0F));
  EXPECT_FALSE(red("Ks 1\nillum 1").specular);
  EXPECT_FALSE(red("Ks 0 0 0\nNs 10").specular);
  EXPECT_EQ(red("").albedo, glm::vec3(0.5F));
}

TEST_F(ObjSceneFile, IlluminationModels3And5AreMirrors) {
  const Material constant = red("Ks 0.9\nNs 20\nillum 3");
  EXPECT_EQ(constant.lobe, SpecularLobe::mirror);
  EXPECT_EQ(constant.fresnel.model, FresnelModel::constant);
  EXPECT_EQ(constant.fresnel.r0, glm::vec3(0.9F));
  EXPECT_EQ(red("Ks 0.9\nillum 5").fresnel.model, FresnelModel::schlick);
  const Material glass = red("Ks 0 0 0\nNi 1.33\nillum 5");
  EXPECT_TRUE(glass.specular);
  EXPECT_EQ(glass.lobe, SpecularLobe::mirror);
  EXPECT_EQ(glass.fresnel.model, FresnelModel::dielectric);
  EXPECT_EQ(glass.fresnel.eta, glm::vec3(1.33F));
}

TEST_F(ObjSceneFile, MapsAreReadWithTheirTransform) {
  Image image(2, 1, {"R", "G", "B"});
  image.pixels = {0.25F, 0.5F, 1.0F, 0.0F, 2.0F, 4.0F};
  save_image((directory_ / "glow map.exr").string(), image, PixelFormat::float32);
  image.pixels = {0.0F, 0.5F, 1.0F, 1.0F, 0.0F, 0.0F};
  std::filesystem::create_directories(directory_ / "maps");
  save_image((directory_ / "maps/colour.png").string(), image);
  const LoadedScene loaded = load(
      "newmtl red\nmap_Kd -s 2 3 1 -o 0.25 0.5 -blendu on maps\\colour.png\nKs 1\nmap_Ks -clamp on "
      "maps/colour.png\n"
      "Ke 1 1 1\nmap_Ke glow map.exr\nnewmtl shiny\nmap_Kd -s 4 maps/colour.png\n");
  const Scene& scene = loaded.scene;
  const Material& m = scene.materials.at(0);
  EXPECT_EQ(m.albedo, glm::vec3(1.0F));
  // u' = 2u + 0.25, v' = 3v + 0.5.
  const glm::vec2 uv = texture_coordinates(m.albedo_texture, {0.3F, 0.1F});
  EXPECT_NEAR(uv.x, 0.85, 1e-6);
  EXPECT_NEAR(uv.y, 0.8, 1e-6);
  EXPECT_NEAR(texture_lookup(scene, m.albedo_texture, {0.0F, 0.0F}).y, 0.5, 0.004);  // 8 bits
  const Texture& specular = scene.textures.at(static_cast<std::size_t>(m.specular_texture.texture));
  EXPECT_EQ(specular.wrap_u, TextureWrap::clamp);
  // Textures are at most 1: the largest value goes to the factor.
  EXPECT_EQ(m.emission, glm::vec3(4.0F));
  EXPECT_EQ(m.emission * texture_lookup(scene, m.emission_texture, {0.75F, 0.5F}), glm::vec3(0, 2, 4));
  // An image that is used in the same way is in memory once.
  EXPECT_EQ(scene.materials.at(1).albedo_texture.texture, m.albedo_texture.texture);
  EXPECT_EQ(scene.textures.size(), 3U);
  EXPECT_THAT(loaded.warnings, IsEmpty());
}

TEST_F(ObjSceneFile, DissolveIsTheOpacity) {
  EXPECT_EQ(red("Kd 1 1 1").opacity, 1.0F);
  EXPECT_EQ(red("d 0.25").opacity, 0.25F);
  EXPECT_EQ(red("Tr 0.25").opacity, 0.75F);
  // Exporters disagree on Tr; what they say with d counts, in any order.
  EXPECT_EQ(red("d 1\nTr 1").opacity, 1.0F);
  EXPECT_EQ(red("Tr 0\nd 0.5").opacity, 0.5F);
  EXPECT_FALSE(red("d 0.5").opacity_cutoff);
  EXPECT_EQ(red("Tr 0.5 0.25 0").opacity, 0.75F);  // as a colour: their mean
}

TEST_F(ObjSceneFile, DissolveMapsAreAlphaOrElseGrey) {
  Image grey(2, 1, {"Y"});
  grey.pixels = {0.25F, 1.0F};
  save_image((directory_ / "grey.exr").string(), grey);
  Image leaf(2, 1, {"R", "G", "B", "A"});
  leaf.pixels = {0.5F, 0.5F, 0.5F, 0.75F, 0.0F, 0.0F, 0.0F, 0.0F};
  save_image((directory_ / "leaf.exr").string(), leaf);
  Image opaque(1, 1, {"Y"});
  opaque.pixels = {1.0F};
  save_image((directory_ / "opaque.exr").string(), opaque);
  const auto opacities = [](const Scene& scene) {
    const Material& m = scene.materials.at(0);
    return std::pair(opacity_at(scene, m, {0.25F, 0.5F}), opacity_at(scene, m, {0.75F, 0.5F}));
  };
  EXPECT_EQ(opacities(load("newmtl red\nmap_d grey.exr\n").scene), std::pair(0.25F, 1.0F));
  EXPECT_EQ(opacities(load("newmtl red\nd 0.5\nmap_d grey.exr\n").scene), std::pair(0.125F, 0.5F));
  EXPECT_EQ(opacities(load("newmtl red\nmap_d leaf.exr\n").scene), std::pair(0.75F, 0.0F));
  EXPECT_FALSE(has_gaps(load("newmtl red\nmap_d opaque.exr\n").scene.materials.at(0)));
}

TEST_F(ObjSceneFile, WhatIsLostIsCounted) {
  const LoadedScene loaded = load("newmtl red\nmap_Bump bump.png\nKd 2 1 1\nnewmtl shiny\nillum 7\nKs 1\n");
  EXPECT_THAT(
      messages(loaded),
      ElementsAre(
          "MTL keyword map_Bump is not supported x1", "material 'red' Kd: values above 1 are taken as 1 x1",
          "MTL illumination models with refraction (4, 6, 7, 9) are not supported: nothing is refracted x1"));
  const LoadedScene bare = load_scene(write("bare.obj", std::string("mtllib gone.mtl\n") + kTriangles));
  EXPECT_THAT(messages(bare),
              ElementsAre("the material library 'gone.mtl' does not exist x1",
                          "the material 'red' is not defined x1", "the material 'shiny' is not defined x1"));
}

// As every loader does: the line is lost, the scene is not.
TEST_F(ObjSceneFile, OddLinesOfALibraryAreWarnings) {
  const std::vector<std::pair<std::string, std::string>> lines = {
      {"Kd 1 1 1\nnewmtl red", "Kd '1 1 1', expected newmtl first"},
      {"newmtl red\nKd 1 nan 1", "Kd '1 nan 1', expected one or three finite numbers"},
      {"newmtl red\nKd 1 1", "Kd '1 1'"},
      {"newmtl red\nKd spectral file.rfl", "Kd 'spectral file.rfl'"},
      {"newmtl red\nKs -1 0 0", "Ks '-1 0 0'"},
      {"newmtl red\nKe inf 0 0", "Ke 'inf 0 0'"},
      {"newmtl red\nNs 1e99", "Ns '1e99', expected one finite number"},
      {"newmtl red\nNi 0", "Ni '0', expected a refractive index above 0"},
      {"newmtl red\nillum 99", "illum '99', expected 0 to 10"},
      {"newmtl red\nd 1.5", "MTL d: values above 1 are taken as 1"},
      {"newmtl red\nTr nan", "Tr 'nan'"},
      {"newmtl red\nmap_Kd", "expected the name of an image"},
      {"newmtl red\nmap_Kd -s x a.png", "expected a number after -s"},
      {"newmtl red\nmap_Kd gone.png", "the image 'gone.png' does not exist"},
      {"newmtl red\nmap_Kd ../text.png", "'../text.png' is not inside the file's own directory"},
      {"newmtl red\nmap_Kd /etc/passwd", "'/etc/passwd' is not inside"}};
  for (const auto& [text, expected] : lines) {
    const LoadedScene loaded = load(text + "\nnewmtl shiny\n");
    ASSERT_EQ(loaded.warnings.size(), 1U) << text;
    EXPECT_THAT(loaded.warnings[0].message, HasSubstr(expected));
    EXPECT_EQ(loaded.scene.materials[0].albedo_texture.texture, -1);
  }
  const LoadedScene outside =
      load_scene(write("escape.obj", std::string("mtllib ../other.mtl\n") + kTriangles));
  EXPECT_THAT(outside.warnings.at(0).message, HasSubstr("'../other.mtl' is not inside"));
}

TEST_F(ObjSceneFile, AnImageOfAKindThatIsNotReadIsAWarning) {
  write("paint.TGA", "pixels");
  const LoadedScene loaded = load("newmtl red\nmap_Kd paint.TGA\nmap_d paint.TGA\n");
  EXPECT_THAT(messages(loaded), ::testing::Contains(HasSubstr("'paint.TGA' is no EXR, HDR")));
  EXPECT_EQ(loaded.scene.materials.at(0).albedo_texture.texture, -1);
}

TEST_F(ObjSceneFile, ADamagedImageIsAnError) {
  write("text.png", "no image");
  expect_error("newmtl red\nmap_Kd text.png\n", "text.png: is not an EXR");
}

TEST_F(ObjSceneFile, NamesMayHaveSpacesAroundThemAndOptionsBehind) {
  Image image(2, 1, {"R", "G", "B"});
  save_image((directory_ / "my map.png").string(), image);
  const LoadedScene loaded = load("\xef\xbb\xbfnewmtl \t red\nmap_Kd my map.png -s 2 3 1\nnewmtl shiny \n");
  EXPECT_THAT(loaded.warnings, IsEmpty());
  EXPECT_EQ(loaded.scene.materials.at(0).albedo_texture.scale, glm::vec2(2, 3));
  const std::string path =
      write("names.obj", std::string("mtllib .\\lib\\a.mtl\nusemtl  \tred \n") + kTriangles);
  write("lib/a.mtl", "newmtl red\nKd 1 0 0\n");
  EXPECT_EQ(load_scene(path).scene.materials.at(0).name, "red");
}

// The white of Rec. 709 is (0.9505, 1, 1.0891) in XYZ (IEC 61966-2-1).
TEST_F(ObjSceneFile, ColoursInXyzBecomeRec709) {
  const Material m = red("Kd xyz 0.47525 0.5 0.54455");
  EXPECT_LT(glm::length(m.albedo - glm::vec3(0.5F)), 1e-3F);
}

TEST_F(ObjSceneFile, GroupsAreTheObjectsWhereNoneIsNamed) {
  const std::string quad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  const auto names = [&](const std::string& text) {
    std::vector<std::string> result;
    for (const Object& object : load_scene(write("g.obj", quad + text)).scene.objects)
      result.push_back(object.name);
    return result;
  };
  EXPECT_THAT(names("g body\nf 1 2 3\ng lid top\nf 1 3 4\n"), ElementsAre("body", "lid top"));
  EXPECT_THAT(names("g body\nf 1 2 3\no all\ng lid\nf 1 3 4\n"), ElementsAre("object", "all"));
}

TEST_F(ObjSceneFile, WhatIsNoTriangleIsCountedAndColoursAreKept) {
  const LoadedScene loaded = load_scene(
      write("v.obj",
            "v 0 0 0 1 0 0\nv 1 0 0 0 0.5 0\nv 1 1 0\nl 1 2\nl 2 3\np 1\ncurv 0 1 1 2 3\nf 1 2\nf 1 2 3\n"));
  EXPECT_THAT(messages(loaded), ElementsAre("lines are not supported x2", "points are not supported x1",
                                            "curves and surfaces are not supported x1",
                                            "faces of fewer than three corners are left out x1"));
  const std::vector<glm::vec3>& colors = loaded.scene.objects.at(0).mesh.colors;
  ASSERT_EQ(colors.size(), 3U);
  EXPECT_EQ(colors[0], glm::vec3(1, 0, 0));
  EXPECT_NEAR(colors[1].y, 0.2140F, 1e-3F);  // 0.5 in sRGB
  EXPECT_EQ(colors[2], glm::vec3(1.0F));
}

}  // namespace
}  // namespace mirrorbake
