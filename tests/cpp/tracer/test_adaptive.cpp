#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "scenes.hpp"

namespace mirrorbake {
namespace {

using test::add_object;
using test::mirror;
using test::small_room;

// A ring that reflects itself: noisy in some places, smooth in most.
struct RingInRoom {
  int ring = 0;
  Tracer tracer;
  Camera camera;

  RingInRoom() : tracer(scene(), {.indirect = IndirectLight::none}) {
    camera.eye = {0.4F, 2.9F, 1.6F};
    camera.target = {0, 1, 0};
    camera.vertical_fov_degrees = 40.0F;
    camera.width = camera.height = 40;
    ring = static_cast<int>(tracer.scene().objects.size()) - 1;
  }
  static Scene scene() {
    Scene s = small_room();
    add_object(s, make_torus({0, 1, 0}, 0.5F, 0.3F, 32), mirror(glm::vec3(0.9F)));
    return s;
  }
};

TraceOptions adaptive(float noise, std::uint64_t seed = 0) {
  TraceOptions options;
  options.samples_per_pixel = 8;
  options.noise = noise;
  options.most_samples_per_pixel = 256;
  options.seed = seed;
  return options;
}

// Root mean square difference of the beauty of two traces over the pixels that both cover.
double difference(const LayerTrace& a, const LayerTrace& b) {
  const auto& names = a.layers.channels;
  const auto coverage =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), "coverage") - names.begin());
  double sum = 0.0;
  int count = 0;
  for (int y = 0; y < a.layers.height; ++y) {
    for (int x = 0; x < a.layers.width; ++x) {
      const float* p = a.layers.at(x, y);
      const float* q = b.layers.at(x, y);
      if (p[coverage] < 1.0F || q[coverage] < 1.0F) continue;
      sum += std::pow(static_cast<double>(p[1]) - static_cast<double>(q[1]), 2);
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

TEST(Adaptive, SamplesGoWhereTheNoiseIs) {
  const RingInRoom room;
  const LayerTrace trace = room.tracer.trace_layers(room.camera, room.ring, adaptive(0.01F));
  const SurfaceSamples& s = trace.samples;
  ASSERT_EQ(s.pixel_samples.size(), 1600u);
  ASSERT_EQ(trace.display_variance.size(), 1600u);
  EXPECT_EQ(*std::min_element(s.pixel_samples.begin(), s.pixel_samples.end()), 8u);
  EXPECT_GE(*std::max_element(s.pixel_samples.begin(), s.pixel_samples.end()), 64u);
  EXPECT_TRUE(std::is_sorted(s.pixel.begin(), s.pixel.end()));
  // Twice the mean number of samples, uniformly, is farther from itself.
  double mean = 0.0;
  for (const std::uint32_t n : s.pixel_samples) mean += n / 1600.0;
  TraceOptions uniform;
  uniform.samples_per_pixel = static_cast<int>(2.0 * mean);
  const LayerTrace flat = room.tracer.trace_layers(room.camera, room.ring, uniform);
  uniform.seed = 1;
  const LayerTrace other_flat = room.tracer.trace_layers(room.camera, room.ring, uniform);
  const LayerTrace other = room.tracer.trace_layers(room.camera, room.ring, adaptive(0.01F, 1));
  EXPECT_LT(difference(trace, other), difference(flat, other_flat));
}

// Counts that depended on a pixel's own samples would end early where these happen to agree. The mean over
// many traces against one of many samples: 48 × 8 and more samples each.
TEST(Adaptive, MeansAreUnbiased) {
  const RingInRoom room;
  const auto mean_of = [](const LayerTrace& trace) {
    double sum = 0.0;
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 40; ++x) sum += static_cast<double>(trace.layers.at(x, y)[1]);
    }
    return sum / 1600.0;
  };
  constexpr int kTraces = 48;
  double sum = 0.0;
  double squares = 0.0;
  for (std::uint64_t seed = 0; seed < kTraces; ++seed) {
    const double mean = mean_of(room.tracer.trace_layers(room.camera, room.ring, adaptive(0.03F, seed + 10)));
    sum += mean;
    squares += mean * mean;
  }
  const double mean = sum / kTraces;
  const double error = std::sqrt((squares / kTraces - mean * mean) / (kTraces - 1));
  TraceOptions many;
  many.samples_per_pixel = 512;
  const double expected = mean_of(room.tracer.trace_layers(room.camera, room.ring, many));
  EXPECT_NEAR(mean, expected, 4.0 * error + 1e-4 * expected);
}

TEST(Adaptive, SameBitsOnAnyNumberOfThreadsAndInAWindow) {
  const RingInRoom room;
  TraceOptions options = adaptive(0.02F);
  const LayerTrace whole = room.tracer.trace_layers(room.camera, room.ring, options);
  {
    const ThreadLimit one(1);
    const LayerTrace single = room.tracer.trace_layers(room.camera, room.ring, options);
    EXPECT_EQ(whole.samples.pixel_samples, single.samples.pixel_samples);
    EXPECT_EQ(whole.layers.pixels, single.layers.pixels);
    EXPECT_EQ(whole.sample_beauty, single.sample_beauty);
  }
  options.window = {11, 7, 13, 20};
  const LayerTrace part = room.tracer.trace_layers(room.camera, room.ring, options);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 13; ++x) {
      const auto inside = static_cast<std::size_t>(13 * y + x);
      const auto outside = static_cast<std::size_t>(40 * (y + 7) + x + 11);
      EXPECT_EQ(part.samples.pixel_samples[inside], whole.samples.pixel_samples[outside]);
      EXPECT_EQ(part.display_variance[inside], whole.display_variance[outside]);
      for (int c = 0; c < part.layers.channel_count(); ++c) {
        EXPECT_EQ(part.layers.at(x, y)[c], whole.layers.at(x + 11, y + 7)[c]);
      }
    }
  }
}

// What is not the reflector's share of the beauty image is background.
TEST(Adaptive, BackgroundAndReflectorAddUpToTheBeauty) {
  const RingInRoom room;
  const LayerTrace trace = room.tracer.trace_layers(room.camera, room.ring, adaptive(0.02F));
  const auto& names = trace.layers.channels;
  const auto background =
      static_cast<std::size_t>(std::find(names.begin(), names.end(), "background.G") - names.begin());
  std::vector<double> sum(1600, 0.0);
  for (std::size_t i = 0; i < trace.samples.size(); ++i) {
    sum[trace.samples.pixel[i]] += static_cast<double>(trace.sample_beauty[i].g);
  }
  for (std::size_t p = 0; p < 1600; ++p) {
    const float* pixel = trace.layers.at(static_cast<int>(p % 40), static_cast<int>(p / 40));
    const double own = sum[p] / trace.samples.samples_in(p);
    EXPECT_NEAR(pixel[1], own + static_cast<double>(pixel[background]), 1e-5);
  }
}

TEST(Adaptive, RefusesWhatItCannotKeep) {
  const RingInRoom room;
  TraceOptions options = adaptive(0.01F);
  options.samples_per_pixel = 6;
  EXPECT_THROW(room.tracer.trace_layers(room.camera, room.ring, options), InvalidArgument);
  options = adaptive(-0.5F);
  EXPECT_THROW(room.tracer.trace_layers(room.camera, room.ring, options), InvalidArgument);
  options = adaptive(0.01F);
  options.most_samples_per_pixel = 0;
  EXPECT_THROW(room.tracer.trace_layers(room.camera, room.ring, options), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
