#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/tracer/camera.hpp"
#include "scenes.hpp"

namespace mirrorbake {
namespace {

TEST(Camera, RejectsWhatCannotMakeAnImage) {
  const Camera good;
  EXPECT_NO_THROW(validate(good));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto rejects = [&](auto change) {
    Camera camera;
    change(camera);
    EXPECT_THROW(validate(camera), InvalidArgument);
  };
  rejects([](Camera& c) { c.width = 0; });
  rejects([](Camera& c) { c.height = 16385; });
  rejects([](Camera& c) { c.vertical_fov_degrees = 0.0F; });
  rejects([](Camera& c) { c.vertical_fov_degrees = 180.0F; });
  rejects([&](Camera& c) { c.vertical_fov_degrees = nan; });
  rejects([](Camera& c) { c.target = c.eye; });
  rejects([](Camera& c) { c.up = {0, 0, 2}; });
  rejects([](Camera& c) { c.up = glm::vec3(0.0F); });
  rejects([&](Camera& c) { c.eye.x = nan; });
  rejects([](Camera& c) { c.target.y = std::numeric_limits<float>::infinity(); });
}

// A wall at distance 1 whose hit positions tell where each sample went.
TEST(Camera, SamplesFallIntoTheirPixel) {
  Scene scene;
  const int wall = test::add_object(scene, make_rectangle({-5, -5, 0}, {10, 0, 0}, {0, 10, 0}),
                                    test::mirror(glm::vec3(1.0F)));
  TracerOptions options;
  options.indirect = IndirectLight::none;
  const Tracer tracer(scene, options);
  Camera camera;
  camera.width = 6;
  camera.height = 4;
  camera.vertical_fov_degrees = 90.0F;  // the image plane at distance 1 is 3 × 2 m
  TraceOptions trace;
  trace.samples_per_pixel = 4;
  const SurfaceSamples samples = tracer.trace_visibility(camera, wall, trace);
  ASSERT_EQ(samples.size(), 6u * 4u * 4u);
  const float pixel = 2.0F / 4.0F;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const float x = (samples.position[i].x + 1.5F) / pixel;
    const float y = (1.0F - samples.position[i].y) / pixel;
    EXPECT_EQ(samples.pixel[i], static_cast<std::uint32_t>(y) * 6u + static_cast<std::uint32_t>(x)) << i;
    EXPECT_EQ(samples.pixel[i], i / 4);
    // A pixel to the right moves the point on this parallel wall by one pixel's width, a pixel down by its
    // height.
    EXPECT_LT(glm::length(samples.dposition_dx[i] - glm::vec3(pixel, 0, 0)), 1e-4F);
    EXPECT_LT(glm::length(samples.dposition_dy[i] - glm::vec3(0, -pixel, 0)), 1e-4F);
  }
}

}  // namespace
}  // namespace mirrorbake
