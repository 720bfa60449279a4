#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "scenes.hpp"

namespace mirrorbake {
namespace {

using test::add_object;
using test::matte;
using test::mirror;

TracerOptions no_indirect() {
  TracerOptions options;
  options.indirect = IndirectLight::none;
  return options;
}

TEST(Rays, HitDistanceObjectAndNormal) {
  Scene scene;
  add_object(scene, make_rectangle({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), matte(glm::vec3(0.5F)));
  add_object(scene, make_rectangle({-1, -1, -3}, {2, 0, 0}, {0, 2, 0}), matte(glm::vec3(0.5F)));
  const Tracer tracer(scene, no_indirect());
  const std::array<glm::vec3, 3> origins{glm::vec3(0.1F, 0.2F, 5), {0.1F, 0.2F, 5}, {0, 0, -10}};
  const std::array<glm::vec3, 3> directions{glm::vec3(0, 0, -7), {0, 0, 1}, {0, 0, 1e-20F}};
  const std::vector<RayHit> hits = tracer.intersect(origins, directions, {});
  EXPECT_EQ(hits[0].object, 0);
  EXPECT_FLOAT_EQ(hits[0].distance, 5.0F);  // metres, whatever the direction's length
  EXPECT_FLOAT_EQ(hits[0].normal.z, 1.0F);
  EXPECT_EQ(hits[1].object, -1);
  EXPECT_TRUE(std::isinf(hits[1].distance));
  EXPECT_EQ(hits[2].object, 1);
  EXPECT_FLOAT_EQ(hits[2].normal.z, 1.0F);  // the triangle's own side, not the ray's
}

TEST(Rays, HiddenObjectsAreSkippedHoweverManyThereAre) {
  // 40 walls in a row are more than Embree's mask has bits.
  Scene scene;
  for (int i = 0; i < 40; ++i) {
    add_object(scene, make_rectangle({-1, -1, -static_cast<float>(i)}, {2, 0, 0}, {0, 2, 0}),
               matte(glm::vec3(0.5F)));
  }
  const Tracer tracer(scene, no_indirect());
  const std::array<glm::vec3, 1> origin{glm::vec3(0.1F, 0.2F, 5)};
  const std::array<glm::vec3, 1> direction{glm::vec3(0, 0, -1)};
  std::vector<int> hidden;
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(tracer.intersect(origin, direction, hidden)[0].object, i);
    hidden.push_back(i);
  }
  EXPECT_EQ(tracer.intersect(origin, direction, hidden)[0].object, -1);
  EXPECT_EQ(tracer.intersect(origin, direction, {})[0].object, 0);
}

TEST(Rays, UnusableRaysAreRejected) {
  Scene scene;
  add_object(scene, make_rectangle({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}), matte(glm::vec3(0.5F)));
  const Tracer tracer(scene, no_indirect());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const auto trace = [&](glm::vec3 origin, glm::vec3 direction) {
    return tracer.intersect({&origin, 1}, {&direction, 1}, {});
  };
  EXPECT_THROW(trace({nan, 0, 0}, {0, 0, 1}), InvalidArgument);
  EXPECT_THROW(trace({0, inf, 0}, {0, 0, 1}), InvalidArgument);
  EXPECT_THROW(trace({0, 2e18F, 0}, {0, 0, 1}), InvalidArgument);
  EXPECT_THROW(trace({0, 0, 0}, {0, 0, 0}), InvalidArgument);
  EXPECT_THROW(trace({0, 0, 0}, {0, nan, 0}), InvalidArgument);
  EXPECT_NO_THROW(trace({0, 9e17F, 0}, {0, 1e-38F, 3e38F}));
  EXPECT_THROW(tracer.intersect(std::array<glm::vec3, 2>{}, std::array<glm::vec3, 1>{}, {}), InvalidArgument);
  const int unknown = 1;
  const glm::vec3 origin(0.0F);
  const glm::vec3 direction(0, 0, 1);
  EXPECT_THROW(tracer.intersect({&origin, 1}, {&direction, 1}, {&unknown, 1}), InvalidArgument);
}

// Closed convex bodies of very different size and place: every ray from inside must hit, and no reflection
// off the outside may meet the body again.
TEST(Rays, NoLeakAndNoSelfIntersectionFromMillimetresToHundredKilometres) {
  struct Place {
    float extent, away;
  };
  // Far away, vertices are rounded to 1e-3 m: the body must be large enough to stay convex.
  for (const auto [extent, away] : {Place{1e-3F, 0}, Place{1, 0}, Place{1e3F, 0}, Place{1e5F, 0},
                                    Place{1, 100}, Place{20, 1e4F}, Place{1e3F, 1e5F}}) {
    const glm::vec3 centre(away, 0.3F * extent, -0.7F * away);
    SCOPED_TRACE("extent " + std::to_string(extent) + ", away " + std::to_string(away));
    Scene scene;
    const int ball =
        add_object(scene, make_sphere(centre, 0.5F * extent, away > 0 ? 16 : 64), mirror(glm::vec3(1.0F)));
    scene.objects[0].mesh.normals.clear();  // flat: a polyhedron, convex whatever the rounding of the normals
    const Tracer tracer(scene, no_indirect());

    constexpr std::uint32_t kRays = 20'000;
    std::vector<glm::vec3> origins(kRays, centre);
    std::vector<glm::vec3> directions;
    for (std::uint32_t i = 0; i < kRays; ++i) {
      const glm::vec2 u = sobol_2d(i, 3);
      const float y = 1.0F - 2.0F * u.x;
      const float r = std::sqrt(1.0F - y * y);
      directions.emplace_back(r * std::cos(6.2831853F * u.y), y, r * std::sin(6.2831853F * u.y));
    }
    int misses = 0;
    for (const RayHit& hit : tracer.intersect(origins, directions, {})) misses += hit.object != ball ? 1 : 0;
    EXPECT_EQ(misses, 0);

    Camera camera;
    camera.target = centre;
    camera.eye = centre + glm::vec3(0.2F, 0.4F, 1.5F) * extent;
    camera.width = camera.height = 64;
    TraceOptions options;
    options.samples_per_pixel = 4;
    const LayerTrace trace = tracer.trace_layers(camera, ball, options);
    ASSERT_GT(trace.samples.size(), 1000u);
    int local = 0;
    for (const glm::vec4& value : trace.samples.shells[0].radiance) local += value.a != 0.0F ? 1 : 0;
    EXPECT_EQ(local, 0);
  }
}

TEST(Rays, MirrorDirectionsOnASphereFollowTheLawOfReflection) {
  Scene scene;
  const glm::vec3 centre(0.2F, -0.1F, 0.0F);
  const int ball = add_object(scene, make_sphere(centre, 1.0F, 256), mirror(glm::vec3(1.0F)));
  const Tracer tracer(scene, no_indirect());
  Camera camera;
  camera.eye = {0, 0, 5};
  camera.width = camera.height = 64;
  const SurfaceSamples samples = tracer.trace_visibility(camera, ball, {});
  ASSERT_GT(samples.size(), 1000u);
  float worst = 0.0F;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const glm::vec3 n = glm::normalize(samples.position[i] - centre);
    const glm::vec3 v = glm::normalize(camera.eye - samples.position[i]);
    EXPECT_NEAR(glm::length(samples.normal[i]), 1.0F, 1e-5F);
    EXPECT_NEAR(glm::length(samples.reflection[i]), 1.0F, 1e-5F);
    EXPECT_LT(
        glm::length(samples.reflection[i] - (2.0F * glm::dot(samples.normal[i], v) * samples.normal[i] - v)),
        1e-4F);
    // Away from the silhouette, where the polyhedron's facets differ from the sphere.
    if (glm::dot(n, v) < 0.2F) continue;
    worst = std::max(worst, glm::length(samples.reflection[i] - (2.0F * glm::dot(n, v) * n - v)));
  }
  // Facets of 2π/256 rad: interpolated normals are off by their square.
  EXPECT_LT(worst, 3e-3F);
}

// The differentials against finite differences of the exact sphere, by intersecting the neighbouring pixel's
// ray.
TEST(Rays, DifferentialsOnASphereMatchFiniteDifferences) {
  Scene scene;
  const int ball = add_object(scene, make_sphere(glm::vec3(0.0F), 1.0F, 512), mirror(glm::vec3(1.0F)));
  const Tracer tracer(scene, no_indirect());
  Camera camera;
  camera.eye = {0, 0, 4};
  camera.width = camera.height = 128;
  camera.vertical_fov_degrees = 35.0F;
  TraceOptions options;
  options.samples_per_pixel = 1;
  const SurfaceSamples samples = tracer.trace_visibility(camera, ball, options);

  const auto reflect_off_sphere = [&](glm::dvec3 d, glm::dvec3& position) {
    const glm::dvec3 e = camera.eye;
    const double b = glm::dot(e, d);
    position = e + (-b - std::sqrt(b * b - glm::dot(e, e) + 1.0)) * d;
    return d - 2.0 * glm::dot(d, position) * position;
  };
  const double pixel = 2.0 * std::tan(35.0 * M_PI / 360.0) / 128.0;
  int compared = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const glm::dvec3 to = glm::dvec3(samples.position[i]) - glm::dvec3(camera.eye);
    const glm::dvec3 on_plane = to / -to.z;  // image plane at distance 1
    if (glm::dot(glm::normalize(to), glm::dvec3(glm::normalize(samples.position[i]))) > -0.4) continue;
    ++compared;
    constexpr double kStep = 1e-4;
    for (int axis = 0; axis < 2; ++axis) {
      const glm::dvec3 step = axis == 0 ? glm::dvec3(pixel * kStep, 0, 0) : glm::dvec3(0, -pixel * kStep, 0);
      glm::dvec3 p0, p1;
      const glm::dvec3 r0 = reflect_off_sphere(glm::normalize(on_plane), p0);
      const glm::dvec3 r1 = reflect_off_sphere(glm::normalize(on_plane + step), p1);
      const glm::dvec3 dp = (p1 - p0) / kStep;
      const glm::dvec3 dr = (r1 - r0) / kStep;
      const glm::vec3 got_p = axis == 0 ? samples.dposition_dx[i] : samples.dposition_dy[i];
      const glm::vec3 got_r = axis == 0 ? samples.dreflection_dx[i] : samples.dreflection_dy[i];
      // A facet's plane is tilted against the tangent plane by up to half its angle, 6e-3 rad, divided by the
      // cosine.
      EXPECT_LT(glm::length(glm::dvec3(got_p) - dp), 0.05 * glm::length(dp));
      EXPECT_LT(glm::length(glm::dvec3(got_r) - dr), 0.05 * glm::length(dr));
    }
  }
  EXPECT_GT(compared, 3000);
}

TEST(Rays, AnEyeInsideTheReflectorIsRejected) {
  Scene scene;
  const int ball = add_object(scene, make_sphere(glm::vec3(0.0F), 1.0F), mirror(glm::vec3(1.0F)));
  const Tracer tracer(scene, no_indirect());
  Camera camera;
  camera.width = camera.height = 8;
  camera.eye = {0.5F, 0.1F, 0.0F};
  EXPECT_THROW(tracer.trace_visibility(camera, ball, {}), InvalidArgument);
  EXPECT_THROW(tracer.trace_layers(camera, ball, {}), InvalidArgument);
  camera.eye = {0.9F, 0.9F, 0.9F};  // inside the bounding box, outside the ball
  EXPECT_NO_THROW(tracer.trace_visibility(camera, ball, {}));
}

TEST(Rays, ArgumentsOutOfRangeAreRejected) {
  Scene scene;
  add_object(scene, make_sphere(glm::vec3(0.0F), 1.0F), mirror(glm::vec3(1.0F)));
  add_object(scene, make_sphere(glm::vec3(3.0F), 1.0F), matte(glm::vec3(0.5F)));
  TracerOptions options = no_indirect();
  const Tracer tracer(scene, options);
  Camera camera;
  camera.eye = {0, 0, 5};
  camera.width = camera.height = 4;
  EXPECT_THROW(tracer.trace_layers(camera, 2, {}), InvalidArgument);
  EXPECT_THROW(tracer.trace_layers(camera, -1, {}), InvalidArgument);
  EXPECT_THROW(tracer.trace_layers(camera, 1, {}), InvalidArgument);  // not specular
  TraceOptions trace;
  trace.samples_per_pixel = 0;
  EXPECT_THROW(tracer.trace_beauty(camera, trace), InvalidArgument);
  trace = {};
  trace.max_specular_depth = 65;
  EXPECT_THROW(tracer.trace_beauty(camera, trace), InvalidArgument);
  trace = {};
  trace.max_diffuse_depth = -1;
  EXPECT_THROW(tracer.trace_beauty(camera, trace), InvalidArgument);
  EXPECT_THROW(tracer.capture_cube(glm::vec3(0.0F), 0, {}, {}), InvalidArgument);
  EXPECT_THROW(tracer.capture_cube(glm::vec3(NAN), 4, {}, {}), InvalidArgument);
  EXPECT_THROW(tracer.vertex_irradiance(2, 4, 0), InvalidArgument);
  EXPECT_THROW(tracer.vertex_irradiance(0, 0, 0), InvalidArgument);
  options.cache_rays = 0;
  EXPECT_THROW(Tracer(scene, options), InvalidArgument);
  options.cache_rays = 1;
  options.cache_bounces = 17;
  EXPECT_THROW(Tracer(scene, options), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
