#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <glm/mat3x3.hpp>
#include <glm/trigonometric.hpp>

#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake {
namespace {

// Two by two texels, red = 0, 1 in the top row and 2, 3 (eighths) in the bottom one.
Texture quarters(TextureWrap wrap) {
  Image image(2, 2, {"R", "G", "B"});
  for (std::size_t i = 0; i < 4; ++i) image.pixels[3 * i] = 0.125F * static_cast<float>(i);
  return {image, wrap, wrap};
}

float red(const Texture& texture, float u, float v) { return 8.0F * texture_lookup(texture, {u, v}).x; }

TEST(Texture, TexelCentresAreExactAndVPointsUp) {
  for (const TextureWrap wrap : {TextureWrap::repeat, TextureWrap::clamp, TextureWrap::mirror}) {
    const Texture texture = quarters(wrap);
    EXPECT_EQ(red(texture, 0.25F, 0.75F), 0.0F);
    EXPECT_EQ(red(texture, 0.75F, 0.75F), 1.0F);
    EXPECT_EQ(red(texture, 0.25F, 0.25F), 2.0F);
    EXPECT_EQ(red(texture, 0.75F, 0.25F), 3.0F);
    EXPECT_EQ(red(texture, 0.5F, 0.5F), 1.5F);
  }
}

TEST(Texture, CoordinatesOutsideRepeatClampOrMirror) {
  const Texture repeat = quarters(TextureWrap::repeat);
  EXPECT_EQ(red(repeat, 1.25F, 0.75F), 0.0F);
  EXPECT_EQ(red(repeat, -1.25F, -2.75F), 3.0F);
  EXPECT_EQ(red(repeat, 0.0F, 0.75F), 0.5F);  // between the last and the first column
  const Texture clamp = quarters(TextureWrap::clamp);
  EXPECT_EQ(red(clamp, 1.25F, 0.75F), 1.0F);
  EXPECT_EQ(red(clamp, -5.0F, -7.0F), 2.0F);
  EXPECT_EQ(red(clamp, 0.0F, 1.0F), 0.0F);
  const Texture mirror = quarters(TextureWrap::mirror);
  EXPECT_EQ(red(mirror, 1.25F, 0.75F), 1.0F);
  EXPECT_EQ(red(mirror, 1.75F, 0.75F), 0.0F);
  EXPECT_EQ(red(mirror, -0.25F, -0.75F), 0.0F);
  EXPECT_EQ(red(mirror, 2.75F, 0.25F), 3.0F);
  EXPECT_EQ(red(mirror, 1.0F, 0.75F), 1.0F);
}

TEST(Texture, AnyCoordinateFindsATexel) {
  for (const TextureWrap wrap : {TextureWrap::repeat, TextureWrap::clamp, TextureWrap::mirror}) {
    const Texture texture = quarters(wrap);
    for (const float u : {-1e30F, -1e-30F, -1e-8F, 0x1p-149F, 1.0F, 0x1.fffffep-1F, 16777217.0F, 1e30F,
                          std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
      const float value = red(texture, u, u);
      EXPECT_GE(value, 0.0F) << u;
      EXPECT_LE(value, 3.0F) << u;
    }
  }
}

TEST(Texture, OneChannelStandsForAllThree) {
  Texture texture;
  texture.image = Image(1, 1, {"Y"});
  texture.image.pixels = {0.25F};
  EXPECT_EQ(texture_lookup(texture, {0.3F, 0.4F}), glm::vec3(0.25F));
}

// The matrices as the extension's text has them, in double precision.
glm::dvec2 khr_texture_transform(const TextureReference& reference, glm::dvec2 uv) {
  const double c = std::cos(double{reference.rotation});
  const double s = std::sin(double{reference.rotation});
  const glm::dmat3 translation(1, 0, 0, 0, 1, 0, reference.offset.x, reference.offset.y, 1);
  const glm::dmat3 rotation(c, -s, 0, s, c, 0, 0, 0, 1);
  const glm::dmat3 scale(reference.scale.x, 0, 0, 0, reference.scale.y, 0, 0, 0, 1);
  return glm::dvec2(translation * rotation * scale * glm::dvec3(uv, 1.0));
}

TEST(Texture, CoordinatesAreTransformedAsTheExtensionHasIt) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> any(-4.0F, 4.0F);
  for (int i = 0; i < 1000; ++i) {
    TextureReference reference{0, {any(random), any(random)}, {any(random), any(random)}, any(random)};
    if (i % 4 == 0) reference.rotation = 0.0F;
    if (i % 8 == 0) reference.scale = glm::vec2(1.0F);
    const glm::vec2 uv(any(random), any(random));
    const glm::vec2 found = texture_coordinates(reference, uv);
    const glm::dvec2 expected = khr_texture_transform(reference, {uv.x, 1.0 - double{uv.y}});
    // A few roundings of numbers up to 4 · 4 + 4 · 5.
    EXPECT_NEAR(found.x, expected.x, 2e-5);
    EXPECT_NEAR(found.y, 1.0 - expected.y, 2e-5);
  }
}

TEST(SpotLight, FallsOffAsTheExtensionHasIt) {
  const SpotLight light{{}, {0, -1, 0}, glm::vec3(1.0F), 20.0F, 50.0F};
  // KHR_lights_punctual, "Inner and Outer Cone Angles", in double precision.
  const double inner = std::cos(20.0 * std::numbers::pi / 180.0);
  const double outer = std::cos(50.0 * std::numbers::pi / 180.0);
  for (int degrees = 0; degrees <= 180; ++degrees) {
    const double cosine = std::cos(degrees * std::numbers::pi / 180.0);
    const double scale = 1.0 / std::max(0.001, inner - outer);
    const double attenuation = std::clamp(cosine * scale - outer * scale, 0.0, 1.0);
    EXPECT_NEAR(spot_falloff(light, static_cast<float>(cosine)), attenuation * attenuation, 1e-6) << degrees;
  }
  EXPECT_EQ(spot_falloff(light, 1.0F), 1.0F);
  EXPECT_EQ(spot_falloff(light, -1.0F), 0.0F);
}

}  // namespace
}  // namespace mirrorbake
