#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/proxy/hull.hpp"
#include "mirrorbake/surface/shells.hpp"
#include "mirrorbake/tracer/lobe.hpp"
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

struct InvariantError {
  float worst = 0.0F;  // relative
  int samples = 0;
  int local = 0;  // samples that meet the reflector again
};

// D + F (L_local + (1 − α) L_distant) is the beauty of the same sample (spec T4). With one sample per pixel
// the image of the beauty integrator, which knows nothing of layers, has a pixel per sample.
InvariantError invariant_error(const Tracer& tracer, const Camera& camera, int reflector,
                               TraceOptions options) {
  InvariantError error;
  options.samples_per_pixel = 1;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    options.seed = seed;
    const Image beauty = tracer.trace_beauty(camera, options);
    const LayerTrace trace = tracer.trace_layers(camera, reflector, options);
    const SurfaceSamples& s = trace.samples;
    for (std::size_t i = 0; i < s.size(); ++i) {
      const auto pixel = static_cast<int>(s.pixel[i]);
      const float* p = beauty.at(pixel % camera.width, pixel / camera.width);
      const glm::vec3 expected(p[0], p[1], p[2]);
      const glm::vec3 sum = s.diffuse[i] + s.fresnel[i] * incident_light(s.shells, i);
      EXPECT_EQ(sum, trace.sample_beauty[i]);
      const glm::vec3 difference = glm::abs(sum - expected);
      const float scale = std::max(1e-3F, glm::length(expected));
      error.worst =
          std::max(error.worst, std::max(difference.x, std::max(difference.y, difference.z)) / scale);
      error.local += s.shells[0].radiance[i].a == 1.0F ? 1 : 0;
    }
    error.samples += static_cast<int>(s.size());
  }
  return error;
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
    trace_options.max_specular_depth = depth;
    const InvariantError error = invariant_error(tracer, room_camera(), ring, trace_options);
    ASSERT_GT(error.samples, 500);
    EXPECT_GT(error.local, 50);
    EXPECT_LT(error.local, error.samples - 50);
    // The two integrators add the same terms in another order: a few roundings per bounce.
    EXPECT_LT(error.worst, 1e-5F);
  }
}

INSTANTIATE_TEST_SUITE_P(ModesAndDepths, LayerInvariant,
                         testing::Combine(testing::Values(IndirectLight::none, IndirectLight::cached,
                                                          IndirectLight::path),
                                          testing::Values(0, 1, 3, 16)));

Material rough(SpecularLobe lobe, FresnelModel fresnel) {
  Material m = matte({0.05F, 0.1F, 0.2F});
  m.specular = true;
  m.lobe = lobe;
  m.roughness = 0.3F;
  m.exponent = 30.0F;
  m.fresnel.model = fresnel;
  m.fresnel.r0 = {0.9F, 0.6F, 0.3F};
  m.fresnel.eta = {0.2F, 0.9F, 1.5F};
  m.fresnel.k = {3.0F, 2.5F, 1.9F};
  return m;
}

// Rough lobes under lights of every kind: small and infinitely small ones are found by next-event estimation
// alone.
Scene room_with_all_lights() {
  Scene scene = small_room();
  scene.sphere_lights.push_back({{1.2F, 2.5F, 1.0F}, 0.15F, glm::vec3(20.0F)});
  scene.point_lights.push_back({{-1.0F, 3.0F, 1.0F}, glm::vec3(2.0F)});
  scene.directional_lights.push_back({glm::normalize(glm::vec3(0.3F, -1.0F, 0.2F)), glm::vec3(0.5F)});
  SpotLight spot;
  spot.position = {0.5F, 3.5F, 1.5F};
  spot.direction = glm::normalize(glm::vec3(-0.1F, -1.0F, -0.5F));
  spot.intensity = glm::vec3(6.0F);
  scene.spot_lights.push_back(spot);
  return scene;
}

TEST(Layers, InvariantHoldsForRoughReflectorsUnderEveryKindOfLight) {
  for (const SpecularLobe lobe : {SpecularLobe::ggx, SpecularLobe::phong}) {
    for (const FresnelModel fresnel :
         {FresnelModel::constant, FresnelModel::schlick, FresnelModel::conductor}) {
      for (const int depth : {0, 1, 5}) {
        Scene scene = room_with_all_lights();
        const int ring = add_object(scene, make_torus({0, 1, 0}, 0.5F, 0.3F, 32), rough(lobe, fresnel));
        add_object(scene, make_sphere({0.9F, 0.6F, -0.3F}, 0.4F, 32), rough(SpecularLobe::ggx, fresnel));
        const Tracer tracer(scene, {.indirect = IndirectLight::path});
        TraceOptions options;
        options.max_specular_depth = depth;
        const InvariantError error = invariant_error(tracer, room_camera(), ring, options);
        ASSERT_GT(error.samples, 500);
        EXPECT_GT(error.local, 50);
        EXPECT_LT(error.worst, 1e-5F);
      }
    }
  }
}

// Lobe and light samples, weighted, estimate the same integral as the lobe alone.
TEST(Layers, SharingLightsBetweenLobeAndNextEventEstimationKeepsTheMean) {
  for (const float roughness : {0.1F, 0.5F}) {
    Scene scene;
    Material plate = rough(SpecularLobe::ggx, FresnelModel::schlick);
    plate.albedo = glm::vec3(0.0F);
    plate.roughness = roughness;
    add_object(scene, make_rectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}), plate);
    RectangleLight lamp;
    lamp.corner = {-0.5F, 1.5F, -0.5F};
    lamp.edge_u = {1, 0, 0};
    lamp.edge_v = {0, 0, 1};
    lamp.radiance = glm::vec3(2.0F);
    scene.rectangle_lights.push_back(lamp);
    const Tracer tracer(scene, {.indirect = IndirectLight::none});
    Camera camera;
    camera.eye = {0.2F, 2.0F, 1.5F};
    camera.width = camera.height = 24;
    TraceOptions options;
    options.samples_per_pixel = 256;
    const LayerTrace trace = tracer.trace_layers(camera, 0, options);
    // The lobe's directions alone, sampled anew from the recorded surfaces, each with the lamp's full
    // radiance.
    double both = 0.0;
    double alone = 0.0;
    const LobeShape shape{SpecularLobe::ggx, roughness, 1.0F};
    for (std::size_t i = 0; i < trace.samples.size(); ++i) {
      both += static_cast<double>(trace.sample_beauty[i].g);
      const glm::vec3 p = trace.samples.position[i];
      const glm::vec3 to_eye = glm::normalize(glm::vec3(0.2F, 2.0F, 1.5F) - p);
      // The plate's normal is +Y: the lobe's z.
      const glm::vec3 view(to_eye.x, -to_eye.z, to_eye.y);
      const glm::vec3 l = sample_lobe(shape, view, sobol_2d(static_cast<std::uint32_t>(i), 99));
      if (!(l.z > 0.0F)) continue;
      const glm::vec3 world(l.x, l.z, -l.y);
      const glm::vec3 hit = p + world * ((1.5F - p.y) / world.y);
      if (std::abs(hit.x) > 0.5F || std::abs(hit.z) > 0.5F) continue;
      const double weight = static_cast<double>(lobe_response(shape, view, l)) /
                            static_cast<double>(lobe_density(shape, view, l));
      const double c = lobe_fresnel_cosine(shape, view, l);
      alone += 2.0 * weight * (0.6 + 0.4 * std::pow(1.0 - c, 5));
    }
    const auto count = static_cast<double>(trace.samples.size());
    ASSERT_GT(count, 20'000.0);
    EXPECT_GT(both / count, 0.05);
    // 60,000 samples between 0 and 2: a standard error below 0.4 %.
    EXPECT_NEAR(both / count, alone / count, 0.012 * alone / count);
  }
}

TEST(Layers, ConvexReflectorHasNoLocalLayer) {
  Scene scene = small_room();
  const int box =
      add_object(scene, make_box({-0.5F, 0.5F, -0.5F}, {0.5F, 1.5F, 0.5F}), mirror(glm::vec3(0.9F)));
  const Tracer tracer(scene, {.indirect = IndirectLight::none});
  const LayerTrace trace = tracer.trace_layers(room_camera(), box, {});
  ASSERT_GT(trace.samples.size(), 1000u);
  for (const glm::vec4& local : trace.samples.shells[0].radiance) EXPECT_EQ(local, glm::vec4(0.0F));
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
    EXPECT_EQ(trace.samples.shells[0].radiance[i].a, 1.0F);
    EXPECT_EQ(trace.samples.shells[1].radiance[i], glm::vec4(1, 2, 3, 1));
    // From z = 0 to z = 5 along the reflection.
    EXPECT_NEAR(trace.samples.shells[1].hit_distance[i], 5.0F / trace.samples.reflection[i].z, 1e-4F);
    EXPECT_EQ(trace.samples.part[i], 0);
  }
}

// Several reflectors, rough and smooth, that see themselves and each other.
Scene room_with_three_reflectors(std::vector<int>& reflectors) {
  Scene scene = small_room();
  reflectors = {
      add_object(scene, make_torus({-0.2F, 1, 0}, 0.5F, 0.3F, 32),
                 mirror({0.95F, 0.8F, 0.6F}, glm::vec3(0.1F))),
      add_object(scene, make_sphere({0.9F, 0.6F, -0.3F}, 0.4F, 32),
                 rough(SpecularLobe::ggx, FresnelModel::schlick)),
      add_object(scene, make_torus({0.3F, 1.7F, 0.2F}, 0.3F, 0.1F, 24), coated({0.6F, 0.3F, 0.1F}))};
  return scene;
}

TEST(Layers, SeveralReflectorsInOnePassAreWhatTheyAreAlone) {
  std::vector<int> reflectors;
  const Scene scene = room_with_three_reflectors(reflectors);
  const Tracer tracer(scene, {.indirect = IndirectLight::path});
  TraceOptions options;
  options.samples_per_pixel = 4;
  const std::vector<LayerTrace> together = tracer.trace_layers(room_camera(), reflectors, options);
  ASSERT_EQ(together.size(), 3u);
  for (std::size_t i = 0; i < together.size(); ++i) {
    const LayerTrace alone = tracer.trace_layers(room_camera(), reflectors[i], options);
    ASSERT_GT(alone.samples.size(), 300u);
    // Beauty and background add the terms of the others' samples in another order.
    const std::size_t channels = alone.layers.channels.size();
    for (std::size_t p = 0; p < alone.layers.pixels.size(); ++p) {
      const float a = alone.layers.pixels[p];
      const float b = together[i].layers.pixels[p];
      if (p % channels < 3 || p % channels >= channels - 3) {
        EXPECT_NEAR(a, b, 1e-5F * std::max(1.0F, a));
      } else {
        EXPECT_EQ(a, b);
      }
    }
    EXPECT_EQ(together[i].samples.pixel, alone.samples.pixel);
    EXPECT_EQ(together[i].samples.shells[0].radiance, alone.samples.shells[0].radiance);
    EXPECT_EQ(together[i].samples.shells[1].radiance, alone.samples.shells[1].radiance);
    EXPECT_EQ(together[i].sample_beauty, alone.sample_beauty);
    EXPECT_LT(invariant_error(tracer, room_camera(), reflectors[i], options).worst, 1e-5F);
  }
  EXPECT_TRUE(tracer.trace_layers(room_camera(), std::vector<int>{}, options).empty());
  const std::vector<int> twice{reflectors[0], reflectors[0]};
  EXPECT_THROW(tracer.trace_layers(room_camera(), twice, options), InvalidArgument);
}

// A bowl with a foot and a rim: what lies on the convex hull cannot meet the object again, smooth or rough;
// other triangles do. The split is the proxy module's (spec G5).
TEST(Layers, PolygonsOnTheConvexHullHaveNoLocalLight) {
  for (const bool is_rough : {false, true}) {
    Scene scene = small_room();
    TriangleMesh mesh = make_torus({0, 1, 0}, 0.5F, 0.3F, 48);
    mesh.normals.clear();  // interpolated normals may reflect towards the neighbouring facet
    const std::vector<std::uint8_t> on_hull = hull_triangles(mesh.positions, mesh.triangles);
    const int ring = add_object(
        scene, mesh, is_rough ? rough(SpecularLobe::ggx, FresnelModel::schlick) : mirror(glm::vec3(0.9F)));
    const Tracer tracer(scene, {.indirect = IndirectLight::none});
    const LayerTrace trace = tracer.trace_layers(room_camera(), ring, {});
    int hull = 0;
    int covered = 0;
    for (std::size_t i = 0; i < trace.samples.size(); ++i) {
      if (on_hull[trace.samples.triangle[i]] != 0) {
        ++hull;
        EXPECT_EQ(trace.samples.shells[0].radiance[i].a, 0.0F);
      } else {
        covered += trace.samples.shells[0].radiance[i].a == 1.0F ? 1 : 0;
      }
    }
    EXPECT_GT(hull, 1000);
    EXPECT_GT(covered, 300);
  }
}

// At the silhouette of the local reflection a pixel's α is the covered fraction of its samples, and the
// distant layer does not know of the object: with or without a second body of it, it is the same.
TEST(Layers, LocalSilhouettesHaveFractionalAlphaOverAnUnchangedDistantLayer) {
  TriangleMesh plate = make_rectangle({-1, 0, 1}, {2, 0, 0}, {0, 0, -2});
  TriangleMesh both = plate;
  const TriangleMesh ball = make_sphere({0, 0.5F, 0}, 0.3F, 64);
  const auto base = static_cast<unsigned>(both.positions.size());
  both.positions.insert(both.positions.end(), ball.positions.begin(), ball.positions.end());
  both.normals.insert(both.normals.end(), ball.normals.begin(), ball.normals.end());
  both.uvs.insert(both.uvs.end(), ball.uvs.begin(), ball.uvs.end());
  for (const glm::uvec3& t : ball.triangles) both.triangles.push_back(t + base);
  const auto traced = [](const TriangleMesh& mesh) {
    Scene scene;
    scene.environment = test::constant_environment(1.0F);
    scene.environment->panorama.at(2, 1)[0] = 5.0F;  // not the same everywhere
    const int object = add_object(scene, mesh, mirror(glm::vec3(0.8F)));
    Camera camera;
    camera.eye = {0.0F, 1.2F, 2.0F};
    camera.target = {0, 0, 0};
    camera.width = camera.height = 64;
    return Tracer(scene, {.indirect = IndirectLight::none}).trace_layers(camera, object, {});
  };
  const LayerTrace with = traced(both);
  const LayerTrace without = traced(plate);
  const auto channel = [&](const char* name) {
    const auto& names = with.layers.channels;
    return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  int fractional = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const float alpha = with.layers.at(x, y)[channel("specular_local.A")];
      fractional += alpha > 0.0F && alpha < 1.0F ? 1 : 0;
    }
  }
  EXPECT_GT(fractional, 20);
  std::size_t j = 0;
  int compared = 0;
  int covered = 0;
  for (std::size_t i = 0; i < with.samples.size(); ++i) {
    if (with.samples.triangle[i] >= plate.triangles.size()) continue;  // the ball itself
    while (j < without.samples.size() && without.samples.position[j] != with.samples.position[i]) ++j;
    ASSERT_LT(j, without.samples.size());
    EXPECT_EQ(with.samples.shells[1].radiance[i], without.samples.shells[1].radiance[j]);
    EXPECT_EQ(with.samples.shells[1].hit_distance[i], without.samples.shells[1].hit_distance[j]);
    ++compared;
    covered += with.samples.shells[0].radiance[i].a == 1.0F ? 1 : 0;
  }
  EXPECT_GT(compared, 5000);
  EXPECT_GT(covered, 500);
}

// Means of the layers lose what their factors have in common inside a pixel: `covariance` says how much.
TEST(Layers, CovarianceCompletesTheMeansToTheBeauty) {
  std::vector<int> reflectors;
  const Scene scene = room_with_three_reflectors(reflectors);
  const Tracer tracer(scene, {.indirect = IndirectLight::none});
  const LayerTrace trace = tracer.trace_layers(room_camera(24), reflectors[2], {});
  const auto channel = [&](const char* name) {
    const auto& names = trace.layers.channels;
    return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  std::vector<double> beauty(24 * 24, 0.0);
  std::vector<int> count(24 * 24, 0);
  for (std::size_t i = 0; i < trace.samples.size(); ++i) {
    beauty[trace.samples.pixel[i]] += static_cast<double>(trace.sample_beauty[i].r);
    ++count[trace.samples.pixel[i]];
  }
  double largest = 0.0;
  for (int p = 0; p < 24 * 24; ++p) {
    if (count[static_cast<std::size_t>(p)] == 0) continue;
    const float* pixel = trace.layers.at(p % 24, p / 24);
    const auto at = [&](const char* name) { return static_cast<double>(pixel[channel(name)]); };
    const double of_means =
        at("diffuse.R") + at("fresnel.R") * (at("specular_local.R") +
                                             (1.0 - at("specular_local.A")) * at("specular_distant.R"));
    const double mean = beauty[static_cast<std::size_t>(p)] / count[static_cast<std::size_t>(p)];
    EXPECT_NEAR(of_means + at("covariance.R"), mean, 1e-5 * std::max(1.0, mean));
    largest = std::max(largest, std::abs(at("covariance.R")));
  }
  EXPECT_GT(largest, 1e-3);
}

TEST(Layers, AWindowIsAPartOfTheWholeImage) {
  std::vector<int> reflectors;
  const Scene scene = room_with_three_reflectors(reflectors);
  const Tracer tracer(scene, {.indirect = IndirectLight::path});
  TraceOptions options;
  options.samples_per_pixel = 4;
  const Image whole = tracer.trace_beauty(room_camera(), options);
  const Image geometry = tracer.trace_geometry(room_camera(), options);
  options.window = {17, 9, 21, 30};
  const Image part = tracer.trace_beauty(room_camera(), options);
  const Image part_geometry = tracer.trace_geometry(room_camera(), options);
  const LayerTrace layers = tracer.trace_layers(room_camera(), reflectors[0], options);
  ASSERT_EQ(part.width, 21);
  ASSERT_EQ(part.height, 30);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 21; ++x) {
      for (int c = 0; c < 3; ++c) {
        EXPECT_EQ(part.at(x, y)[c], whole.at(x + 17, y + 9)[c]);
        // The terms of a sample are added in another order.
        EXPECT_NEAR(layers.layers.at(x, y)[c], whole.at(x + 17, y + 9)[c],
                    1e-5F * std::max(1.0F, whole.at(x + 17, y + 9)[c]));
      }
      for (int c = 0; c < geometry.channel_count(); ++c) {
        EXPECT_EQ(part_geometry.at(x, y)[c], geometry.at(x + 17, y + 9)[c]);
      }
    }
  }
  options.window = {40, 0, 9, 4};
  EXPECT_THROW(tracer.trace_beauty(room_camera(), options), InvalidArgument);
}

// The achieved noise is what repeated images scatter by, up to the gain of stratification.
TEST(Layers, TracingToANoiseReachesItOnAnyNumberOfThreads) {
  Scene scene = small_room();
  add_object(scene, make_box({-1.2F, 0, -1.2F}, {-0.2F, 1.5F, -0.3F}), matte(glm::vec3(0.7F)));
  const Tracer tracer(scene, {.indirect = IndirectLight::path});
  TraceOptions options;
  options.samples_per_pixel = 1024;
  const BeautyTrace trace = tracer.trace_beauty_to_noise(room_camera(), 0.05F, options);
  EXPECT_EQ(trace.share_above, 0.0);
  EXPECT_LE(trace.noise, 0.05);
  EXPECT_GT(trace.mean_samples_per_pixel, 16.0);
  EXPECT_LT(trace.mean_samples_per_pixel, 1024.0);
  {
    const ThreadLimit one(1);
    EXPECT_EQ(tracer.trace_beauty_to_noise(room_camera(), 0.05F, options).image.pixels, trace.image.pixels);
  }
  TraceOptions long_run;
  long_run.samples_per_pixel = 1024;
  long_run.seed = 5;
  const Image reference = tracer.trace_beauty(room_camera(), long_run);
  double error = 0.0;
  double mean = 0.0;
  const int count = reference.width * reference.height;
  for (int i = 0; i < count; ++i) {
    const auto p = static_cast<std::size_t>(3 * i + 1);
    error +=
        std::pow(static_cast<double>(trace.image.pixels[p]) - static_cast<double>(reference.pixels[p]), 2);
    mean += static_cast<double>(reference.pixels[p]);
  }
  EXPECT_LT(std::sqrt(error / count), 2.0 * 0.05 * mean / count);
  options.samples_per_pixel = 32;
  EXPECT_GT(tracer.trace_beauty_to_noise(room_camera(), 0.001F, options).share_above, 0.5);
  options.samples_per_pixel = 15;
  EXPECT_THROW(tracer.trace_beauty_to_noise(room_camera(), 0.05F, options), InvalidArgument);
  EXPECT_THROW(tracer.trace_beauty_to_noise(room_camera(), 0.0F, {}), InvalidArgument);
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
    EXPECT_TRUE(std::isinf(trace.samples.shells[1].hit_distance[i]));
    EXPECT_NEAR(trace.samples.shells[1].radiance[i].x, 2.0F, 1e-6F);
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
        sum_alpha += trace.samples.shells[0].radiance[i].a;
        sum_green += trace.samples.shells[1].radiance[i].g;
        sum_normal += trace.samples.normal[i].y;
      }
      const float* pixel = trace.layers.at(x, y);
      EXPECT_EQ(pixel[coverage], count / 8);
      const double share = count > 0 ? 1 / count : 0;
      EXPECT_NEAR(pixel[alpha], sum_alpha * share, 1e-6);
      EXPECT_NEAR(pixel[green], sum_green * share, 1e-5);
      EXPECT_NEAR(pixel[normal], sum_normal * share, 1e-6);
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(pixel[c], beauty.at(x, y)[c], 1e-5F * std::max(1.0F, beauty.at(x, y)[c]));
      }
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
  EXPECT_TRUE(b.diffuse.empty() && b.shells.empty());
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
  EXPECT_EQ(many.samples.shells[0].radiance, single.samples.shells[0].radiance);
  EXPECT_EQ(many.samples.shells[1].radiance, single.samples.shells[1].radiance);
  EXPECT_EQ(many.sample_beauty, single.sample_beauty);
}

}  // namespace
}  // namespace mirrorbake
