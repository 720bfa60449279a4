#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <tuple>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/trigonometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/scene/load.hpp"
#include "mirrorbake/scene/scene.hpp"
#include "temporary_files.hpp"

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

class TextureFiles : public testing::FileTest {
 protected:
  std::string save(const std::string& name, int width, int height, PixelFormat format) const {
    Image image(width, height, {"R", "G", "B"});
    std::mt19937 random(3);
    for (float& v : image.pixels) v = std::uniform_real_distribution<float>(0.0F, 1.0F)(random);
    save_image((directory_ / name).string(), image, format);
    return (directory_ / name).string();
  }
};

TEST_F(TextureFiles, FindTheSameTexelsAsTexturesInMemory) {
  // Halves have 11 bits; the rest is rounding.
  for (const auto& [name, format, tolerance] :
       {std::tuple("a.png", PixelFormat::uint8, 5e-4), std::tuple("b.png", PixelFormat::uint16, 2e-6),
        std::tuple("c.exr", PixelFormat::float32, 2e-6), std::tuple("d.tif", PixelFormat::float32, 2e-6)}) {
    const std::string path = save(name, 150, 70, format);
    const auto file = std::make_shared<TextureFile>(path);
    EXPECT_EQ(file->width(), 150);
    EXPECT_EQ(file->height(), 70);
    for (const TextureWrap wrap : {TextureWrap::repeat, TextureWrap::clamp, TextureWrap::mirror}) {
      const Texture in_memory{load_image(path), wrap, wrap};
      const Texture in_file{{}, wrap, wrap, file};
      std::mt19937 random(4);
      std::uniform_real_distribution<float> any(-2.5F, 2.5F);
      for (int i = 0; i < 500; ++i) {
        const glm::vec2 uv(any(random), any(random));
        const glm::vec3 expected = texture_lookup(in_memory, uv);
        // Coordinates of up to 150 texels are rounded, and texels differ by up to 1.
        EXPECT_LT(glm::distance(texture_lookup(in_file, uv), expected), tolerance + 3e-4) << name << " " << i;
      }
      EXPECT_LT(glm::distance(texture_mean(in_file), texture_mean(in_memory)), 1e-5F);
      const Image copy = texture_image(in_file);
      ASSERT_EQ(copy.pixels.size(), in_memory.image.pixels.size());
      for (std::size_t i = 0; i < copy.pixels.size(); ++i) {
        ASSERT_NEAR(copy.pixels[i], in_memory.image.pixels[i], tolerance + 3e-4) << name << " " << i;
      }
    }
  }
}

TEST_F(TextureFiles, WideFootprintsFindMeans) {
  const std::string path = save("a.exr", 256, 256, PixelFormat::float32);
  const TextureFile file(path);
  const glm::vec3 wide = file.lookup({0.3F, 0.6F}, 1.0F, TextureWrap::repeat, TextureWrap::repeat);
  EXPECT_LT(glm::distance(wide, file.mean()), 1e-3F);
  // Uniform noise has a variance of 1/12; the mean of 16 × 16 texels has 1/256 of that, a standard deviation
  // of 0.018.
  double square = 0.0;
  for (int i = 0; i < 400; ++i) {
    const glm::vec2 uv(0.05F * static_cast<float>(i % 20), 0.05F * static_cast<float>(i / 20));
    const float red = file.lookup(uv, 1.0F / 16.0F, TextureWrap::repeat, TextureWrap::repeat).x;
    square += static_cast<double>((red - 0.5F) * (red - 0.5F)) / 400.0;
  }
  EXPECT_GT(std::sqrt(square), 0.008);
  EXPECT_LT(std::sqrt(square), 0.025);
}

TEST_F(TextureFiles, LookupsThroughASmallCacheOnManyThreadsGiveTheSameBits) {
  set_texture_cache_bytes(std::uint64_t{16} << 20);
  // 48 MiB of texels, and lookups all over them.
  const Texture texture{{},
                        TextureWrap::repeat,
                        TextureWrap::repeat,
                        std::make_shared<TextureFile>(save("a.exr", 2048, 2048, PixelFormat::float32))};
  std::vector<glm::vec3> found[2];
  for (std::vector<glm::vec3>& values : found) {
    const ThreadLimit limit(&values == &found[0] ? 1 : 4);
    values.resize(64);
    parallel_for(values.size(), 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        // From strip to strip of 64 rows, of which the cache holds about ten.
        const float x = static_cast<float>(i);
        values[i] = texture_lookup(texture, {0.754877666F * x, 0.569840296F * std::floor(x / 4.0F)});
      }
    });
  }
  EXPECT_EQ(found[0], found[1]);
  set_texture_cache_bytes(std::uint64_t{1} << 30);
  EXPECT_THROW(set_texture_cache_bytes(1), InvalidArgument);
}

TEST_F(TextureFiles, DamagedFilesAreNamedWhenTheyAreOpened) {
  const std::string path = save("a.png", 64, 64, PixelFormat::uint8);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  EXPECT_THROW(TextureFile{path}, FileError);
  EXPECT_THROW(TextureFile{(directory_ / "missing.png").string()}, FileError);
  EXPECT_THROW(TextureFile{write("text.png", "no image")}, FileError);
  Image bright(1, 1, {"R", "G", "B"});
  bright.pixels = {0.5F, 2.0F, 0.0F};
  const std::string bright_path = (directory_ / "bright.exr").string();
  save_image(bright_path, bright);
  EXPECT_THROW(TextureFile{bright_path}, FileError);
  Image layers(1, 1, {"X", "Y"});
  save_image((directory_ / "layers.exr").string(), layers);
  EXPECT_THROW(TextureFile{(directory_ / "layers.exr").string()}, FileError);
}

TEST_F(TextureFiles, LargeImagesOfSceneFilesGoThroughTheCache) {
  save("map.png", 32, 32, PixelFormat::uint8);
  write("a.mtl", "newmtl m\nmap_Kd map.png\n");
  const std::string path = write("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
  SceneOptions options;
  options.cache_textures_above = 32 * 32 * 3 * sizeof(float);
  const Scene in_memory = load_scene(path, options).scene;
  EXPECT_EQ(in_memory.textures.at(0).file, nullptr);
  options.cache_textures_above -= 1;
  const Scene cached = load_scene(path, options).scene;
  ASSERT_NE(cached.textures.at(0).file, nullptr);
  const glm::vec2 uv(0.3F, 0.7F);
  EXPECT_LT(glm::distance(texture_lookup(cached.textures[0], uv), texture_lookup(in_memory.textures[0], uv)),
            1e-3F);
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
