#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/core/parallel.hpp"
#include "scenes.hpp"

namespace mirrorbake {
namespace {

using test::add_object;
using test::matte;
using test::mirror;
using test::small_room;

Camera room_camera(int size = 48) {
  Camera camera;
  camera.eye = {0.4F, 2.9F, 1.6F};
  camera.target = {0, 1, 0};
  camera.vertical_fov_degrees = 60.0F;
  camera.width = camera.height = size;
  return camera;
}

Material coated(glm::vec3 albedo) {
  Material m = matte(albedo);
  m.specular = true;
  m.fresnel.model = FresnelModel::dielectric;
  m.fresnel.eta = glm::vec3(1.5F);
  m.layers = LayerModel::coated;
  return m;
}

// D + F (L_local + (1 − α) L_distant) is the beauty of the same sample (spec T4).
float worst_invariant_error(const LayerTrace& trace) {
  float worst = 0.0F;
  const SurfaceSamples& s = trace.samples;
  for (std::size_t i = 0; i < s.size(); ++i) {
    const glm::vec3 sum =
        s.diffuse[i] + s.fresnel[i] * (glm::vec3(s.local[i]) + (1.0F - s.local[i].a) * s.distant[i]);
    const glm::vec3 difference = glm::abs(sum - trace.sample_beauty[i]);
    const float scale = std::max(1e-3F, glm::length(trace.sample_beauty[i]));
    worst = std::max(worst, std::max(difference.x, std::max(difference.y, difference.z)) / scale);
  }
  return worst;
}

class LayerInvariant : public testing::TestWithParam<std::tuple<IndirectLight, int>> {};

TEST_P(LayerInvariant, HoldsPerSampleForNestedSelfReflection) {
  const auto [mode, depth] = GetParam();
  for (bool coat : {false, true}) {
    Scene scene = small_room();
    // A ring reflects itself again and again; a second mirror sees it.
    const Material material =
        coat ? coated({0.6F, 0.3F, 0.1F}) : mirror({0.95F, 0.8F, 0.6F}, {0.05F, 0.1F, 0.2F});
    const int ring = add_object(scene, make_torus({0, 1, 0}, 0.5F, 0.3F, 32), material);
    add_object(scene, make_sphere({0.9F, 0.6F, -0.3F}, 0.4F, 32), mirror(glm::vec3(0.9F)));
    TracerOptions options;
    options.indirect = mode;
    options.cache_rays = 16;
    const Tracer tracer(scene, options);
    TraceOptions trace_options;
    trace_options.samples_per_pixel = 4;
    trace_options.max_specular_depth = depth;
    const LayerTrace trace = tracer.trace_layers(room_camera(), ring, trace_options);
    ASSERT_GT(trace.samples.size(), 500u);
    const auto local = std::count_if(trace.samples.local.begin(), trace.samples.local.end(),
                                     [](const glm::vec4& l) { return l.a == 1.0F; });
    EXPECT_GT(local, 50);
    EXPECT_LT(local, static_cast<std::ptrdiff_t>(trace.samples.size()) - 50);
    // The two integrators add the same terms in another order: a few roundings per bounce.
    EXPECT_LT(worst_invariant_error(trace), 1e-5F);
  }
}

INSTANTIATE_TEST_SUITE_P(ModesAndDepths, LayerInvariant,
                         testing::Combine(testing::Values(IndirectLight::none, IndirectLight::cached,
                                                          IndirectLight::path),
                                          testing::Values(0, 1, 3, 16)));

TEST(Layers, ConvexReflectorHasNoLocalLayer) {
  Scene scene = small_room();
  const int box =
      add_object(scene, make_box({-0.5F, 0.5F, -0.5F}, {0.5F, 1.5F, 0.5F}), mirror(glm::vec3(0.9F)));
  const Tracer tracer(scene, {.indirect = IndirectLight::none});
  const LayerTrace trace = tracer.trace_layers(room_camera(), box, {});
  ASSERT_GT(trace.samples.size(), 1000u);
  for (const glm::vec4& local : trace.samples.local) EXPECT_EQ(local, glm::vec4(0.0F));
}

// A mirror in front of which the same object has a flap: the ray through the flap must show what is behind
// it.
TEST(Layers, DistantLayerLooksThroughTheReflector) {
  TriangleMesh mesh = make_rectangle({-1, -1, 0}, {2, 0, 0}, {0, 2, 0});        // mirror, facing +z
  const TriangleMesh flap = make_rectangle({-1, -1, 2}, {0, 2, 0}, {2, 0, 0});  // facing −z
  const auto base = static_cast<unsigned>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), flap.positions.begin(), flap.positions.end());
  mesh.normals.insert(mesh.normals.end(), flap.normals.begin(), flap.normals.end());
  mesh.uvs.insert(mesh.uvs.end(), flap.uvs.begin(), flap.uvs.end());
  mesh.parts.assign(mesh.triangles.size(), 0);
  for (glm::uvec3 t : flap.triangles) {
    mesh.triangles.push_back(t + base);
    mesh.parts.push_back(1);
  }
  Scene scene;
  const int reflector = add_object(scene, mesh, mirror(glm::vec3(1.0F)));
  scene.objects[0].part_names = {"mirror", "flap"};
  Material glow = matte(glm::vec3(0.0F));
  glow.emission = {1.0F, 2.0F, 3.0F};
  add_object(scene, make_rectangle({-9, -9, 5}, {0, 18, 0}, {18, 0, 0}), glow);  // behind the flap, facing −z
  const Tracer tracer(scene, {.indirect = IndirectLight::none});
  Camera camera;
  camera.eye = {0.0F, 0.0F, 1.0F};  // between mirror and flap
  camera.target = {0, 0, 0};
  camera.vertical_fov_degrees = 10.0F;
  camera.width = camera.height = 8;
  TraceOptions options;
  options.max_specular_depth = 1;
  const LayerTrace trace = tracer.trace_layers(camera, reflector, options);
  ASSERT_EQ(trace.samples.size(), 8u * 8u * 16u);
  for (std::size_t i = 0; i < trace.samples.size(); ++i) {
    EXPECT_EQ(trace.samples.local[i].a, 1.0F);
    EXPECT_EQ(trace.samples.distant[i], glm::vec3(1, 2, 3));
    // From z = 0 to z = 5 along the reflection.
    EXPECT_NEAR(trace.samples.hit_distance[i], 5.0F / trace.samples.reflection[i].z, 1e-4F);
    EXPECT_EQ(trace.samples.part[i], 0);
  }
}

TEST(Layers, NothingBehindGivesInfiniteDistanceAndTheSky) {
  Scene scene;
  const int ball = add_object(scene, make_sphere(glm::vec3(0.0F), 1.0F), mirror({0.5F, 0.6F, 0.7F}));
  scene.environment = test::constant_environment(2.0F);
  const Tracer tracer(scene, {.indirect = IndirectLight::none});
  Camera camera;
  camera.eye = {0, 0, 4};
  camera.width = camera.height = 16;
  const LayerTrace trace = tracer.trace_layers(camera, ball, {});
  for (std::size_t i = 0; i < trace.samples.size(); ++i) {
    EXPECT_TRUE(std::isinf(trace.samples.hit_distance[i]));
    EXPECT_NEAR(trace.samples.distant[i].x, 2.0F, 1e-6F);
    EXPECT_EQ(trace.samples.fresnel[i], glm::vec3(0.5F, 0.6F, 0.7F));
  }
  EXPECT_NEAR(trace.layers.at(0, 0)[0], 2.0F, 1e-6F);  // the sky beside the ball
  EXPECT_NEAR(trace.layers.at(8, 8)[0], 1.0F, 1e-5F);  // and in the ball
}

TEST(Layers, ImageAveragesTheSamples) {
  Scene scene = small_room();
  const int ring =
      add_object(scene, make_torus({0, 1, 0}, 0.5F, 0.3F, 32), mirror({0.95F, 0.8F, 0.6F}, glm::vec3(0.1F)));
  const Tracer tracer(scene, {.indirect = IndirectLight::none});
  const Camera camera = room_camera(24);
  TraceOptions options;
  options.samples_per_pixel = 8;
  const LayerTrace trace = tracer.trace_layers(camera, ring, options);
  const auto channel = [&](const char* name) {
    const auto& names = trace.layers.channels;
    const auto found = std::find(names.begin(), names.end(), name);
    EXPECT_NE(found, names.end()) << name;
    return static_cast<int>(found - names.begin());
  };
  const int coverage = channel("coverage");
  const int alpha = channel("specular_local.A");
  const int green = channel("specular_distant.G");
  const int normal = channel("normal.Y");
  const Image beauty = tracer.trace_beauty(camera, options);
  std::size_t i = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double count = 0, sum_alpha = 0, sum_green = 0, sum_normal = 0;
      for (;
           i < trace.samples.size() && trace.samples.pixel[i] == static_cast<unsigned>(y * camera.width + x);
           ++i) {
        ++count;
        sum_alpha += trace.samples.local[i].a;
        sum_green += trace.samples.distant[i].g;
        sum_normal += trace.samples.normal[i].y;
      }
      const float* pixel = trace.layers.at(x, y);
      EXPECT_EQ(pixel[coverage], count / 8);
      const double share = count > 0 ? 1 / count : 0;
      EXPECT_NEAR(pixel[alpha], sum_alpha * share, 1e-6);
      EXPECT_NEAR(pixel[green], sum_green * share, 1e-5);
      EXPECT_NEAR(pixel[normal], sum_normal * share, 1e-6);
      for (int c = 0; c < 3; ++c) EXPECT_EQ(pixel[c], beauty.at(x, y)[c]);
    }
  }
  EXPECT_EQ(i, trace.samples.size());
}

TEST(Layers, VisibilityIsTheGeometryOfTheLayers) {
  Scene scene = small_room();
  const int ring = add_object(scene, make_torus({0, 1, 0}, 0.5F, 0.3F, 32), mirror(glm::vec3(0.9F)));
  const Tracer tracer(scene, {.indirect = IndirectLight::none});
  TraceOptions options;
  options.samples_per_pixel = 4;
  options.seed = 7;
  const SurfaceSamples a = tracer.trace_layers(room_camera(), ring, options).samples;
  const SurfaceSamples b = tracer.trace_visibility(room_camera(), ring, options);
  EXPECT_EQ(a.pixel, b.pixel);
  EXPECT_EQ(a.part, b.part);
  EXPECT_EQ(a.triangle, b.triangle);
  EXPECT_EQ(a.barycentric, b.barycentric);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(a.reflection, b.reflection);
  EXPECT_EQ(a.dposition_dx, b.dposition_dx);
  EXPECT_EQ(a.dreflection_dy, b.dreflection_dy);
  EXPECT_EQ(a.fresnel, b.fresnel);
  EXPECT_EQ(a.albedo, b.albedo);
  EXPECT_TRUE(b.diffuse.empty() && b.local.empty() && b.distant.empty() && b.hit_distance.empty());
}

// Shading normals tilted far off their triangles: the recorded direction must leave the surface, and stay the
// mirror of the view about the recorded normal.
TEST(Layers, WildShadingNormalsNeverReflectIntoTheSurface) {
  TriangleMesh mesh = make_rectangle({-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  mesh.normals = {
      glm::normalize(glm::vec3(-9, 0, 1)), glm::normalize(glm::vec3(9, 0, 1)), {0, 0, 1}, {0, 0, 1}};
  Scene scene;
  const int sheet = add_object(scene, mesh, mirror(glm::vec3(1.0F)));
  const Tracer tracer(scene, {.indirect = IndirectLight::none});
  Camera camera;
  camera.eye = {2.5F, 0.5F, 0.6F};
  camera.width = camera.height = 64;
  const SurfaceSamples s = tracer.trace_visibility(camera, sheet, {});
  ASSERT_GT(s.size(), 1000u);
  for (std::size_t i = 0; i < s.size(); ++i) {
    const glm::vec3 v = glm::normalize(camera.eye - s.position[i]);
    EXPECT_GT(s.reflection[i].z, 0.0F);
    EXPECT_GE(glm::dot(s.normal[i], v), 0.0F);
    EXPECT_LT(glm::length(s.reflection[i] - (2.0F * glm::dot(s.normal[i], v) * s.normal[i] - v)), 1e-4F);
  }
}

TEST(Layers, SameBitsOnAnyNumberOfThreads) {
  Scene scene = small_room();
  const int ring = add_object(scene, make_torus({0, 1, 0}, 0.5F, 0.3F, 32), coated({0.6F, 0.3F, 0.1F}));
  const Tracer tracer(scene, {.indirect = IndirectLight::path});
  const LayerTrace many = tracer.trace_layers(room_camera(), ring, {});
  const ThreadLimit one(1);
  const LayerTrace single = tracer.trace_layers(room_camera(), ring, {});
  EXPECT_EQ(many.layers.pixels, single.layers.pixels);
  EXPECT_EQ(many.samples.local, single.samples.local);
  EXPECT_EQ(many.samples.distant, single.samples.distant);
  EXPECT_EQ(many.sample_beauty, single.sample_beauty);
}

}  // namespace
}  // namespace mirrorbake
