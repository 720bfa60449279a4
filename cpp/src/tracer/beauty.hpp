#pragma once

#include <cstddef>
#include <functional>
#include <vector>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "primary_rays.hpp"
#include "world.hpp"

namespace mirrorbake::tracing {

/// The ray through a point of an image, in pixels, in one of its rows.
using RayThrough = std::function<Ray(int row, glm::vec2 point)>;

/// What the samples of a window's pixels add up to, so that more can be added.
class BeautySums {
 public:
  /// A tile of `tile_size`² pixels is what one thread traces at a time.
  BeautySums(int image_width, PixelWindow window, int tile_size);

  std::size_t tile_count() const;

  /// Samples traced per pixel of a tile.
  int samples(std::size_t tile) const { return samples_[tile]; }

  /// Traces on, up to `samples` per pixel of the tile.
  void trace(const LitWorld& lit, const RayScene::View& view, const TraceOptions& options, std::size_t tile,
             int samples, const RayThrough& ray_through);

  /// Sum over the tile's pixels of luminance, and of the squared standard error of a pixel's mean luminance.
  struct TileError {
    double luminance = 0.0;
    double squared_error = 0.0;
    int pixels = 0;
  };
  TileError error(std::size_t tile) const;

  Image image() const;

 private:
  PixelWindow tile_area(std::size_t tile) const;
  std::size_t pixel(int x, int y) const;

  int image_width_;
  PixelWindow window_;
  int tile_size_;
  int tiles_across_;
  int tiles_down_;
  std::vector<glm::dvec3> sum_;
  std::vector<double> squares_;  ///< of the samples' luminance
  std::vector<int> samples_;     ///< per tile
};

/// Beauty values along `ray_through`, the rays passing through what `view` leaves out.
Image trace_image(const LitWorld& lit, const RayScene::View& view, int image_width, const PixelWindow& window,
                  const TraceOptions& options, const RayThrough& ray_through);

}  // namespace mirrorbake::tracing
