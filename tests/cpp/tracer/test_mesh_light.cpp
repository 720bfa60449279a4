#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "scenes.hpp"

namespace mirrorbake {
namespace {

using test::add_object;
using test::matte;

constexpr double kPi = std::numbers::pi;

// 32² quads of which a texture lights one: were points taken by area alone, one in 250 would find it, and the
// error would be four times as large as what is allowed.
TEST(MeshLight, ASpotOfLightOnATexturedMeshIsAimedAt) {
  constexpr int kSide = 32;
  Scene scene;
  add_object(scene, make_rectangle({-3.0F, 0, 3.0F}, {6.0F, 0, 0}, {0, 0, -6.0F}), matte(glm::vec3(1.0F)));
  Texture texture;
  texture.image = Image(kSide, kSide, {"Y"});
  texture.image.at(20, 9)[0] = 1.0F;
  scene.textures.push_back(texture);
  TriangleMesh mesh;
  for (int y = 0; y <= kSide; ++y) {
    for (int x = 0; x <= kSide; ++x) {
      const glm::vec2 uv = glm::vec2(static_cast<float>(x), static_cast<float>(y)) / float{kSide};
      mesh.positions.push_back({uv.x - 0.5F, 4.0F, uv.y - 0.5F});
      mesh.uvs.push_back(uv);
    }
  }
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const std::uint32_t a = y * (kSide + 1) + x;
      mesh.triangles.push_back({a, a + 1, a + kSide + 1});
      mesh.triangles.push_back({a + 1, a + kSide + 2, a + kSide + 1});
    }
  }
  Material glow = matte(glm::vec3(0.0F));
  glow.emission = glm::vec3(1000.0F);
  glow.emission_texture.texture = 0;
  add_object(scene, std::move(mesh), glow);
  // A texel, interpolated, holds the light of its own area; it is nearly right above.
  const double height = 4.0;
  const double x = 20.5 / kSide - 0.5;
  const double z = 1.0 - 9.5 / kSide - 0.5;
  const double d2 = height * height + x * x + z * z;
  const double expected = 1000.0 / (kSide * kSide) * height * height / (d2 * d2) / kPi;
  for (IndirectLight mode : {IndirectLight::none, IndirectLight::path}) {
    // All pixels see nearly the same point, and are independent estimates of the same value.
    Camera camera;
    camera.eye = {0.4F, 1.0F, 0.3F};
    camera.target = glm::vec3(0.0F);
    camera.vertical_fov_degrees = 0.01F;
    camera.width = camera.height = 64;
    TraceOptions options;
    options.samples_per_pixel = 4;
    TracerOptions how;
    how.indirect = mode;
    const Image image = Tracer(scene, how).trace_beauty(camera, options);
    double sum = 0.0;
    double squares = 0.0;
    const int count = image.width * image.height;
    for (int y = 0; y < image.height; ++y) {
      for (int column = 0; column < image.width; ++column) {
        const double value = image.at(column, y)[0];
        sum += value;
        squares += value * value;
      }
    }
    const double mean = sum / count;
    const double error = std::sqrt((squares / count - mean * mean) / count);
    // 1e-3: the spot of light has a size.
    EXPECT_NEAR(mean, expected, 4.0 * error + 1e-3 * expected);
    EXPECT_LT(error, 0.02 * expected);
  }
}

}  // namespace
}  // namespace mirrorbake
