#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake {
namespace {

using ::testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

// One triangle with everything a mesh can have, in a scene with everything a scene can have.
Scene complete_scene() {
  Scene scene;
  Image texture(2, 1, {"R", "G", "B"});
  texture.pixels = {0.0F, 0.5F, 1.0F, 1.0F, 0.5F, 0.0F};
  scene.textures.push_back({texture});
  Material material;
  material.name = "chrome";
  material.albedo_texture.texture = 0;
  material.specular_texture.texture = 0;
  material.lobe = SpecularLobe::ggx;
  material.roughness_texture.texture = 0;
  material.emission_texture.texture = 0;
  material.specular = true;
  material.fresnel = {FresnelModel::conductor, glm::vec3(0.0F), glm::vec3(3.1F), glm::vec3(3.3F)};
  scene.materials.push_back(material);
  Object object;
  object.name = "sail";
  object.mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  object.mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  object.mesh.uvs = {{0, 0}, {1, 0}, {0, 1}};
  object.mesh.triangles = {{0, 1, 2}, {0, 0, 1}};  // the second one is degenerate, as at the pole of a patch
  object.mesh.parts = {0, 1};
  object.part_names = {"cloth", "seam"};
  scene.objects.push_back(object);
  scene.rectangle_lights.push_back({});
  scene.sphere_lights.push_back({});
  scene.point_lights.push_back({});
  scene.directional_lights.push_back({});
  scene.spot_lights.push_back({});
  scene.environment = EnvironmentLight{texture, 1.0F, 0.0F};
  return scene;
}

struct Defect {
  std::string expected;  // part of the message
  std::function<void(Scene&)> make;
};

TEST(Scene, ValidationAcceptsACompleteSceneAndAnEmptyOne) {
  EXPECT_NO_THROW(validate(complete_scene()));
  EXPECT_NO_THROW(validate(Scene{}));
  Scene grey = complete_scene();
  grey.textures[0].image = Image(2, 1, {"Y"});
  EXPECT_NO_THROW(validate(grey));
}

// Of a complete scene: each defect is an error that names the thing and its field.
void expect_refused(const std::vector<Defect>& defects) {
  for (const Defect& defect : defects) {
    Scene scene = complete_scene();
    defect.make(scene);
    try {
      validate(scene);
      ADD_FAILURE() << "accepted: " << defect.expected;
    } catch (const InvalidArgument& error) {
      EXPECT_THAT(error.what(), HasSubstr(defect.expected));
      EXPECT_THAT(error.what(), HasSubstr("expected"));
    }
  }
}

TEST(Scene, ValidationNamesTheFieldOfAMaterialOrTextureThatIsWrong) {
  const std::vector<Defect> defects = {
      {"texture 0 channel count is 2",
       [](Scene& s) {
         s.textures[0].image.channels = {"Y", "A"};
       }},
      {"texture 0 number of values is 5", [](Scene& s) { s.textures[0].image.pixels.pop_back(); }},
      {"texture 0 is 0 × 1 pixels", [](Scene& s) { s.textures[0].image.width = 0; }},
      {"texture 0 pixel (1, 0) channel 2 is 1.5", [](Scene& s) { s.textures[0].image.pixels[5] = 1.5F; }},
      {"texture 0 pixel (0, 0) channel 0 is nan", [](Scene& s) { s.textures[0].image.pixels[0] = kNan; }},
      {"material 0 'chrome' albedo is", [](Scene& s) { s.materials[0].albedo.y = 1.01F; }},
      {"material 0 'chrome' albedo is", [](Scene& s) { s.materials[0].albedo.z = kNan; }},
      {"material 0 'chrome' albedo_texture is 1",
       [](Scene& s) { s.materials[0].albedo_texture.texture = 1; }},
      {"material 0 'chrome' albedo_texture is -2",
       [](Scene& s) { s.materials[0].albedo_texture.texture = -2; }},
      {"material 0 'chrome' albedo_texture transform is offset",
       [](Scene& s) { s.materials[0].albedo_texture.offset.x = kNan; }},
      {"material 0 'chrome' specular_texture transform is offset",
       [](Scene& s) { s.materials[0].specular_texture.rotation = kInf; }},
      {"material 0 'chrome' roughness_texture is 7",
       [](Scene& s) { s.materials[0].roughness_texture.texture = 7; }},
      {"material 0 'chrome' emission_texture is 7",
       [](Scene& s) { s.materials[0].emission_texture.texture = 7; }},
      {"material 0 'chrome' opacity is 1.5", [](Scene& s) { s.materials[0].opacity = 1.5F; }},
      {"material 0 'chrome' opacity is nan", [](Scene& s) { s.materials[0].opacity = kNan; }},
      {"material 0 'chrome' opacity_cutoff is -1", [](Scene& s) { s.materials[0].opacity_cutoff = -1.0F; }},
      {"material 0 'chrome' opacity_texture is 7",
       [](Scene& s) { s.materials[0].opacity_texture.texture = 7; }},
      {"material 0 'chrome' roughness is 0", [](Scene& s) { s.materials[0].roughness = 0.0F; }},
      {"material 0 'chrome' roughness is 1.01", [](Scene& s) { s.materials[0].roughness = 1.01F; }},
      {"material 0 'chrome' exponent is 0.5",
       [](Scene& s) {
         s.materials[0].lobe = SpecularLobe::phong;
         s.materials[0].exponent = 0.5F;
       }},
      {"material 0 'chrome' emission is", [](Scene& s) { s.materials[0].emission.x = -1.0F; }},
      {"material 0 'chrome' fresnel k is", [](Scene& s) { s.materials[0].fresnel.k.x = -0.1F; }},
      {"material 0 'chrome' fresnel eta is", [](Scene& s) { s.materials[0].fresnel.eta.x = 0.0F; }},
      {"material 0 'chrome' fresnel eta is",
       [](Scene& s) {
         s.materials[0].fresnel.model = FresnelModel::dielectric;
         s.materials[0].fresnel.eta.x = kInf;
       }},
      {"material 0 'chrome' fresnel r0 is",
       [](Scene& s) {
         s.materials[0].fresnel.model = FresnelModel::schlick;
         s.materials[0].fresnel.r0.x = 1.1F;
       }},
  };
  expect_refused(defects);
}

TEST(Scene, ValidationNamesTheFieldOfAnObjectOrLightThatIsWrong) {
  const std::vector<Defect> defects = {
      {"object 0 'sail' material is 1", [](Scene& s) { s.objects[0].material = 1; }},
      {"object 0 'sail' material is -1", [](Scene& s) { s.objects[0].material = -1; }},
      {"object 0 'sail' vertex 2 is", [](Scene& s) { s.objects[0].mesh.positions[2].y = kNan; }},
      {"object 0 'sail' vertex 1 is", [](Scene& s) { s.objects[0].mesh.positions[1].y = kInf; }},
      {"object 0 'sail' vertex 1 is", [](Scene& s) { s.objects[0].mesh.positions[1].y = -1e13F; }},
      {"object 0 'sail' normal count is 2", [](Scene& s) { s.objects[0].mesh.normals.pop_back(); }},
      {"object 0 'sail' normal 1 is", [](Scene& s) { s.objects[0].mesh.normals[1] = glm::vec3(0.0F); }},
      {"object 0 'sail' normal 1 is", [](Scene& s) { s.objects[0].mesh.normals[1].x = kNan; }},
      {"object 0 'sail' uv count is 2", [](Scene& s) { s.objects[0].mesh.uvs.pop_back(); }},
      {"object 0 'sail' uv 0 is", [](Scene& s) { s.objects[0].mesh.uvs[0].x = kInf; }},
      {"object 0 'sail' triangle 0 vertex index is 3",
       [](Scene& s) { s.objects[0].mesh.triangles[0].y = 3; }},
      {"object 0 'sail' area is 0", [](Scene& s) { s.objects[0].mesh.triangles[0].y = 0; }},
      {"object 0 'sail' area is 0", [](Scene& s) { s.objects[0].mesh = {}; }},
      {"object 0 'sail' part index count is 1", [](Scene& s) { s.objects[0].mesh.parts.pop_back(); }},
      {"object 0 'sail' part of triangle 1 is 2", [](Scene& s) { s.objects[0].mesh.parts[1] = 2; }},
      {"object 0 'sail' part of triangle 1 is 1", [](Scene& s) { s.objects[0].part_names.clear(); }},
      {"rectangle light 0 corner is", [](Scene& s) { s.rectangle_lights[0].corner.x = kNan; }},
      {"rectangle light 0 edge_u is", [](Scene& s) { s.rectangle_lights[0].edge_u.x = kInf; }},
      {"rectangle light 0 edge_v is", [](Scene& s) { s.rectangle_lights[0].edge_v.x = kNan; }},
      {"rectangle light 0 area is 0",
       [](Scene& s) { s.rectangle_lights[0].edge_v = 2.0F * s.rectangle_lights[0].edge_u; }},
      {"rectangle light 0 radiance is", [](Scene& s) { s.rectangle_lights[0].radiance.x = -1.0F; }},
      {"sphere light 0 centre is", [](Scene& s) { s.sphere_lights[0].centre.x = kInf; }},
      {"sphere light 0 radius is 0", [](Scene& s) { s.sphere_lights[0].radius = 0.0F; }},
      {"sphere light 0 radiance is", [](Scene& s) { s.sphere_lights[0].radiance.y = kNan; }},
      {"directional light 0 direction is", [](Scene& s) { s.directional_lights[0].direction.y = -2.0F; }},
      {"directional light 0 irradiance is", [](Scene& s) { s.directional_lights[0].irradiance.y = -2.0F; }},
      {"spot light 0 position is", [](Scene& s) { s.spot_lights[0].position.y = kNan; }},
      {"spot light 0 direction is", [](Scene& s) { s.spot_lights[0].direction = glm::vec3(0.0F); }},
      {"spot light 0 intensity is", [](Scene& s) { s.spot_lights[0].intensity.x = kInf; }},
      {"spot light 0 outer_degrees is 90.5", [](Scene& s) { s.spot_lights[0].outer_degrees = 90.5F; }},
      {"spot light 0 inner_degrees is 45", [](Scene& s) { s.spot_lights[0].inner_degrees = 45.0F; }},
      {"spot light 0 inner_degrees is nan", [](Scene& s) { s.spot_lights[0].inner_degrees = kNan; }},
      {"point light 0 position is", [](Scene& s) { s.point_lights[0].position.x = kNan; }},
      {"point light 0 intensity is", [](Scene& s) { s.point_lights[0].intensity.z = kInf; }},
      {"environment panorama pixel (0, 0) channel 1 is",
       [](Scene& s) { s.environment->panorama.pixels[1] = kInf; }},
      {"environment panorama pixel (0, 0) channel 1 is",
       [](Scene& s) { s.environment->panorama.pixels[1] = -1; }},
      {"environment scale is", [](Scene& s) { s.environment->scale = -1.0F; }},
      {"environment rotation_degrees is", [](Scene& s) { s.environment->rotation_degrees = kNan; }},
  };
  expect_refused(defects);
}

TEST(Scene, ValidationIgnoresTheFresnelParametersOfAMatteMaterial) {
  Scene scene = complete_scene();
  scene.materials[0].specular = false;
  scene.materials[0].fresnel.eta = glm::vec3(-1.0F);
  EXPECT_NO_THROW(validate(scene));
}

TEST(Scene, ValidationIgnoresTheParametersOfLobesThatAMaterialDoesNotHave) {
  Scene scene = complete_scene();
  scene.materials[0].lobe = SpecularLobe::mirror;
  scene.materials[0].roughness = 0.0F;
  scene.materials[0].exponent = 0.0F;
  EXPECT_NO_THROW(validate(scene));
}

TEST(Scene, BoundsAreTheExtremesOfTheVertices) {
  TriangleMesh mesh;
  mesh.positions = {{1, -2, 3}, {-4, 5, -6}, {0, 0, 9}};
  const Bounds box = bounds(mesh);
  EXPECT_EQ(box.min, glm::vec3(-4, -2, -6));
  EXPECT_EQ(box.max, glm::vec3(1, 5, 9));
  EXPECT_THROW(bounds(TriangleMesh{}), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
