#include "options.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake::tracing {

bool usable(glm::vec3 p) {
  return std::abs(p.x) <= kLargestCoordinate && std::abs(p.y) <= kLargestCoordinate &&
         std::abs(p.z) <= kLargestCoordinate;
}

void check_point(const char* argument, glm::vec3 point) {
  if (!usable(point)) throw InvalidArgument(argument, text_of(point), "finite coordinates up to 1e18");
}

void validate(const TraceOptions& options) {
  check_range("samples_per_pixel", options.samples_per_pixel, 1, 65536);
  check_range("max_specular_depth", options.max_specular_depth, 0, 64);
  check_range("max_diffuse_depth", options.max_diffuse_depth, 0, 64);
  check_range("most_samples_per_pixel", options.most_samples_per_pixel, 1, 65536);
  if (!(options.noise >= 0.0F && options.noise <= 1.0F)) {
    throw InvalidArgument("noise", text_of(options.noise), "0 to 1");
  }
  if (options.noise > 0.0F && options.samples_per_pixel % 4 != 0) {
    throw InvalidArgument("samples_per_pixel", std::to_string(options.samples_per_pixel),
                          "a multiple of 4 where the noise decides");
  }
}

PixelWindow window_in(const TraceOptions& options, int width, int height) {
  const PixelWindow w = options.window;
  if (w == PixelWindow{}) return {0, 0, width, height};
  const bool inside = w.x >= 0 && w.y >= 0 && w.width > 0 && w.height > 0 && w.width <= width - w.x &&
                      w.height <= height - w.y;
  if (!inside) {
    throw InvalidArgument("window",
                          std::to_string(w.width) + "x" + std::to_string(w.height) + "+" +
                              std::to_string(w.x) + "+" + std::to_string(w.y),
                          "a part of the image of " + std::to_string(width) + "x" + std::to_string(height));
  }
  return w;
}

}  // namespace mirrorbake::tracing
