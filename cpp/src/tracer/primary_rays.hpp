#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include <glm/vec2.hpp>

#include "ray_scene.hpp"
#include "sample_stream.hpp"

namespace mirrorbake::tracing {

/// One sample of a pixel: its random numbers, its place in the image, and what its ray meets.
struct PrimarySample {
  SampleStream stream;
  glm::vec2 point{0.0F};
  Ray ray;
  Hit hit;
};

/// The samples of one image row, pixel after pixel, traced a packet at a time.
template <typename RayThrough>
class PrimaryRow {
 public:
  /// `ray_through(point)` is the ray through a point of the image, in pixels.
  PrimaryRow(const RayScene::View& view, std::uint64_t seed, int width, int samples_per_pixel, int row,
             RayThrough ray_through)
      : view_(view),
        seed_(seed),
        width_(static_cast<std::uint64_t>(width)),
        samples_per_pixel_(static_cast<std::uint64_t>(samples_per_pixel)),
        row_(static_cast<std::uint64_t>(row)),
        ray_through_(ray_through) {}

  /// To be called width × samples_per_pixel times.
  const PrimarySample& next() {
    if (cursor_ == filled_) trace_packet();
    return samples_[cursor_++];
  }

 private:
  void trace_packet() {
    filled_ = static_cast<std::size_t>(
        std::min<std::uint64_t>(kPacketSize, width_ * samples_per_pixel_ - next_sample_));
    cursor_ = 0;
    std::array<Ray, kPacketSize> rays;
    std::array<Hit, kPacketSize> hits;
    for (std::size_t i = 0; i < filled_; ++i, ++next_sample_) {
      const std::uint64_t x = next_sample_ / samples_per_pixel_;
      PrimarySample& s = samples_[i];
      s.stream = sample_stream(seed_, row_ * width_ + x,
                               static_cast<std::uint32_t>(next_sample_ - x * samples_per_pixel_));
      s.point = glm::vec2(x, row_) + s.stream.get(camera_dimension);
      s.ray = rays[i] = ray_through_(s.point);
    }
    view_.intersect_packet({rays.data(), filled_}, hits.data());
    for (std::size_t i = 0; i < filled_; ++i) samples_[i].hit = hits[i];
  }

  const RayScene::View& view_;
  std::uint64_t seed_;
  std::uint64_t width_;
  std::uint64_t samples_per_pixel_;
  std::uint64_t row_;
  RayThrough ray_through_;
  std::uint64_t next_sample_ = 0;
  std::size_t cursor_ = 0;
  std::size_t filled_ = 0;
  std::array<PrimarySample, kPacketSize> samples_;
};

}  // namespace mirrorbake::tracing
