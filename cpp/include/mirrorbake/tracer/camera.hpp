#pragma once

#include <glm/vec3.hpp>

namespace mirrorbake {

/// A pinhole camera. Pixel (0,0) is the top left one.
struct Camera {
  glm::vec3 eye{0.0F, 0.0F, 1.0F};
  glm::vec3 target{0.0F};
  glm::vec3 up{0.0F, 1.0F, 0.0F};
  float vertical_fov_degrees = 40.0F;  ///< in (0, 180)
  int width = 512;                     ///< pixels
  int height = 512;                    ///< pixels

  bool operator==(const Camera&) const = default;
};

/// Throws InvalidArgument for sizes outside 1…16384, a field of view outside (0,180), eye = target, an `up`
/// along the view, or anything not finite.
void validate(const Camera& camera);

}  // namespace mirrorbake
