#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/surface/shells.hpp"
#include "scenes.hpp"

namespace mirrorbake {
namespace {

using test::add_object;
using test::constant_environment;
using test::matte;
using test::mirror;

Material sheet(float opacity, glm::vec3 albedo = glm::vec3(0.0F)) {
  Material m = matte(albedo);
  m.opacity = opacity;
  return m;
}

/// 2 m wide, in the plane z = 0, seen from z > 0.
TriangleMesh square() { return make_rectangle({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}); }

Camera camera_at(glm::vec3 eye, glm::vec3 target, float degrees, int size) {
  Camera camera;
  camera.eye = eye;
  camera.target = target;
  camera.vertical_fov_degrees = degrees;
  camera.width = camera.height = size;
  return camera;
}

TraceOptions samples(int count) {
  TraceOptions options;
  options.samples_per_pixel = count;
  return options;
}

double mean(const Image& image, int channel) {
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) sum += image.at(x, y)[channel];
  }
  return sum / (image.width * image.height);
}

/// Left half there, right half not: bilinear interpolation crosses the cutoff in the middle.
int add_half_mask(Scene& scene) {
  Texture texture;
  texture.image = Image(4, 1, {"A"});
  texture.image.pixels = {1.0F, 1.0F, 0.0F, 0.0F};
  texture.wrap_u = texture.wrap_v = TextureWrap::clamp;
  scene.textures.push_back(texture);
  return static_cast<int>(scene.textures.size()) - 1;
}

// A black sheet before a sky of radiance 1 shows as much of it as it is not there.
TEST(Opacity, IsTheShareOfRaysThatMeetTheSurface) {
  for (const float opacity : {0.0F, 0.25F, 0.7F, 1.0F}) {
    Scene scene;
    add_object(scene, square(), sheet(opacity));
    scene.environment = constant_environment(1.0F);
    const Tracer tracer(scene);
    const Camera camera = camera_at({0, 0, 2}, {0, 0, 0}, 20.0F, 64);
    const Image image = tracer.trace_beauty(camera, samples(16));
    // 65,536 independent rays: a standard error of at most 0.002.
    const double tolerance = opacity == 0.0F || opacity == 1.0F ? 1e-6 : 0.008;
    EXPECT_NEAR(mean(image, 0), 1.0 - static_cast<double>(opacity), tolerance);
    // The first surface that the rays meet is found by other code, many rays at a time.
    EXPECT_NEAR(mean(tracer.trace_geometry(camera, samples(16)), 0), static_cast<double>(opacity), tolerance);
    const ThreadLimit one(1);
    EXPECT_EQ(tracer.trace_beauty(camera, samples(16)).pixels, image.pixels);
  }
}

// Of two sheets the gaps are independent.
TEST(Opacity, OfSurfacesBehindOneAnotherMultiplies) {
  Scene scene;
  TriangleMesh behind = square();
  for (glm::vec3& p : behind.positions) p.z -= 0.5F;
  add_object(scene, square(), sheet(0.5F));
  add_object(scene, behind, sheet(0.4F));
  scene.environment = constant_environment(1.0F);
  const Tracer tracer(scene);
  EXPECT_NEAR(mean(tracer.trace_beauty(camera_at({0, 0, 2}, {0, 0, 0}, 20.0F, 64), samples(16)), 0), 0.3,
              0.008);
}

TEST(Opacity, WithACutoffIsThereWhereTheTextureReachesIt) {
  Scene scene;
  Material material = matte(glm::vec3(0.5F));
  material.opacity_texture.texture = add_half_mask(scene);
  material.opacity_cutoff = 0.5F;
  const int mask = add_object(scene, square(), material);
  TriangleMesh wall = make_rectangle({-3, -3, -1}, {6, 0, 0}, {0, 6, 0});
  const int behind = add_object(scene, wall, matte(glm::vec3(0.5F)));
  const Tracer tracer(scene);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-0.99F, 0.99F);
  std::vector<glm::vec3> origins, directions;
  for (int i = 0; i < 5000; ++i) {
    const glm::vec3 target(place(random), place(random), 0.0F);
    origins.emplace_back(3.0F * place(random), 3.0F * place(random), 2.0F);
    directions.push_back(glm::normalize(target - origins.back()));
  }
  const std::vector<RayHit> hits = tracer.intersect(origins, directions, {});
  int there = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const float x = origins[i].x - origins[i].z / directions[i].z * directions[i].x;
    if (std::abs(x) < 1e-4F) continue;  // the edge of the mask
    EXPECT_EQ(hits[i].object, x < 0.0F ? mask : behind) << x;
    there += x < 0.0F ? 1 : 0;
  }
  EXPECT_GT(there, 2000);
  EXPECT_LT(there, 3000);
}

TEST(Opacity, LetsTheLightThroughThatIsNotStopped) {
  for (const bool from_a_point : {true, false}) {
    double irradiance[2];
    for (const float opacity : {0.0F, 0.3F}) {
      Scene scene;
      add_object(scene, make_rectangle({-3, 0, 3}, {6, 0, 0}, {0, 0, -6}), matte(glm::vec3(0.8F)));
      add_object(scene, make_rectangle({-1, 1, 1}, {2, 0, 0}, {0, 0, -2}), sheet(opacity));
      if (from_a_point) {
        scene.point_lights.push_back({{0.0F, 2.0F, 0.0F}, glm::vec3(5.0F)});
      } else {
        scene.rectangle_lights.push_back({{-0.2F, 2.0F, -0.2F}, {0.4F, 0, 0}, {0, 0, 0.4F}, glm::vec3(9.0F)});
      }
      const Tracer tracer(scene, {.indirect = IndirectLight::none});
      // From below the sheet.
      const Camera camera = camera_at({0.9F, 0.7F, 0.0F}, {0, 0, 0}, 2.0F, 64);
      irradiance[opacity > 0.0F ? 1 : 0] = mean(tracer.trace_beauty(camera, samples(16)), 0);
    }
    ASSERT_GT(irradiance[0], 0.05);
    // 65,536 shadow rays: 0.0018.
    EXPECT_NEAR(irradiance[1] / irradiance[0], 0.7, 0.008);
  }
}

// Next-event estimation chooses points of the lamp, of which some are not there; rays that meet it by chance
// know.
TEST(Opacity, OfALampScalesItsLight) {
  Material material = sheet(1.0F);
  material.emission = glm::vec3(4.0F);
  Material floor = matte(glm::vec3(0.3F));
  floor.specular = true;
  floor.lobe = SpecularLobe::ggx;
  floor.roughness = 0.4F;
  floor.fresnel.r0 = glm::vec3(0.6F);
  const auto light_on_the_floor = [&](const Material& of_the_lamp, bool masked) {
    Scene scene;
    add_object(scene, make_rectangle({-3, 0, 3}, {6, 0, 0}, {0, 0, -6}), floor);
    Material lamp = of_the_lamp;
    if (masked) {
      lamp.opacity_texture.texture = add_half_mask(scene);
      lamp.opacity_cutoff = 0.5F;
    }
    add_object(scene, make_rectangle({-0.5F, 1, -0.5F}, {1, 0, 0}, {0, 0, 1}), lamp);
    const Tracer tracer(scene, {.indirect = IndirectLight::path});
    return mean(tracer.trace_beauty(camera_at({0, 0.8F, 2.5F}, {0, 0, 0}, 3.0F, 64), samples(64)), 0);
  };
  const double whole = light_on_the_floor(material, false);
  ASSERT_GT(whole, 0.1);
  material.opacity = 0.4F;
  EXPECT_NEAR(light_on_the_floor(material, false) / whole, 0.4, 0.01);
  material.opacity = 1.0F;
  // The mask is symmetric to the plane that eye and lamp lie in.
  EXPECT_NEAR(light_on_the_floor(material, true) / whole, 0.5, 0.01);
}

// Every layer has to meet the same surfaces for a sample.
TEST(Opacity, OfReflectorsAndWhatTheyReflectKeepsTheLayersSum) {
  Scene scene = test::small_room();
  Material ring_material = mirror({0.95F, 0.8F, 0.6F}, {0.05F, 0.1F, 0.2F});
  ring_material.opacity = 0.6F;
  const int ring = add_object(scene, make_torus({0, 1, 0}, 0.5F, 0.3F, 32), ring_material);
  add_object(scene, make_sphere({0.9F, 0.6F, -0.3F}, 0.4F, 32), sheet(0.5F, {0.2F, 0.6F, 0.3F}));
  const Tracer tracer(scene, {.cache_rays = 16});
  const Camera camera = camera_at({0.4F, 2.9F, 1.6F}, {0, 1, 0}, 60.0F, 48);
  const LayerTrace trace = tracer.trace_layers(camera, ring, samples(4));
  const SurfaceSamples& s = trace.samples;
  ASSERT_GT(s.size(), 300U);
  std::size_t local = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const glm::vec3 sum = s.diffuse[i] + s.fresnel[i] * incident_light(s.shells, i);
    const float scale = std::max(1e-3F, glm::length(trace.sample_beauty[i]));
    ASSERT_LT(glm::length(sum - trace.sample_beauty[i]) / scale, 1e-5F);
    local += s.shells[0].radiance[i].a == 1.0F ? 1 : 0;
  }
  EXPECT_GT(local, 50U);
}

}  // namespace
}  // namespace mirrorbake
