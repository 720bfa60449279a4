#include "mirrorbake/inference/layer_images.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "mirror_sphere.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/surface/lookup.hpp"
#include "mirrorbake/surface/lookup_image.hpp"

namespace mirrorbake {
namespace {

constexpr int kSize = 64;
const TexelTopology kMap = TexelTopology::cube(8);
const Proxy kBox{Box{{0.1F, 0.0F, 0.2F}, {4.0F, 3.0F, 5.0F}}, {0.0F, 0.2F, 0.0F}};

RunTimeModel two_lookups() {
  RunTimeModel model = web_run_time();
  model.name = "Two";
  model.places.resize(2);
  return model;
}

// A mirror ball that reflects a map on a box without an error, as an image of layers with lookups.
LayerImage layers_of(const std::vector<float>& texels) {
  SurfaceSamples samples = testing::mirror_sphere_samples(kSize, 2);
  std::fill(samples.fresnel.begin(), samples.fresnel.end(), glm::vec3(0.8F));
  Image lookups = lookup_image(samples, 2);
  Image image(
      kSize, kSize,
      {"coverage", "part", "fresnel.R", "fresnel.G", "fresnel.B", "specular_near.R", "specular_near.G",
       "specular_near.B", "specular_near.A", "specular_far.R", "specular_far.G", "specular_far.B"});
  std::vector<int> count(static_cast<std::size_t>(kSize) * kSize);
  for (const std::uint32_t pixel : samples.pixel) ++count[pixel];
  for (std::size_t i = 0; i < samples.size(); ++i) {
    float* pixel = image.pixels.data() + samples.pixel[i] * image.channels.size();
    const float share = 1.0F / static_cast<float>(count[samples.pixel[i]]);
    pixel[0] += 0.5F;
    pixel[1] = samples.part[i];
    for (std::size_t k = 0; k < 3; ++k) pixel[2 + k] = 0.8F;
    for (const TexelWeight& read : lookup(samples, i, kBox, kMap, two_lookups())) {
      for (std::size_t k = 0; k < 3; ++k) pixel[9 + k] += share * read.weight * texels[3 * read.texel + k];
    }
  }
  return {"ball.exr", merge({{"", &image}, {"", &lookups}})};
}

LayerInferenceOptions precise() {
  LayerInferenceOptions options;
  options.shells = {{"near", {}}, {"far", kBox}};
  options.map = kMap;
  options.run_time = two_lookups();
  options.fit.solve = {.smoothness = 1e-7F,
                       .level_agreement = 1e-7F,
                       .prior_weight = 0.0F,
                       .tolerance = 1e-5F,
                       .max_iterations = 3000};
  return options;
}

// How much all lookups together read of each texel.
std::vector<double> column_sums() {
  const SurfaceSamples samples = testing::mirror_sphere_samples(kSize, 2);
  std::vector<double> sums(kMap.texels());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (const TexelWeight& read : lookup(samples, i, kBox, kMap, two_lookups())) {
      sums[read.texel] += static_cast<double>(read.weight);
    }
  }
  return sums;
}

TEST(LayerImages, RandomMapsRenderedThroughTheMatrixComeBack) {
  const std::vector<float> truth = testing::random_values(3 * kMap.texels(), 7);
  const LayerImage layers = layers_of(truth);
  const LayerInference found = infer_from_layers({&layers, 1}, precise());
  ASSERT_EQ(found.maps.size(), 2U);
  EXPECT_EQ(found.maps[0].name, "near");
  EXPECT_TRUE(found.maps[0].has_alpha);
  EXPECT_EQ(found.maps[1].name, "far");
  ASSERT_EQ(found.maps[1].texels.size(), truth.size());
  EXPECT_TRUE(found.report.converged);
  EXPECT_EQ(found.rejected, 0U);
  const std::vector<double> sums = column_sums();
  std::size_t covered = 0;
  for (std::size_t t = 0; t < kMap.level_offset(1); ++t) {
    // Less than a pixel's worth, and the rest of the pixel decides.
    if (sums[t] < 2.0) continue;
    ++covered;
    // White noise, at which the smoothness of 1e-7 still pulls a little; float32 adds 1e-4.
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_NEAR(found.maps[1].texels[3 * t + k], truth[3 * t + k], 5e-3F) << t;
    }
  }
  EXPECT_GT(covered, 6U * 8U * 8U * 3U / 4U);
}

TEST(LayerImages, ReflectorsAreChosenByName) {
  const std::vector<float> truth = testing::random_values(3 * kMap.texels(), 7);
  LayerImage alone = layers_of(truth);
  Image other = alone.image;
  std::fill(other.pixels.begin(), other.pixels.end(), 0.0F);
  LayerImage both{"both.exr", merge({{"ball.", &alone.image}, {"cup.", &other}})};
  LayerInferenceOptions options = precise();
  EXPECT_THROW(infer_from_layers({&both, 1}, options), FileError);
  options.reflector = "ball";
  EXPECT_EQ(infer_from_layers({&both, 1}, options).maps[1].texels,
            infer_from_layers({&alone, 1}, precise()).maps[1].texels);
  options.reflector = "spoon";
  EXPECT_THROW(infer_from_layers({&both, 1}, options), InvalidArgument);
}

TEST(LayerImages, EveryPartMayHaveMapsOfItsOwn) {
  const LayerImage layers = layers_of(testing::random_values(3 * kMap.texels(), 8));
  LayerInferenceOptions options = precise();
  options.sharing = MapSharing::per_part;
  const LayerInference found = infer_from_layers({&layers, 1}, options);
  ASSERT_EQ(found.maps.size(), 4U);
  EXPECT_EQ(found.maps[2].name, "near.part1");
  EXPECT_EQ(found.maps[3].name, "far.part1");
  EXPECT_NE(found.maps[1].texels, found.maps[3].texels);
}

TEST(LayerImages, PixelsThatAreNotFiniteAreCountedAndLeftOut) {
  LayerImage layers = layers_of(testing::random_values(3 * kMap.texels(), 9));
  const std::size_t middle = static_cast<std::size_t>(kSize) * (kSize / 2) + kSize / 2;
  layers.image.pixels[middle * layers.image.channels.size() + 9] = std::numeric_limits<float>::quiet_NaN();
  const LayerInference found = infer_from_layers({&layers, 1}, precise());
  EXPECT_EQ(found.rejected, 1U);
  for (const InferredMap& map : found.maps) {
    for (const float value : map.texels) ASSERT_TRUE(std::isfinite(value));
  }
}

TEST(LayerImages, RefusesWhatMakesNoSense) {
  const LayerImage layers = layers_of(std::vector<float>(3 * kMap.texels(), 1.0F));
  const auto change = [&](const std::string& channel, float value) {
    LayerImage changed = layers;
    const auto found = std::find(changed.image.channels.begin(), changed.image.channels.end(), channel);
    const auto c = static_cast<std::size_t>(found - changed.image.channels.begin());
    for (std::size_t i = c; i < changed.image.pixels.size(); i += changed.image.channels.size()) {
      changed.image.pixels[i] = value;
    }
    return changed;
  };
  for (const auto& [channel, value] :
       {std::pair{"coverage", 1.5F}, std::pair{"part", 0.5F}, std::pair{"lookup.1.part", 7e4F},
        std::pair{"lookup.0.reflection.X", 9.0F},
        std::pair{"lookup.1.position_dx.Y", std::numeric_limits<float>::infinity()}}) {
    const LayerImage changed = change(channel, value);
    EXPECT_THROW(infer_from_layers({&changed, 1}, precise()), FileError) << channel;
  }
  for (const char* channel : {"coverage", "fresnel.R", "specular_near.A", "lookup.1.fresnel.B"}) {
    LayerImage changed = layers;
    std::replace(changed.image.channels.begin(), changed.image.channels.end(), std::string(channel),
                 std::string("x"));
    EXPECT_THROW(infer_from_layers({&changed, 1}, precise()), FileError) << channel;
  }
  LayerInferenceOptions options = precise();
  options.run_time = web_run_time();
  EXPECT_THROW(infer_from_layers({&layers, 1}, options), FileError);
  options = precise();
  options.shells[0].name = "middle";
  EXPECT_THROW(infer_from_layers({&layers, 1}, options), InvalidArgument);
  options.shells = {{"far", kBox}, {"near", {}}};
  EXPECT_THROW(infer_from_layers({&layers, 1}, options), InvalidArgument);
  EXPECT_THROW(infer_from_layers({}, precise()), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
