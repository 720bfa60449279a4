#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>
#include <glm/geometric.hpp>

#include "light_estimates.hpp"
#include "scenes.hpp"

// Light that arrives by way of other surfaces: the cache and paths.
namespace mirrorbake {
namespace {

using test::add_object;
using test::constant_environment;
using test::estimate;
using test::Estimate;
using test::floor_at;
using test::indirect;
using test::kPi;
using test::matte;
using test::mirror;
using test::spot;

// Closed furnace: walls that emit e and reflect a hold the radiance e (1 + a + a² + …).
TEST(IndirectLight, ClosedFurnaceSumsTheGeometricSeries) {
  const float emission = 0.7F;
  const double albedo = 0.5;
  Scene scene;
  Material wall = matte(glm::vec3(static_cast<float>(albedo)));
  wall.emission = glm::vec3(emission);
  TriangleMesh sphere = make_sphere(glm::vec3(0.0F), 1.0F, 32);
  for (glm::uvec3& t : sphere.triangles) std::swap(t.y, t.z);  // facing inwards
  sphere.normals.clear();  // flat: interpolated normals lose what lies between them and the facets
  add_object(scene, sphere, wall);
  Camera camera;
  camera.eye = {0.1F, 0.2F, 0.3F};
  camera.target = {0, 0, -1};
  camera.width = camera.height = 32;
  TraceOptions options;
  options.samples_per_pixel = 64;
  options.max_diffuse_depth = 3;
  {
    // Next-event estimation adds the bounce that ends the path: 1 + 3 diffuse bounces in all.
    double expected = emission;
    for (int i = 1; i <= 4; ++i) expected += emission * std::pow(albedo, i);
    const Tracer tracer(scene, indirect(IndirectLight::path));
    const Estimate got = estimate(tracer.trace_beauty(camera, options));
    EXPECT_NEAR(got.mean, expected, 4.0 * got.error + 1e-4);
    EXPECT_LT(got.error, 0.01);
  }
  {
    // What comes after the bounces that the cache follows goes on as they did.
    const double expected = emission / (1.0 - albedo);
    const Tracer tracer(scene, indirect(IndirectLight::cached));
    const Estimate got = estimate(tracer.trace_beauty(camera, options));
    // The cache's own noise is common to neighbouring pixels.
    EXPECT_NEAR(got.mean, expected, 0.004);
  }
}

// Two metres wide, in squares of a tenth of a metre.
TriangleMesh cut_floor() {
  constexpr float kCell = 0.1F;
  constexpr int kCells = 20;
  TriangleMesh floor;
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      const glm::vec3 corner(-1.0F + kCell * static_cast<float>(i), 0, 1.0F - kCell * static_cast<float>(j));
      const TriangleMesh cell = make_rectangle(corner, {kCell, 0, 0}, {0, 0, -kCell});
      const auto first = static_cast<std::uint32_t>(floor.positions.size());
      floor.positions.insert(floor.positions.end(), cell.positions.begin(), cell.positions.end());
      for (const glm::uvec3& t : cell.triangles) floor.triangles.push_back(t + first);
    }
  }
  return floor;
}

// A parallelogram in parts that share their vertices, so many along each edge.
TriangleMesh grid(glm::vec3 corner, glm::vec3 u, glm::vec3 v, unsigned along_u, unsigned along_v) {
  TriangleMesh mesh;
  for (unsigned j = 0; j <= along_v; ++j) {
    for (unsigned i = 0; i <= along_u; ++i) {
      mesh.positions.push_back(corner + u * (static_cast<float>(i) / static_cast<float>(along_u)) +
                               v * (static_cast<float>(j) / static_cast<float>(along_v)));
    }
  }
  for (unsigned j = 0; j < along_v; ++j) {
    for (unsigned i = 0; i < along_u; ++i) {
      const unsigned a = j * (along_u + 1) + i;
      mesh.triangles.push_back({a, a + 1, a + along_u + 2});
      mesh.triangles.push_back({a, a + along_u + 2, a + along_u + 1});
    }
  }
  return mesh;
}

SpotLight spot_light_upwards(float height) {
  SpotLight light;
  light.position = {0, height, 0};
  light.direction = {0, 1, 0};
  light.intensity = glm::vec3(100.0F);
  light.inner_degrees = 10.0F;
  light.outer_degrees = 12.0F;
  return light;
}

// A lamp in a flat mirror lights a floor as its image behind the mirror would.
TEST(IndirectLight, CacheHoldsCaustics) {
  Scene scene;
  const float albedo = 0.5F;
  add_object(scene, cut_floor(), matte(glm::vec3(albedo)));
  add_object(scene, make_rectangle({1, 0, -1}, {0, 0, 2}, {0, 2, 0}), mirror(glm::vec3(1.0F)));
  SphereLight lamp;
  lamp.centre = {0, 1, 0};
  lamp.radius = 0.1F;
  lamp.radiance = glm::vec3(10.0F);
  scene.sphere_lights.push_back(lamp);
  TracerOptions options = indirect(IndirectLight::cached);
  options.cache_rays = 2048;
  const Tracer cached(scene, options);
  const Tracer direct_only(scene, indirect(IndirectLight::none));
  for (const glm::vec3 point : {glm::vec3(0.3F, 0, 0), glm::vec3(-0.4F, 0, 0.3F)}) {
    const glm::vec3 to_image = glm::vec3(2, 1, 0) - point;
    const double d2 = glm::dot(to_image, to_image);
    const double irradiance = 10.0 * kPi * 0.01 / d2 / std::sqrt(d2);
    const double expected = albedo / kPi * irradiance;
    const double got = estimate(cached.trace_beauty(spot(point), {})).mean -
                       estimate(direct_only.trace_beauty(spot(point), {})).mean;
    // For the noise of some corners' rays, and interpolation over a tenth of a metre.
    EXPECT_NEAR(got, expected, 0.03 * expected) << point.x;
  }
}

// The two ways to follow diffuse light agree where the cache can be exact: a finely cut open box.
TEST(IndirectLight, CachedAndPathIndirectLightAgree) {
  Scene scene;
  const auto wall = [&](glm::vec3 corner, glm::vec3 u, glm::vec3 v, glm::vec3 albedo) {
    add_object(scene, grid(corner, u, v, 12, 12), matte(albedo));
  };
  wall({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, glm::vec3(0.7F));              // floor
  wall({-1, 0, -1}, {2, 0, 0}, {0, 2, 0}, glm::vec3(0.7F, 0.5F, 0.3F));  // back
  wall({-1, 0, 1}, {0, 0, -2}, {0, 2, 0}, glm::vec3(0.8F, 0.1F, 0.1F));  // left
  RectangleLight light;
  light.corner = {0.2F, 1.9F, 0.2F};
  light.edge_u = {0.5F, 0, 0};
  light.edge_v = {0, 0, 0.5F};
  light.radiance = glm::vec3(20.0F);
  scene.rectangle_lights.push_back(light);
  TracerOptions cached = indirect(IndirectLight::cached);
  cached.cache_bounces = 4;
  cached.cache_rays = 512;
  const Tracer with_cache(scene, cached);
  const Tracer with_paths(scene, indirect(IndirectLight::path));
  const Tracer direct_only(scene, indirect(IndirectLight::none));
  for (glm::vec3 point : {glm::vec3(-0.6F, 0, -0.5F), glm::vec3(0.5F, 0, 0.1F)}) {
    for (int channel = 0; channel < 3; ++channel) {
      const double a = estimate(with_cache.trace_beauty(spot(point), {}), channel).mean;
      const Estimate b = estimate(with_paths.trace_beauty(spot(point), {}), channel);
      const double c = estimate(direct_only.trace_beauty(spot(point), {}), channel).mean;
      // 3 % of the indirect light for the cache's noise at 512 rays and its interpolation over a sixth of a
      // metre.
      EXPECT_NEAR(a, b.mean, 4 * b.error + 0.03 * (b.mean - c)) << channel;
      EXPECT_GT(b.mean - c, 0.02 * b.mean);
    }
  }
}

// A spot light on a ceiling's small plate, which rays of a random direction from the floor meet once in two
// thousand times: 64 of them would find nothing, or thirty times too much.
TEST(IndirectLight, CacheFindsSmallBrightSurfaces) {
  constexpr float kSide = 0.04F;
  constexpr float kAlbedo = 0.5F;
  Scene scene;
  add_object(scene, cut_floor(), matte(glm::vec3(kAlbedo)));
  add_object(scene, make_rectangle({-kSide / 2, 1, -kSide / 2}, {kSide, 0, 0}, {0, 0, kSide}),
             matte(glm::vec3(kAlbedo)));
  scene.spot_lights.push_back(spot_light_upwards(0.5F));
  const double radiance = kAlbedo / kPi * 100.0 / 0.25;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    TracerOptions options = indirect(IndirectLight::cached);
    options.seed = seed;
    const Tracer tracer(scene, options);
    for (const glm::vec3 point : {glm::vec3(0.3F, 0, 0), glm::vec3(-0.8F, 0, 0.9F)}) {
      const double squared = 1.0 + static_cast<double>(glm::dot(point, point));
      const double expected = kAlbedo / kPi * radiance * kSide * kSide / (squared * squared);
      // For interpolation over a tenth of a metre.
      EXPECT_NEAR(estimate(tracer.trace_beauty(spot(point), {})).mean, expected, 0.03 * expected) << point.x;
    }
  }
}

// A bright spot lights the floor below it as 1 / (1 + r²/h²)²: what is interpolated between the corners of a
// triangle on top of that hill lacks 4 % in the mean.
TEST(IndirectLight, CacheHasTheMeanOfCurvedLight) {
  constexpr float kSide = 0.02F;
  constexpr float kHeight = 0.4F;
  constexpr float kAlbedo = 0.5F;
  Scene scene;
  add_object(scene, grid({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 20, 20), matte(glm::vec3(kAlbedo)));
  add_object(scene, make_rectangle({-kSide / 2, kHeight, -kSide / 2}, {kSide, 0, 0}, {0, 0, kSide}),
             matte(glm::vec3(kAlbedo)));
  scene.spot_lights.push_back(spot_light_upwards(kHeight / 2));
  const double radiance = kAlbedo / kPi * 100.0 / (0.25 * kHeight * kHeight);
  TracerOptions options = indirect(IndirectLight::cached);
  options.cache_rays = 512;
  const Tracer tracer(scene, options);
  double seen = 0.0;
  double expected = 0.0;
  constexpr int kParts = 4;  // of the triangle's edges
  for (int i = 0; i < kParts; ++i) {
    for (int j = 0; i + j < kParts; ++j) {
      const glm::vec2 b = (glm::vec2(i, j) + 1.0F / 3.0F) / static_cast<float>(kParts);
      const glm::vec3 point = 0.1F * glm::vec3(b.x + b.y, 0, -b.y);
      const double squared = static_cast<double>(kHeight * kHeight + glm::dot(point, point));
      expected += kAlbedo / kPi * radiance * kSide * kSide * kHeight * kHeight / (squared * squared);
      seen += estimate(tracer.trace_beauty(spot(point), {})).mean;
    }
  }
  EXPECT_NEAR(seen, expected, 0.015 * expected);
}

// What nodes' rays miss or find too often is made up for by their neighbours: the mean over a strip of floor
// has a fraction of the noise that it would have if nodes were independent of each other.
TEST(IndirectLight, ErrorsOfCloseNodesCancel) {
  constexpr unsigned kCells = 128;
  constexpr int kSeeds = 32;
  Scene scene;
  add_object(scene, grid({-0.5F, 0, 0.01F}, {1, 0, 0}, {0, 0, -0.02F}, kCells, 1), matte(glm::vec3(0.5F)));
  add_object(scene, make_rectangle({-0.3F, 0.8F, -0.3F}, {0.6F, 0, 0}, {0, 0, 0.6F}), matte(glm::vec3(0.8F)));
  scene.point_lights.push_back({glm::vec3(0.0F, 0.4F, 0.0F), glm::vec3(1.0F)});
  Camera camera;
  camera.eye = {0, 0.7F, 0};
  camera.target = {0, 0, 0};
  camera.up = {0, 0, -1};
  camera.vertical_fov_degrees = 0.5F;
  camera.width = kCells;
  camera.height = 1;
  std::vector<double> mean;
  std::vector<std::vector<double>> of_pixel(kCells);
  for (int seed = 0; seed < kSeeds; ++seed) {
    TracerOptions options = indirect(IndirectLight::cached);
    options.seed = static_cast<std::uint64_t>(seed);
    options.cache_bounces = 1;  // later ones bring the noise of the four nodes above
    const Image image = Tracer(scene, options).trace_beauty(camera, {});
    for (int x = 0; x < camera.width; ++x) {
      of_pixel[static_cast<std::size_t>(x)].push_back(image.at(x, 0)[0]);
    }
    mean.push_back(estimate(image).mean);
  }
  const auto variance = [](const std::vector<double>& values) {
    const double middle = std::accumulate(values.begin(), values.end(), 0.0) / kSeeds;
    double sum = 0.0;
    for (const double v : values) sum += (v - middle) * (v - middle);
    return sum / (kSeeds - 1);
  };
  double of_pixels = 0.0;
  for (const std::vector<double>& values : of_pixel) of_pixels += variance(values) / kCells;
  // Of independent nodes it would be about twice this, since a pixel lies between three.
  EXPECT_LT(variance(mean), of_pixels / kCells);
}

// Indirect light that cameras see, summed over them: by paths, with their standard error, and by other
// tracers.
struct Glow {
  double of_paths = 0.0;
  double error = 0.0;
  std::vector<double> seen;
};
Glow glow_in(const Scene& scene, const std::vector<Camera>& cameras,
             const std::vector<const Tracer*>& tracers) {
  const Tracer with_paths(scene, indirect(IndirectLight::path));
  const Tracer direct_only(scene, indirect(IndirectLight::none));
  Glow glow;
  glow.seen.resize(tracers.size(), 0.0);
  for (const Camera& camera : cameras) {
    const double direct = estimate(direct_only.trace_beauty(camera, {})).mean;
    const Estimate path = estimate(with_paths.trace_beauty(camera, {}));
    glow.of_paths += path.mean - direct;
    glow.error += path.error;
    for (std::size_t i = 0; i < tracers.size(); ++i) {
      glow.seen[i] += estimate(tracers[i]->trace_beauty(camera, {})).mean - direct;
    }
  }
  return glow;
}

// A ground of two triangles, ten times as wide as what stands on it: vertices alone know nothing of its glow.
TEST(IndirectLight, CacheIsFinerAroundTheFocus) {
  Scene scene;
  constexpr float kRadius = 0.1F;
  const int ball = add_object(scene, make_sphere({0, kRadius, 0}, kRadius, 32), matte(glm::vec3(0.8F)));
  add_object(scene, make_rectangle({-1, 0, 1.5F}, {2, 0, 0}, {0, 0, -2}), matte(glm::vec3(0.5F)));
  scene.environment = constant_environment(1.0F);
  TracerOptions options = indirect(IndirectLight::cached);
  options.cache_rays = 2048;
  const Tracer of_vertices(scene, options);
  options.focus = ball;
  const Tracer with_focus(scene, options);
  std::vector<Camera> cameras;
  for (const float x : {-0.2F, 0.12F, 0.16F, 0.25F}) cameras.push_back(spot({x, 0, 0.01F}));
  const Glow glow = glow_in(scene, cameras, {&of_vertices, &with_focus});
  ASSERT_GT(glow.of_paths, 100.0 * glow.error);
  EXPECT_LT(glow.seen[0], 0.1 * glow.of_paths);
  // For the noise of some nodes' rays, few of which meet the ball.
  EXPECT_NEAR(glow.seen[1], glow.of_paths, 0.08 * glow.of_paths);
}

// A board that stands off a wall: nodes of the wall behind it are dark, and those of coarse cells would darken
// what is above its edge.
TEST(IndirectLight, CacheIsFinerWhereLightChangesAtAStep) {
  Scene scene;
  const int ball = add_object(scene, make_sphere({0, 0.1F, 0}, 0.1F, 32), matte(glm::vec3(0.0F)));
  const Material white = matte(glm::vec3(0.8F));
  add_object(scene, make_rectangle({-2, 0, -1.5F}, {4, 0, 0}, {0, 2, 0}), white);
  add_object(scene, make_rectangle({-2, 0, 2.5F}, {4, 0, 0}, {0, 0, -4}), white);
  constexpr float kEdge = 0.67F;
  add_object(scene, make_rectangle({-1, 0, -1.47F}, {2, 0, 0}, {0, kEdge, 0}), white);
  scene.environment = constant_environment(1.0F);
  TracerOptions options = indirect(IndirectLight::cached);
  options.cache_rays = 512;
  options.focus = ball;
  const Tracer cached(scene, options);
  std::vector<Camera> cameras;
  for (const float x : {-0.55F, -0.2F, 0.07F, 0.31F, 0.6F}) {
    cameras.push_back(spot({x, kEdge + 0.05F, -1.5F}));
    cameras.back().eye = {x, 1.2F, 0.4F};
  }
  const Glow glow = glow_in(scene, cameras, {&cached});
  ASSERT_GT(glow.of_paths, 100.0 * glow.error);
  EXPECT_NEAR(glow.seen[0], glow.of_paths, 0.04 * glow.of_paths);
}

TEST(IndirectLight, FocusIsAnObjectOrNone) {
  Scene scene;
  add_object(scene, floor_at(0.0F), matte(glm::vec3(0.5F)));
  TracerOptions options = indirect(IndirectLight::cached);
  options.focus = -1;
  const Tracer none(scene, options);
  options.focus = 1;
  try {
    const Tracer beyond(scene, options);
    FAIL() << "an object that does not exist was taken";
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("focus"));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("1"));
  }
}

TEST(IndirectLight, VertexIrradianceOfAConstantSkyIsPi) {
  Scene scene;
  const int box = add_object(scene, make_sphere(glm::vec3(0.0F), 1.0F, 16), matte(glm::vec3(0.5F)));
  const TriangleMesh& mesh = scene.objects[0].mesh;
  std::vector<bool> used(mesh.positions.size(), false);  // the poles have vertices without a triangle
  for (const glm::uvec3& t : mesh.triangles) used[t.x] = used[t.y] = used[t.z] = true;
  scene.environment = constant_environment(1.0F);
  for (IndirectLight mode : {IndirectLight::none, IndirectLight::cached, IndirectLight::path}) {
    const Tracer tracer(scene, indirect(mode));
    const std::vector<glm::vec3> e = tracer.vertex_irradiance(box, 1024, 1);
    ASSERT_EQ(e.size(), mesh.positions.size());
    double sum = 0;
    for (std::size_t i = 0; i < e.size(); ++i) {
      // Facets of 2π/16 rad hide up to 2 % of the sky above the interpolated normals' horizon.
      EXPECT_NEAR(e[i].x, used[i] ? kPi : 0.0, 0.1 * kPi);
      sum += e[i].x;
    }
    EXPECT_NEAR(sum / static_cast<double>(std::count(used.begin(), used.end(), true)), kPi, 0.03 * kPi);
  }
}

// A point light of intensity I at height h: E = I h / (h² + x²)^(3/2) below.
TEST(IndirectLight, OfSurfacePointsIsEachOnesOwn) {
  Scene scene;
  const int floor = add_object(scene, floor_at(0.0F), matte(glm::vec3(0.5F)));
  scene.point_lights.push_back({glm::vec3(0.0F, 2.0F, 0.0F), glm::vec3(3.0F)});
  const Tracer tracer(scene, indirect(IndirectLight::none));
  const TriangleMesh& mesh = scene.objects[0].mesh;
  std::vector<std::uint32_t> triangles;
  std::vector<glm::vec2> barycentric;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const glm::vec2 b : {glm::vec2(0.3F, 0.3F), glm::vec2(0.1F, 0.8F), glm::vec2(0.5F, 0.49F)}) {
      triangles.push_back(t);
      barycentric.push_back(b);
    }
  }
  const std::vector<glm::vec3> found = tracer.surface_irradiance(floor, triangles, barycentric, 4, 1);
  const std::vector<glm::vec3> below =
      tracer.surface_irradiance(floor, triangles, barycentric, 4, 1, SurfaceSide::back);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const glm::uvec3 t = mesh.triangles[triangles[i]];
    const glm::vec2 b = barycentric[i];
    const glm::vec3 p =
        (1.0F - b.x - b.y) * mesh.positions[t.x] + b.x * mesh.positions[t.y] + b.y * mesh.positions[t.z];
    const double expected = 6.0 / std::pow(4.0 + glm::dot(p, p), 1.5);
    EXPECT_NEAR(found[i].x, expected, 1e-5 * expected);
    EXPECT_EQ(below[i], glm::vec3(0.0F));
  }
  barycentric.pop_back();
  EXPECT_THROW(tracer.surface_irradiance(floor, triangles, barycentric, 4, 1), InvalidArgument);
  triangles = {static_cast<std::uint32_t>(mesh.triangles.size())};
  barycentric.resize(1);
  EXPECT_THROW(tracer.surface_irradiance(floor, triangles, barycentric, 4, 1), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
