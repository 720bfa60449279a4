#include "beauty.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>
#include <glm/vec3.hpp>

#include "camera_rays.hpp"
#include "integrator.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/interrupt.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "state.hpp"

namespace mirrorbake {
namespace tracing {

BeautySums::BeautySums(int image_width, PixelWindow window, int tile_size)
    : image_width_(image_width),
      window_(window),
      tile_size_(tile_size),
      tiles_across_((window.width + tile_size - 1) / tile_size),
      tiles_down_((window.height + tile_size - 1) / tile_size),
      sum_(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height), glm::dvec3(0.0)),
      squares_(sum_.size(), 0.0),
      samples_(tile_count(), 0) {}

std::size_t BeautySums::tile_count() const {
  return static_cast<std::size_t>(tiles_across_) * static_cast<std::size_t>(tiles_down_);
}

void BeautySums::trace(const LitWorld& lit, const RayScene::View& view, const TraceOptions& options,
                       std::size_t tile, int samples, const RayThrough& ray_through) {
  const PathLimits limits{options.max_specular_depth, options.max_diffuse_depth};
  const PixelWindow area = tile_area(tile);
  for (int y = area.y; y < area.y + area.height; ++y) {
    const RowSegment segment{image_width_, y, area.x, area.width, samples_[tile], samples - samples_[tile]};
    PrimaryRow row(view, options.seed, segment, [&](glm::vec2 point) { return ray_through(y, point); });
    for (int x = area.x; x < area.x + area.width; ++x) {
      poll_interrupt();
      const std::size_t p = pixel(x, y);
      for (int i = 0; i < segment.samples; ++i) {
        const PrimarySample& s = row.next();
        const glm::vec3 value = radiance(lit, s.ray, s.hit, limits, s.stream, 0, 0.0F);
        sum_[p] += glm::dvec3(value);
        squares_[p] += static_cast<double>(luminance(value)) * static_cast<double>(luminance(value));
      }
    }
  }
  samples_[tile] = samples;
}

BeautySums::TileError BeautySums::error(std::size_t tile) const {
  const PixelWindow area = tile_area(tile);
  const double n = samples_[tile];
  TileError result;
  for (int y = area.y; y < area.y + area.height; ++y) {
    for (int x = area.x; x < area.x + area.width; ++x) {
      const glm::dvec3 mean = sum_[pixel(x, y)] / n;
      const double value = 0.2126 * mean.x + 0.7152 * mean.y + 0.0722 * mean.z;
      result.luminance += value;
      result.squared_error += std::max(0.0, squares_[pixel(x, y)] / n - value * value) / (n - 1.0);
      ++result.pixels;
    }
  }
  return result;
}

Image BeautySums::image() const {
  Image result(window_.width, window_.height, {"R", "G", "B"});
  for (std::size_t tile = 0; tile < tile_count(); ++tile) {
    const PixelWindow area = tile_area(tile);
    for (int y = area.y; y < area.y + area.height; ++y) {
      for (int x = area.x; x < area.x + area.width; ++x) {
        const glm::vec3 mean(sum_[pixel(x, y)] / static_cast<double>(samples_[tile]));
        std::copy_n(&mean.x, 3, result.at(x - window_.x, y - window_.y));
      }
    }
  }
  return result;
}

PixelWindow BeautySums::tile_area(std::size_t tile) const {
  const int column = static_cast<int>(tile) % tiles_across_;
  const int row = static_cast<int>(tile) / tiles_across_;
  return {window_.x + column * tile_size_, window_.y + row * tile_size_,
          std::min(tile_size_, window_.width - column * tile_size_),
          std::min(tile_size_, window_.height - row * tile_size_)};
}

std::size_t BeautySums::pixel(int x, int y) const {
  return static_cast<std::size_t>(y - window_.y) * static_cast<std::size_t>(window_.width) +
         static_cast<std::size_t>(x - window_.x);
}

Image trace_image(const LitWorld& lit, const RayScene::View& view, int image_width, const PixelWindow& window,
                  const TraceOptions& options, const RayThrough& ray_through) {
  // Small, so that the threads end together.
  BeautySums sums(image_width, window, 8);
  ProgressCounter progress(options, sums.tile_count());
  parallel_for(sums.tile_count(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile) {
      sums.trace(lit, view, options, tile, options.samples_per_pixel, ray_through);
      progress.step();
    }
  });
  return sums.image();
}

}  // namespace tracing

Image Tracer::trace_beauty(const Camera& camera, const TraceOptions& options) const {
  validate(camera);
  tracing::validate(options);
  const tracing::LitWorld& lit = state_->lit;
  const tracing::World& world = lit.world;
  const tracing::CameraRays rays(camera);
  const glm::vec3 eye = camera.eye - world.rays.origin();
  const auto ray_through = [&](int, glm::vec2 point) { return tracing::Ray{eye, rays.direction(point)}; };
  return tracing::trace_image(lit, world.rays.all(), camera.width,
                              tracing::window_in(options, camera.width, camera.height), options, ray_through);
}

BeautyTrace Tracer::trace_beauty_to_noise(const Camera& camera, float noise,
                                          const TraceOptions& options) const {
  validate(camera);
  tracing::validate(options);
  if (!(noise > 0.0F && noise <= 1.0F)) {
    throw InvalidArgument("noise", text_of(noise), "more than 0 and at most 1");
  }
  constexpr int kFirstSamples = 16;
  if (options.samples_per_pixel < kFirstSamples) {
    throw InvalidArgument("samples_per_pixel", std::to_string(options.samples_per_pixel),
                          "at least " + std::to_string(kFirstSamples) + " where the noise decides");
  }
  const tracing::LitWorld& lit = state_->lit;
  const tracing::World& world = lit.world;
  const tracing::CameraRays rays(camera);
  const glm::vec3 eye = camera.eye - world.rays.origin();
  const auto ray_through = [&](int, glm::vec2 point) { return tracing::Ray{eye, rays.direction(point)}; };
  constexpr int kTileSize = 16;
  tracing::BeautySums sums(camera.width, tracing::window_in(options, camera.width, camera.height), kTileSize);

  // Rounds over all tiles, so that which one ends depends neither on the number of threads nor on their
  // order.
  std::vector<std::size_t> open(sums.tile_count());
  std::iota(open.begin(), open.end(), std::size_t{0});
  std::vector<double> relative(sums.tile_count(), 0.0);
  double floor = 0.0;
  for (std::int64_t samples = kFirstSamples; !open.empty(); samples *= 2) {
    const int target = static_cast<int>(std::min<std::int64_t>(samples, options.samples_per_pixel));
    parallel_for(open.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        sums.trace(lit, world.rays.all(), options, open[i], target, ray_through);
      }
    });
    if (samples == kFirstSamples) {
      double luminance = 0.0;
      double pixels = 0.0;
      for (std::size_t tile : open) {
        luminance += sums.error(tile).luminance;
        pixels += sums.error(tile).pixels;
      }
      floor = 0.1 * luminance / pixels;
    }
    std::erase_if(open, [&](std::size_t tile) {
      const tracing::BeautySums::TileError error = sums.error(tile);
      const double error_of_pixel = std::sqrt(error.squared_error / error.pixels);
      const double scale = std::max(floor, error.luminance / error.pixels);
      relative[tile] = error_of_pixel > 0.0 ? error_of_pixel / scale : 0.0;
      return relative[tile] <= static_cast<double>(noise);
    });
    if (options.progress) {
      options.progress(1.0 - static_cast<double>(open.size()) / static_cast<double>(sums.tile_count()));
    }
    if (target == options.samples_per_pixel) break;
  }

  BeautyTrace trace;
  trace.image = sums.image();
  for (std::size_t tile = 0; tile < sums.tile_count(); ++tile) {
    trace.noise += relative[tile] * relative[tile];
    trace.mean_samples_per_pixel += sums.samples(tile);
  }
  const auto tiles = static_cast<double>(sums.tile_count());
  trace.noise = std::sqrt(trace.noise / tiles);
  trace.mean_samples_per_pixel /= tiles;
  trace.share_above = static_cast<double>(open.size()) / tiles;
  return trace;
}

}  // namespace mirrorbake
