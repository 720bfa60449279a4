#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace mirrorbake {

/// A float32 raster with named channels. Row 0 is the top; the channels of a pixel lie together.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::string> channels;  ///< e.g. {"R", "G", "B"} or {"specular_local.R", ...}
  std::vector<float> pixels;          ///< height × width × channels

  Image() = default;
  Image(int width_, int height_, std::vector<std::string> channels_)
      : width(width_),
        height(height_),
        channels(std::move(channels_)),
        pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * channels.size()) {}

  int channel_count() const { return static_cast<int>(channels.size()); }
  std::size_t offset(int x, int y) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
           channels.size();
  }
  float* at(int x, int y) { return pixels.data() + offset(x, y); }
  const float* at(int x, int y) const { return pixels.data() + offset(x, y); }
};

}  // namespace mirrorbake
