#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <glm/geometric.hpp>

#include "light_estimates.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/projection/cube.hpp"
#include "scenes.hpp"

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

TEST(Light, PointLightFallsOffWithTheSquareOfTheDistance) {
  Scene scene;
  add_object(scene, floor_at(0.0F), matte(glm::vec3(0.8F)));
  scene.point_lights.push_back({{0.0F, 2.0F, 0.0F}, glm::vec3(5.0F)});
  const Tracer tracer(scene, indirect(IndirectLight::none));
  TraceOptions options;
  options.samples_per_pixel = 1;
  for (float x : {0.0F, 1.0F, 2.5F}) {
    const Estimate got = estimate(tracer.trace_beauty(spot({x, 0, 0}), options));
    const double d2 = x * x + 4.0;
    const double expected = 0.8 / kPi * 5.0 * (2.0 / std::sqrt(d2)) / d2;
    // No noise: what is left is the size of the spot, 1e-4 m.
    EXPECT_NEAR(got.mean, expected, 2e-4 * expected);
  }
}

// Form factor of a rectangle parallel to the receiver, one corner straight above the point (Howell, A Catalog
// of Radiation Heat Transfer Configuration Factors, B-3).
double corner_form_factor(double a, double b, double c) {
  const double x = a / c;
  const double y = b / c;
  return (x / std::sqrt(1 + x * x) * std::atan(y / std::sqrt(1 + x * x)) +
          y / std::sqrt(1 + y * y) * std::atan(x / std::sqrt(1 + y * y))) /
         (2 * kPi);
}

TEST(Light, RectangleLightGivesItsFormFactor) {
  struct Case {
    float height, width, depth;
  };
  // Close (sampled by solid angle) and far away (by area).
  for (const Case c : {Case{0.3F, 1.0F, 2.0F}, Case{2.0F, 1.0F, 1.5F}, Case{40.0F, 1.0F, 1.0F}}) {
    Scene scene;
    add_object(scene, floor_at(0.0F), matte(glm::vec3(1.0F)));
    RectangleLight light;
    light.corner = {0, c.height, 0};
    light.edge_u = {c.width, 0, 0};
    light.edge_v = {0, 0, c.depth};
    light.radiance = glm::vec3(3.0F, 2.0F, 1.0F);
    scene.rectangle_lights.push_back(light);
    const double expected = 3.0 * corner_form_factor(c.width, c.depth, c.height);
    for (IndirectLight mode : {IndirectLight::none, IndirectLight::path}) {
      const Tracer tracer(scene, indirect(mode));
      Camera camera = spot(glm::vec3(0.0F));
      camera.eye = {-0.4F, 0.2F, -0.3F};
      const Estimate got = estimate(tracer.trace_beauty(camera, {}));
      EXPECT_NEAR(got.mean, expected, 4.0 * got.error + 1e-4 * expected) << "height " << c.height;
      EXPECT_LT(got.error, 0.01 * expected);
    }
  }
}

// A flat mirror shows a lamp's image as far behind it as the lamp is in front: the floor receives the image's
// form factor, less what the mirror swallows. Such light is found by rays that hit the mirror where the lamp
// is seen in it.
TEST(Light, FlatMirrorThrowsTheLampsImageOnTheFloor) {
  constexpr float kLampHeight = 1.0F;
  constexpr float kMirrorHeight = 3.0F;
  constexpr double kReflectance = 0.8;
  Scene scene;
  add_object(scene, floor_at(0.0F), matte(glm::vec3(1.0F)));
  add_object(scene, make_rectangle({-3, kMirrorHeight, -3}, {6, 0, 0}, {0, 0, 6}),
             mirror(glm::vec3(static_cast<float>(kReflectance))));
  RectangleLight light;  // faces up, so that the floor sees it in the mirror only
  light.corner = {0, kLampHeight, 0};
  light.edge_u = {0, 0, 0.4F};
  light.edge_v = {0.4F, 0, 0};
  light.radiance = glm::vec3(3.0F, 2.0F, 1.0F);
  scene.rectangle_lights.push_back(light);
  const Tracer tracer(scene, indirect(IndirectLight::path));
  TraceOptions options;
  options.samples_per_pixel = 64;
  options.max_diffuse_depth = 1;
  const glm::vec3 point(-1.0F, 0.0F, 0.0F);  // from here the lamp's dark side does not cover its image
  const double height = 2.0 * kMirrorHeight - kLampHeight;
  const double expected =
      3.0 * kReflectance * (corner_form_factor(1.4, 0.4, height) - corner_form_factor(1.0, 0.4, height));
  const Estimate got = estimate(tracer.trace_beauty(spot(point), options));
  EXPECT_NEAR(got.mean, expected, 4.0 * got.error + 1e-4 * expected);
  // A cosine distribution finds the image with the probability p of its form factor, 0.0018: a pixel's mean
  // of 64 is off by √((1/p − 1)/64) = 2.9 times itself, that of 64² pixels by 4.6 %. The guide is to do five
  // times as well.
  EXPECT_LT(got.error, 0.009 * expected);
  EXPECT_GT(got.error, 0.0);
}

// A sphere above the horizon gives π L (r/d)² cosθ, whatever its size (Howell, B-18).
TEST(Light, SphereLightGivesItsFormFactor) {
  for (const float height : {1.1F, 3.0F, 200.0F}) {
    Scene scene;
    add_object(scene, floor_at(0.0F), matte(glm::vec3(1.0F)));
    scene.sphere_lights.push_back({{0.5F, height, 0.0F}, 1.0F, glm::vec3(3.0F, 2.0F, 1.0F)});
    const double d2 = 0.25 + static_cast<double>(height) * height;
    const double expected = 3.0 / d2 * height / std::sqrt(d2);
    for (IndirectLight mode : {IndirectLight::none, IndirectLight::path}) {
      const Tracer tracer(scene, indirect(mode));
      Camera camera = spot(glm::vec3(0.0F));
      camera.eye = {-0.9F, 0.2F, -0.3F};
      const Estimate got = estimate(tracer.trace_beauty(camera, {}));
      EXPECT_NEAR(got.mean, expected, 4.0 * got.error + 1e-3 * expected) << "height " << height;
      EXPECT_LT(got.error, 0.01 * expected);
    }
  }
}

TEST(Light, SphereLightIsVisibleFromOutsideOnly) {
  Scene scene;
  add_object(scene, floor_at(-5.0F), matte(glm::vec3(0.0F)));
  scene.sphere_lights.push_back({{0.0F, 0.0F, 0.0F}, 1.0F, glm::vec3(4.0F)});
  const Tracer tracer(scene, indirect(IndirectLight::none));
  Camera camera;
  camera.eye = {0, 0, 5};
  camera.target = {0, 0, 0};
  camera.vertical_fov_degrees = 5.0F;
  camera.width = camera.height = 8;
  EXPECT_EQ(estimate(tracer.trace_beauty(camera, {})).mean, 4.0);
  camera.eye = {0, 0, 0.5F};
  EXPECT_EQ(estimate(tracer.trace_beauty(camera, {})).mean, 0.0);
}

TEST(Light, DirectionalLightGivesItsIrradianceTimesTheCosine) {
  Scene scene;
  add_object(scene, floor_at(0.0F), matte(glm::vec3(0.8F)));
  scene.directional_lights.push_back({glm::normalize(glm::vec3(0.0F, -4.0F, 3.0F)), glm::vec3(2.0F)});
  const Tracer tracer(scene, indirect(IndirectLight::path));
  const Estimate got = estimate(tracer.trace_beauty(spot(glm::vec3(0.0F)), {}));
  EXPECT_NEAR(got.mean, 0.8 / kPi * 2.0 * 0.8, 1e-6);
}

TEST(Light, SpotLightFallsOffBetweenItsCones) {
  Scene scene;
  add_object(scene, floor_at(0.0F), matte(glm::vec3(1.0F)));
  SpotLight light;
  light.position = {0.0F, 2.0F, 0.0F};
  light.intensity = glm::vec3(5.0F);
  light.inner_degrees = 20.0F;
  light.outer_degrees = 40.0F;
  scene.spot_lights.push_back(light);
  const Tracer tracer(scene, indirect(IndirectLight::none));
  TraceOptions options;
  options.samples_per_pixel = 1;
  for (const float x : {0.0F, 0.5F, 1.2F, 2.0F}) {
    const Estimate got = estimate(tracer.trace_beauty(spot({x, 0, 0}), options));
    const double d2 = 4.0 + static_cast<double>(x) * x;
    const double cosine = 2.0 / std::sqrt(d2);
    const double low = std::cos(40.0 * kPi / 180.0);
    const double ramp = std::clamp((cosine - low) / (std::cos(20.0 * kPi / 180.0) - low), 0.0, 1.0);
    const double expected = 5.0 / kPi * cosine / d2 * ramp * ramp;
    EXPECT_NEAR(got.mean, expected, 2e-3 * expected);  // the spot on the floor is 1e-4 m wide
  }
}

// What an object is invisible to passes through it, and the two ways to find its light still add up.
TEST(Light, VisibilitySetsHideObjectsFromKindsOfRays) {
  const auto lit = [](Visibility visibility, IndirectLight mode, int more_objects) {
    Scene scene;
    add_object(scene, floor_at(0.0F), matte(glm::vec3(1.0F)));
    Material glow = matte(glm::vec3(0.0F));
    glow.emission = glm::vec3(3.0F);
    const int lamp = add_object(scene, make_rectangle({0, 1.0F, 0}, {1, 0, 0}, {0, 0, 1.5F}), glow);
    scene.objects[static_cast<std::size_t>(lamp)].visibility = visibility;
    // More restricted objects than Embree's mask has bits.
    for (int i = 0; i < more_objects; ++i) {
      const int far = add_object(scene, make_sphere({100.0F, static_cast<float>(i), 0}, 0.1F, 8), glow);
      scene.objects[static_cast<std::size_t>(far)].visibility = Visibility::camera;
      scene.materials.back().emission = glm::vec3(0.0F);
    }
    const Tracer tracer(scene, indirect(mode));
    Camera camera = spot(glm::vec3(0.0F));
    camera.eye = {-0.4F, 0.2F, -0.3F};
    return estimate(tracer.trace_beauty(camera, {}));
  };
  const double expected = 3.0 * corner_form_factor(1.0, 1.5, 1.0);
  for (const int more : {0, 40}) {
    for (const Visibility v :
         {Visibility::all, Visibility::camera, Visibility::none, Visibility::reflection}) {
      for (IndirectLight mode : {IndirectLight::none, IndirectLight::path}) {
        const Estimate got = lit(v, mode, more);
        EXPECT_NEAR(got.mean, expected, 4.0 * got.error + 1e-4 * expected) << static_cast<int>(v);
      }
    }
  }
  // A sheet between floor and light: only shadow rays decide what falls through it.
  for (const Visibility v :
       {Visibility::all, Visibility::camera | Visibility::reflection, Visibility::shadow}) {
    Scene scene;
    add_object(scene, floor_at(0.0F), matte(glm::vec3(1.0F)));
    const int sheet = add_object(scene, floor_at(1.0F), matte(glm::vec3(0.25F)));
    scene.objects[static_cast<std::size_t>(sheet)].visibility = v;
    scene.point_lights.push_back({{0.0F, 2.0F, 0.0F}, glm::vec3(4.0F * std::numbers::pi_v<float>)});
    const Tracer tracer(scene, indirect(IndirectLight::none));
    Camera above = spot(glm::vec3(0.0F));
    above.eye = {0.02F, 1.8F, 0.0F};
    const bool seen = (v & Visibility::camera) != Visibility::none;
    const bool blocks = (v & Visibility::shadow) != Visibility::none;
    const double sheet_radiance = 0.25 * 4.0;  // at a distance of 1
    const double floor_radiance = blocks ? 0.0 : 1.0;
    EXPECT_NEAR(estimate(tracer.trace_beauty(above, {})).mean, seen ? sheet_radiance : floor_radiance, 2e-3);
  }
}

TEST(Light, TexturesScaleEmissionReflectanceAndRoughness) {
  Texture half;
  half.image = Image(1, 1, {"Y"});
  half.image.pixels = {0.5F};
  const auto traced = [&](bool textured) {
    Scene scene;
    scene.textures.push_back(half);
    const TextureReference reference{textured ? 0 : -1};
    const float scale = textured ? 1.0F : 0.5F;
    Material m = mirror(glm::vec3(0.8F * scale));
    m.lobe = SpecularLobe::ggx;
    m.roughness = 0.6F * scale;
    m.specular_texture = m.roughness_texture = reference;
    add_object(scene, floor_at(0.0F), m);
    Material glow = matte(glm::vec3(0.0F));
    glow.emission = glm::vec3(3.0F * scale);
    glow.emission_texture = reference;
    add_object(scene, make_rectangle({0, 1.0F, 0}, {1, 0, 0}, {0, 0, 1.5F}), glow);
    Camera camera = spot(glm::vec3(0.0F));
    camera.eye = {-0.4F, 0.2F, -0.3F};
    return Tracer(scene, indirect(IndirectLight::path)).trace_beauty(camera, {}).pixels;
  };
  const std::vector<float> expected = traced(false);
  EXPECT_GT(*std::max_element(expected.begin(), expected.end()), 0.01F);
  EXPECT_EQ(traced(true), expected);
}

TEST(Light, RectangleLightIsOneSided) {
  Scene scene;
  add_object(scene, floor_at(0.0F), matte(glm::vec3(1.0F)));
  RectangleLight light;
  light.corner = {-0.5F, 1.0F, -0.5F};
  light.edge_u = {0, 0, 1};
  light.edge_v = {1, 0, 0};  // u × v points up
  scene.rectangle_lights.push_back(light);
  for (IndirectLight mode : {IndirectLight::none, IndirectLight::path}) {
    const Tracer tracer(scene, indirect(mode));
    EXPECT_EQ(estimate(tracer.trace_beauty(spot({1, 0, 0}), {})).mean, 0.0);
    Camera from_above;
    from_above.eye = {0, 5, 0};
    from_above.target = {0, 1, 0};
    from_above.up = {0, 0, 1};
    from_above.vertical_fov_degrees = 1.0F;
    from_above.width = from_above.height = 4;
    EXPECT_EQ(estimate(tracer.trace_beauty(from_above, {})).mean, 1.0);
    from_above.eye = {0, 0.5F, 0};
    EXPECT_EQ(estimate(tracer.trace_beauty(from_above, {})).mean, 0.0);
  }
}

// A mesh light of the same shape must give what the rectangle light gives.
TEST(Light, EmissiveMeshMatchesRectangleLight) {
  Scene scene;
  add_object(scene, floor_at(0.0F), matte(glm::vec3(1.0F)));
  Material glow = matte(glm::vec3(0.0F));
  glow.emission = glm::vec3(3.0F);
  add_object(scene, make_rectangle({0, 1.0F, 0}, {1, 0, 0}, {0, 0, 1.5F}), glow);
  const double expected = 3.0 * corner_form_factor(1.0, 1.5, 1.0);
  for (IndirectLight mode : {IndirectLight::none, IndirectLight::path}) {
    const Tracer tracer(scene, indirect(mode));
    Camera camera = spot(glm::vec3(0.0F));
    camera.eye = {-0.4F, 0.2F, -0.3F};
    const Estimate got = estimate(tracer.trace_beauty(camera, {}));
    EXPECT_NEAR(got.mean, expected, 4.0 * got.error + 1e-4 * expected);
    EXPECT_LT(got.error, 0.01 * expected);
  }
}

// White furnace: a convex body of albedo a under radiance 1 from everywhere reflects a.
TEST(Light, ConvexBodyUnderAConstantSkyReflectsItsAlbedo) {
  for (IndirectLight mode : {IndirectLight::none, IndirectLight::cached, IndirectLight::path}) {
    for (float albedo : {0.0F, 0.3F, 1.0F}) {
      Scene scene;
      add_object(scene, make_box(glm::vec3(-1.0F), glm::vec3(1.0F)), matte(glm::vec3(albedo)));
      scene.environment = constant_environment(1.0F);
      const Tracer tracer(scene, indirect(mode));
      Camera camera;
      camera.eye = {0.3F, 0.5F, 4.0F};
      camera.vertical_fov_degrees = 5.0F;
      camera.width = camera.height = 64;
      TraceOptions options;
      options.samples_per_pixel = 64;
      const Estimate got = estimate(tracer.trace_beauty(camera, options));
      EXPECT_NEAR(got.mean, albedo, 4.0 * got.error + 1e-5) << "mode " << static_cast<int>(mode);
      EXPECT_LT(got.error, 0.01);
    }
  }
}

// Panorama with one bright texel: the direction convention, and that importance sampling knows of the
// rotation.
TEST(Light, EnvironmentFollowsTheLatitudeLongitudeConvention) {
  const auto look = [](const Tracer& tracer, glm::vec3 direction) {
    Camera camera;
    camera.eye = {0, 50, 0};
    camera.target = camera.eye + direction;
    camera.vertical_fov_degrees = 0.1F;
    camera.width = camera.height = 2;
    return tracer.trace_beauty(camera, {}).at(0, 0)[0];
  };
  Scene scene;
  add_object(scene, floor_at(0.0F), matte(glm::vec3(1.0F)));
  EnvironmentLight light;
  light.panorama = Image(64, 32, {"R", "G", "B"});
  // Right of the centre by a quarter of the width, and above the middle by a quarter of the height: +X and
  // up.
  for (int c = 0; c < 3; ++c) light.panorama.at(48, 8)[c] = 100.0F;
  scene.environment = light;
  // Centre of texel (48, 8).
  const double longitude = 2 * kPi * (48.5 / 64 - 0.5);
  const double latitude = kPi * (0.5 - 8.5 / 32);
  const auto towards = [&](double rotation) {
    // Seen from above with +X right and −Z up, counter-clockwise is from +X to −Z.
    const double a = longitude - rotation;
    return glm::vec3(std::cos(latitude) * std::sin(a), std::sin(latitude), -std::cos(latitude) * std::cos(a));
  };
  for (float degrees : {0.0F, 90.0F, -33.0F}) {
    scene.environment->rotation_degrees = degrees;
    const Tracer tracer(scene, indirect(IndirectLight::none));
    const glm::vec3 bright = towards(degrees * kPi / 180);
    EXPECT_NEAR(look(tracer, bright), 100.0F, 2.0F);  // the view is not quite on the texel's centre
    EXPECT_EQ(look(tracer, -bright), 0.0F);
    // Bilinear interpolation spreads the texel's radiance over its neighbours, and its integral is about that
    // of the texel: irradiance = 100 Ω sin(latitude) within the change of the cosine over a texel.
    const double solid_angle = 2 * kPi / 64 * (std::cos(8 * kPi / 32) - std::cos(9 * kPi / 32));
    const Estimate got = estimate(tracer.trace_beauty(spot(glm::vec3(0.0F)), {}));
    EXPECT_NEAR(got.mean, 100.0 * solid_angle * std::sin(latitude) / kPi, 0.01 * got.mean);
    EXPECT_LT(got.error, 0.01 * got.mean);
  }
}

// A sky of 1 with a sun of one texel. Next-event estimation alone looks for all of it; where rays follow the
// cosine, it looks for the sun only, and the answer is the same.
TEST(Light, EvenPartOfTheSkyIsLeftToFollowedRays) {
  Scene scene;
  add_object(scene, floor_at(0.0F), matte(glm::vec3(1.0F)));
  scene.environment = constant_environment(1.0F);
  Image& sky = scene.environment->panorama;
  sky = Image(64, 32, {"R", "G", "B"});
  std::fill(sky.pixels.begin(), sky.pixels.end(), 1.0F);
  for (int c = 0; c < 3; ++c) sky.at(48, 8)[c] = 101.0F;
  const double solid_angle = 2 * kPi / 64 * (std::cos(8 * kPi / 32) - std::cos(9 * kPi / 32));
  const double expected = 1.0 + 100.0 * solid_angle * std::cos(8.5 * kPi / 32) / kPi;
  const auto traced = [&](IndirectLight mode, int diffuse_depth) {
    TraceOptions options;
    options.samples_per_pixel = 16;
    options.max_diffuse_depth = diffuse_depth;
    const Tracer tracer(scene, indirect(mode));
    const Estimate got = estimate(tracer.trace_beauty(spot(glm::vec3(0.0F)), options));
    // Interpolation spreads the sun over its neighbours, which changes its cosine a little.
    EXPECT_NEAR(got.mean, expected, 4.0 * got.error + 0.002 * expected);
    return got;
  };
  const Estimate alone = traced(IndirectLight::none, 0);
  const Estimate without_depth = traced(IndirectLight::path, 0);
  EXPECT_EQ(without_depth.error, alone.error);
  const Estimate followed = traced(IndirectLight::path, 1);
  EXPECT_GT(followed.error, 0.0);
  EXPECT_LT(followed.error, 0.5 * alone.error);  // it would be 0.8 if both looked for all of the sky
}

TEST(Light, CaptureSeesTheSkyWithItsConventionAndSkipsWhatIsHidden) {
  Scene scene;
  const int ball = add_object(scene, make_sphere(glm::vec3(0.0F), 0.5F), mirror(glm::vec3(1.0F)));
  const int floor = add_object(scene, floor_at(-1.0F, 100.0F), matte(glm::vec3(0.5F)));
  EnvironmentLight sky;
  sky.panorama = Image(64, 32, {"R", "G", "B"});
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) {
      // Smooth functions of the direction: 1 + x and 1 + z.
      const double longitude = 2 * kPi * ((x + 0.5) / 64 - 0.5);
      const double latitude = kPi * (0.5 - (y + 0.5) / 32);
      sky.panorama.at(x, y)[0] = static_cast<float>(1 + std::cos(latitude) * std::sin(longitude));
      sky.panorama.at(x, y)[1] = static_cast<float>(1 - std::cos(latitude) * std::cos(longitude));
    }
  }
  scene.environment = sky;
  const Tracer tracer(scene, indirect(IndirectLight::none));
  const std::array<int, 2> hidden{ball, floor};
  const int size = 16;
  const Image cube = tracer.capture_cube(glm::vec3(0.0F), size, hidden, {});
  ASSERT_EQ(cube.height, 6 * size);
  for (int row = 0; row < 6 * size; ++row) {
    for (int x = 0; x < size; ++x) {
      const glm::vec3 d = glm::normalize(direction_from_cube(
          row / size, (static_cast<float>(x) + 0.5F) / size, (static_cast<float>(row % size) + 0.5F) / size));
      EXPECT_NEAR(cube.at(x, row)[0], 1.0F + d.x, 0.02F);
      EXPECT_NEAR(cube.at(x, row)[1], 1.0F + d.z, 0.02F);
    }
  }
  // With the floor, the lower half is lit from above, but for the quarter of the irradiance that the ball
  // takes away right below it. Of 1024 samples the standard error is 1 %.
  TraceOptions many;
  many.samples_per_pixel = 1024;
  const Image with_floor = tracer.capture_cube(glm::vec3(0.0F), size, {&ball, 1}, many);
  EXPECT_NEAR(with_floor.at(8, 3 * size + 8)[0], 0.5F * 0.75F, 0.015F);
  EXPECT_NEAR(with_floor.at(8, 2 * size + 8)[0], cube.at(8, 2 * size + 8)[0], 0.02F);
}

TEST(Light, SameBitsOnAnyNumberOfThreads) {
  Scene scene = test::small_room();
  add_object(scene, make_sphere({0, 1, 0}, 0.7F), mirror(glm::vec3(0.9F), glm::vec3(0.1F)));
  Camera camera;
  camera.eye = {0, 2, 1.9F};
  camera.target = {0, 1, 0};
  camera.vertical_fov_degrees = 70.0F;
  camera.width = camera.height = 32;
  for (IndirectLight mode : {IndirectLight::cached, IndirectLight::path}) {
    TracerOptions options = indirect(mode);
    options.cache_rays = 64;
    const Image many = Tracer(scene, options).trace_beauty(camera, {});
    const ThreadLimit one(1);
    EXPECT_EQ(Tracer(scene, options).trace_beauty(camera, {}).pixels, many.pixels);
    TraceOptions other_seed;
    other_seed.seed = 1;
    EXPECT_NE(Tracer(scene, options).trace_beauty(camera, other_seed).pixels, many.pixels);
  }
}

}  // namespace
}  // namespace mirrorbake
