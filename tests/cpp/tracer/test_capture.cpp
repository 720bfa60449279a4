#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/shapes.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "scenes.hpp"

namespace mirrorbake {
namespace {

constexpr const char* kProjections[] = {"cube",    "dual_paraboloid", "sphere_map",
                                        "latlong", "angular",         "fisheye:180"};

TracerOptions no_indirect_light() {
  TracerOptions options;
  options.indirect = IndirectLight::none;
  return options;
}

// A sky of 1 + x, 1 + y and 1 + z.
Scene under_a_smooth_sky() {
  Scene scene;
  EnvironmentLight sky;
  sky.panorama = Image(128, 64, {"R", "G", "B"});
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 128; ++x) {
      const glm::dvec3 d =
          direction_from_point(parse_projection("latlong"), 0, column_center(x, 128), row_center(y, 64));
      for (int c = 0; c < 3; ++c) sky.panorama.at(x, y)[c] = static_cast<float>(1.0 + d[c]);
    }
  }
  scene.environment = sky;
  return scene;
}

// The sky is interpolated from texels of 3°, 3e-4 off; a texel's mean differs from its centre by its
// curvature, less than 2e-3 but for the stretched ones along the sphere map's rim. Beyond the rim the
// projections go on.
TEST(Capture, OfASkyIsTheSkyInEveryProjection) {
  const Tracer tracer(under_a_smooth_sky(), no_indirect_light());
  constexpr int kSize = 48;
  for (const char* name : kProjections) {
    const Projection projection = parse_projection(name);
    const int width = kSize * natural_aspect(projection);
    TraceOptions options;
    options.samples_per_pixel = 64;
    const Image image = tracer.capture(glm::vec3(0.3F, 4.0F, -2.0F), projection, width, kSize, {}, options);
    ASSERT_EQ(image.width, width);
    ASSERT_EQ(image.height, kSize * face_count(projection));
    int compared = 0;
    for (int line = 0; line < image.height; ++line) {
      for (int column = 0; column < width; ++column) {
        const double x = column_center(column, width);
        const double y = row_center(line % kSize, kSize);
        if (projection.kind == ProjectionKind::sphere_map && x * x + y * y > 0.9) continue;
        const glm::dvec3 d = direction_from_point(projection, line / kSize, x, y);
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(static_cast<double>(image.at(column, line)[c]), 1.0 + d[c], 0.01)
              << name << " at " << x << ", " << y;
        }
        ++compared;
      }
    }
    EXPECT_GT(compared, kSize * kSize / 2);
  }
}

// What share of a texel a lamp covers, found by the projection's own directions, 24² to a texel. 256
// stratified samples are off by less than 0.1 at the edge of the lamp.
TEST(Capture, RaysGoStraightThroughTheParaboloids) {
  Scene scene;
  RectangleLight lamp;
  lamp.corner = {-0.6F, 0.8F, -0.7F};  // across the rim z = 0
  lamp.edge_u = {1.3F, 0.1F, 0.0F};
  lamp.edge_v = {0.0F, 0.3F, 1.2F};
  lamp.radiance = glm::vec3(1.0F);
  scene.rectangle_lights.push_back(lamp);
  const Tracer tracer(scene, no_indirect_light());
  const Projection projection = parse_projection("dual_paraboloid");
  constexpr int kSize = 24;
  constexpr int kPlaces = 24;
  TraceOptions options;
  options.samples_per_pixel = 256;
  const Image image = tracer.capture(glm::vec3(0.0F), projection, kSize, kSize, {}, options);
  const std::vector<glm::vec3> origins(kPlaces * kPlaces, glm::vec3(0.0F));
  double total = 0.0;
  double difference = 0.0;
  for (int line = 0; line < 2 * kSize; ++line) {
    for (int column = 0; column < kSize; ++column) {
      std::vector<glm::vec3> directions;
      for (int i = 0; i < kPlaces * kPlaces; ++i) {
        const double x = column_center(column * kPlaces + i % kPlaces, kSize * kPlaces);
        const double y = row_center((line % kSize) * kPlaces + i / kPlaces, kSize * kPlaces);
        directions.emplace_back(direction_from_point(projection, line / kSize, x, y));
      }
      const std::vector<RayHit> hits = tracer.intersect(origins, directions, {});
      const auto seen = std::count_if(hits.begin(), hits.end(),
                                      [](const RayHit& hit) { return std::isfinite(hit.distance); });
      const double share = static_cast<double>(seen) / (kPlaces * kPlaces);
      const double got = static_cast<double>(image.at(column, line)[0]);
      // The lamp shines to one side: seen from the other it is black.
      ASSERT_NEAR(got, share, 0.1) << column << ", " << line;
      total += share;
      difference += got - share;
    }
  }
  EXPECT_GT(total, 40.0);
  EXPECT_NEAR(difference / total, 0.0, 2e-3);
}

TEST(Capture, HiddenObjectsAreAbsentInEveryProjection) {
  Scene scene = under_a_smooth_sky();
  const Tracer empty(scene, no_indirect_light());
  const int right = test::add_object(scene, make_sphere(glm::vec3(2.0F, 0.0F, -1.0F), 0.5F), Material{});
  const int left = test::add_object(scene, make_sphere(glm::vec3(-3.0F, 0.0F, -1.0F), 1.0F), Material{});
  const Tracer tracer(scene, no_indirect_light());
  TraceOptions options;
  options.samples_per_pixel = 4;
  for (const char* name : kProjections) {
    const Projection projection = parse_projection(name);
    const auto capture = [&](const Tracer& from, std::vector<int> hidden) {
      return from.capture(glm::vec3(0.1F, 0.0F, 0.0F), projection, 12, 12, hidden, options).pixels;
    };
    const std::vector<float> sky = capture(empty, {});
    EXPECT_EQ(capture(tracer, {right, left}), sky) << name;
    EXPECT_NE(capture(tracer, {right}), sky) << name;
    EXPECT_NE(capture(tracer, {}), capture(tracer, {right})) << name;
  }
}

TEST(Capture, OfACubeIsCaptureCube) {
  const Tracer tracer(under_a_smooth_sky(), no_indirect_light());
  TraceOptions options;
  options.samples_per_pixel = 2;
  EXPECT_EQ(tracer.capture(glm::vec3(0.0F), parse_projection("cube"), 9, 9, {}, options).pixels,
            tracer.capture_cube(glm::vec3(0.0F), 9, {}, options).pixels);
}

TEST(Capture, RejectsSizesPointsAndObjectsThatCannotBe) {
  const Tracer tracer(under_a_smooth_sky(), no_indirect_light());
  const Projection cube = parse_projection("cube");
  const std::array<int, 1> missing{3};
  EXPECT_THROW(tracer.capture(glm::vec3(0.0F), cube, 8, 4, {}, {}), InvalidArgument);
  EXPECT_THROW(tracer.capture(glm::vec3(0.0F), cube, 0, 0, {}, {}), InvalidArgument);
  EXPECT_THROW(tracer.capture(glm::vec3(0.0F), cube, 20000, 20000, {}, {}), InvalidArgument);
  EXPECT_THROW(tracer.capture(glm::vec3(0.0F), cube, 4, 4, missing, {}), InvalidArgument);
  const glm::vec3 nowhere(std::numeric_limits<float>::quiet_NaN());
  EXPECT_THROW(tracer.capture(nowhere, cube, 4, 4, {}, {}), InvalidArgument);
  EXPECT_THROW(tracer.capture(glm::vec3(0.0F), {ProjectionKind::fisheye, 400.0F}, 4, 4, {}, {}),
               InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
