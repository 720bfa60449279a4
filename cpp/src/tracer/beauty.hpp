#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <vector>
#include <glm/vec3.hpp>

#include "integrator.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "options.hpp"
#include "primary_rays.hpp"
#include "world.hpp"

namespace mirrorbake::tracing {

/// Reports the share of finished work, from one thread at a time.
class ProgressCounter {
 public:
  ProgressCounter(const TraceOptions& options, std::size_t total)
      : report_(options.progress), total_(total) {}
  void step(std::size_t count = 1) {
    if (!report_) return;
    const std::lock_guard lock(mutex_);
    done_ += count;
    report_(static_cast<double>(done_) / static_cast<double>(total_));
  }

 private:
  const std::function<void(double)>& report_;
  std::size_t total_;
  std::size_t done_ = 0;
  std::mutex mutex_;
};

/// What the samples of a window's pixels add up to, so that more can be added.
class BeautySums {
 public:
  BeautySums(int image_width, PixelWindow window, int tile_size)
      : image_width_(image_width),
        window_(window),
        tile_size_(tile_size),
        tiles_across_((window.width + tile_size - 1) / tile_size),
        tiles_down_((window.height + tile_size - 1) / tile_size),
        sum_(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height),
             glm::dvec3(0.0)),
        squares_(sum_.size(), 0.0),
        samples_(tile_count(), 0) {}

  std::size_t tile_count() const {
    return static_cast<std::size_t>(tiles_across_) * static_cast<std::size_t>(tiles_down_);
  }

  /// Samples traced per pixel of a tile.
  int samples(std::size_t tile) const { return samples_[tile]; }

  /// Traces on, up to `samples` per pixel of the tile. `ray_through(row, point)` is the ray through a point
  /// of the image.
  template <typename RayThrough>
  void trace(const World& world, const RayScene::View& view, const TraceOptions& options, std::size_t tile,
             int samples, const RayThrough& ray_through) {
    const PathLimits limits{options.max_specular_depth, options.max_diffuse_depth};
    const PixelWindow area = tile_area(tile);
    for (int y = area.y; y < area.y + area.height; ++y) {
      const RowSegment segment{image_width_, y, area.x, area.width, samples_[tile], samples - samples_[tile]};
      PrimaryRow row(view, options.seed, segment, [&](glm::vec2 point) { return ray_through(y, point); });
      for (int x = area.x; x < area.x + area.width; ++x) {
        const std::size_t p = pixel(x, y);
        for (int i = 0; i < segment.samples; ++i) {
          const PrimarySample& s = row.next();
          const glm::vec3 value = radiance(world, s.ray, s.hit, limits, s.stream, 0, 0.0F);
          sum_[p] += glm::dvec3(value);
          squares_[p] += static_cast<double>(luminance(value)) * static_cast<double>(luminance(value));
        }
      }
    }
    samples_[tile] = samples;
  }

  /// Sum over the tile's pixels of luminance, and of the squared standard error of a pixel's mean luminance.
  struct TileError {
    double luminance = 0.0;
    double squared_error = 0.0;
    int pixels = 0;
  };
  TileError error(std::size_t tile) const {
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

  Image image() const {
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

 private:
  PixelWindow tile_area(std::size_t tile) const {
    const int column = static_cast<int>(tile) % tiles_across_;
    const int row = static_cast<int>(tile) / tiles_across_;
    return {window_.x + column * tile_size_, window_.y + row * tile_size_,
            std::min(tile_size_, window_.width - column * tile_size_),
            std::min(tile_size_, window_.height - row * tile_size_)};
  }
  std::size_t pixel(int x, int y) const {
    return static_cast<std::size_t>(y - window_.y) * static_cast<std::size_t>(window_.width) +
           static_cast<std::size_t>(x - window_.x);
  }

  int image_width_;
  PixelWindow window_;
  int tile_size_;  ///< pixels; a tile is what one thread traces at a time
  int tiles_across_;
  int tiles_down_;
  std::vector<glm::dvec3> sum_;
  std::vector<double> squares_;  ///< of the samples' luminance
  std::vector<int> samples_;     ///< per tile
};

/// Beauty values along `ray_through(row, point)`, the rays passing through what `view` leaves out.
template <typename RayThrough>
Image trace_image(const World& world, const RayScene::View& view, int image_width, const PixelWindow& window,
                  const TraceOptions& options, const RayThrough& ray_through) {
  // Small, so that the threads end together.
  BeautySums sums(image_width, window, 8);
  ProgressCounter progress(options, sums.tile_count());
  parallel_for(sums.tile_count(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile) {
      sums.trace(world, view, options, tile, options.samples_per_pixel, ray_through);
      progress.step();
    }
  });
  return sums.image();
}

}  // namespace mirrorbake::tracing
