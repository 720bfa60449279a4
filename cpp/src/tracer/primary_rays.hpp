#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

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

/// A piece of an image row, and which of its pixels' samples are meant. A sample's random numbers depend on
/// the place of its pixel in the whole image.
struct RowSegment {
  int image_width = 0;
  int row = 0;
  int first_column = 0;
  int columns = 0;
  int first_sample = 0;
  int samples = 0;
  /// Places of the samples inside every pixel, in [0,1); empty: each sample takes a random one of its
  /// stratum.
  std::span<const glm::vec2> places = {};
};

/// The samples of a row segment, pixel after pixel, traced a packet at a time.
template <typename RayThrough>
class PrimaryRow {
 public:
  /// `ray_through(point)` is the ray through a point of the image, in pixels.
  PrimaryRow(const RayScene::View& view, std::uint64_t seed, const RowSegment& segment,
             RayThrough ray_through)
      : view_(view), seed_(seed), segment_(segment), ray_through_(ray_through) {}

  /// To be called columns × samples times.
  const PrimarySample& next() {
    if (cursor_ == filled_) trace_packet();
    return samples_[cursor_++];
  }

 private:
  void trace_packet() {
    const auto per_pixel = static_cast<std::uint64_t>(segment_.samples);
    const std::uint64_t all = static_cast<std::uint64_t>(segment_.columns) * per_pixel;
    filled_ = static_cast<std::size_t>(std::min<std::uint64_t>(kPacketSize, all - next_sample_));
    cursor_ = 0;
    std::array<Ray, kPacketSize> rays;
    std::array<Hit, kPacketSize> hits;
    for (std::size_t i = 0; i < filled_; ++i, ++next_sample_) {
      const std::uint64_t column = next_sample_ / per_pixel;
      const std::uint64_t x = static_cast<std::uint64_t>(segment_.first_column) + column;
      const std::uint64_t pixel =
          static_cast<std::uint64_t>(segment_.row) * static_cast<std::uint64_t>(segment_.image_width) + x;
      PrimarySample& s = samples_[i];
      s.stream = sample_stream(seed_, pixel,
                               static_cast<std::uint32_t>(segment_.first_sample) +
                                   static_cast<std::uint32_t>(next_sample_ - column * per_pixel));
      const std::uint64_t sample = next_sample_ - column * per_pixel;
      s.point = glm::vec2(x, segment_.row) +
                (segment_.places.empty() ? s.stream.get(camera_dimension) : segment_.places[sample]);
      s.ray = rays[i] = ray_through_(s.point);
    }
    view_.intersect_packet({rays.data(), filled_}, hits.data(), RayKind::camera);
    for (std::size_t i = 0; i < filled_; ++i) samples_[i].hit = hits[i];
  }

  const RayScene::View& view_;
  std::uint64_t seed_;
  RowSegment segment_;
  RayThrough ray_through_;
  std::uint64_t next_sample_ = 0;
  std::size_t cursor_ = 0;
  std::size_t filled_ = 0;
  std::array<PrimarySample, kPacketSize> samples_;
};

}  // namespace mirrorbake::tracing
