// What textures and colours of the mesh do to a surface.
#include <gtest/gtest.h>

#include <cmath>

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "mirrorbake/scene/scene.hpp"
#include "mirrorbake/scene/shapes.hpp"
#include "mirrorbake/tracer/tracer.hpp"

namespace mirrorbake {
namespace {

// A plate of 2 m in the plane y = 0, u along +X and v along −Z, seen from above.
struct Plate {
  Scene scene;
  Camera camera;
  Plate() {
    Material material;
    material.specular = true;
    material.fresnel.r0 = glm::vec3(0.5F);
    material.fresnel.model = FresnelModel::constant;
    scene.materials.push_back(material);
    scene.objects.push_back({"plate", make_rectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}), 0, {}});
    camera.eye = {0.0F, 3.0F, 0.5F};
    camera.width = camera.height = 16;
  }
  // A sum of floats: good to 1e-4.
  glm::vec3 mean_normal() const {
    const LayerTrace trace = Tracer(scene, {.indirect = IndirectLight::none}).trace_layers(camera, 0, {});
    EXPECT_GT(trace.samples.size(), 100U);
    glm::vec3 sum(0.0F);
    for (const glm::vec3 n : trace.samples.normal) sum += n;
    return glm::normalize(sum);
  }
};

// glTF 2.0 §3.9.3: red is the tangent, along u, green the bitangent, along v as it points up in the texture.
TEST(SurfaceMaps, ANormalTextureTiltsTheNormalAlongTheTextureCoordinates) {
  Plate plate;
  const glm::vec3 tilt = glm::normalize(glm::vec3(0.3F, 0.2F, 1.0F));
  Texture texture;
  texture.image = Image(1, 1, {"R", "G", "B"});
  for (int c = 0; c < 3; ++c) texture.image.pixels[static_cast<std::size_t>(c)] = 0.5F * tilt[c] + 0.5F;
  plate.scene.textures.push_back(texture);
  Material& material = plate.scene.materials[0];
  EXPECT_LT(glm::length(plate.mean_normal() - glm::vec3(0, 1, 0)), 1e-4F);
  material.normal_texture.texture = 0;
  EXPECT_LT(glm::length(plate.mean_normal() - glm::vec3(tilt.x, tilt.z, -tilt.y)), 1e-4F);
  // Coordinates that run the other way turn the tangent with them, not the bitangent.
  for (glm::vec2& uv : plate.scene.objects[0].mesh.uvs) uv.x = -uv.x;
  EXPECT_LT(glm::length(plate.mean_normal() - glm::vec3(-tilt.x, tilt.z, -tilt.y)), 1e-4F);
  material.normal_scale = 0.0F;
  EXPECT_LT(glm::length(plate.mean_normal() - glm::vec3(0, 1, 0)), 1e-4F);
  material.normal_scale = 1.0F;
  plate.scene.objects[0].mesh.uvs.clear();
  EXPECT_LT(glm::length(plate.mean_normal() - glm::vec3(0, 1, 0)), 1e-4F);
}

// glTF 2.0 §3.7.2.1: bitangent = cross(normal, tangent.xyz) * tangent.w. Good to the sums of mean_normal().
TEST(SurfaceMaps, TangentsOfTheMeshTurnTheNormalTextureWhateverItsCoordinatesSay) {
  Plate plate;
  const glm::vec3 tilt = glm::normalize(glm::vec3(0.3F, 0.2F, 1.0F));
  Texture texture;
  texture.image = Image(1, 1, {"R", "G", "B"});
  for (int c = 0; c < 3; ++c) texture.image.pixels[static_cast<std::size_t>(c)] = 0.5F * tilt[c] + 0.5F;
  plate.scene.textures.push_back(texture);
  plate.scene.materials[0].normal_texture.texture = 0;
  TriangleMesh& mesh = plate.scene.objects[0].mesh;
  const glm::vec3 normal(0, 1, 0);
  for (const float degrees : {0.0F, 30.0F, 90.0F, 200.0F}) {
    for (const float sign : {1.0F, -1.0F}) {
      const glm::vec3 along(std::cos(glm::radians(degrees)), 0, std::sin(glm::radians(degrees)));
      mesh.tangents.assign(mesh.positions.size(), {along, sign});
      const glm::vec3 expected = tilt.x * along + tilt.y * sign * glm::cross(normal, along) + tilt.z * normal;
      EXPECT_LT(glm::length(plate.mean_normal() - expected), 1e-4F) << degrees << " " << sign;
    }
  }
  // A corner without one: the coordinates' own, along +X and −Z.
  mesh.tangents[mesh.triangles[0].x] = mesh.tangents[mesh.triangles[1].y] = glm::vec4(0.0F);
  mesh.tangents[mesh.triangles[0].y] = mesh.tangents[mesh.triangles[1].x] = glm::vec4(0.0F);
  EXPECT_LT(glm::length(plate.mean_normal() - glm::vec3(tilt.x, tilt.z, -tilt.y)), 1e-4F);
}

TEST(SurfaceMaps, ColoursOfTheMeshMultiplyAlbedoAndOfMetalsTheReflectance) {
  Plate plate;
  Material& material = plate.scene.materials[0];
  material.albedo = glm::vec3(0.5F);
  plate.scene.directional_lights.push_back({{0, -1, 0}, glm::vec3(1.0F)});
  const auto mean = [&](const auto& value) {
    const LayerTrace trace =
        Tracer(plate.scene, {.indirect = IndirectLight::none}).trace_layers(plate.camera, 0, {});
    return value(trace, trace.samples.size() / 2);
  };
  const auto fresnel = [](const LayerTrace& t, std::size_t i) { return t.samples.fresnel[i]; };
  const auto diffuse = [](const LayerTrace& t, std::size_t i) { return t.sample_beauty[i]; };
  const glm::vec3 white_fresnel = mean(fresnel);
  const glm::vec3 white_diffuse = mean(diffuse);
  const glm::vec3 color(1.0F, 0.5F, 0.25F);
  plate.scene.objects[0].mesh.colors.assign(plate.scene.objects[0].mesh.positions.size(), color);
  EXPECT_EQ(mean(fresnel), white_fresnel);
  EXPECT_LT(glm::length(mean(diffuse) - color * white_diffuse), 1e-6F);
  material.colors_tint_reflectance = true;
  EXPECT_LT(glm::length(mean(fresnel) - color * white_fresnel), 1e-6F);
}

}  // namespace
}  // namespace mirrorbake
