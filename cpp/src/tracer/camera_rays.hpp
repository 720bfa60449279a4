#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/tracer/camera.hpp"

namespace mirrorbake::tracing {

/// Unit ray directions through points of the image, with their change per pixel.
class CameraRays {
 public:
  explicit CameraRays(const Camera& camera);

  struct Direction {
    glm::vec3 direction;  ///< unit
    glm::vec3 dx;         ///< change of `direction` per pixel to the right
    glm::vec3 dy;         ///< and down
  };
  /// `point` in pixels; (0,0) is the top left corner of the image.
  glm::vec3 direction(glm::vec2 point) const;
  Direction direction_with_differentials(glm::vec2 point) const;

 private:
  glm::vec3 unnormalised(glm::vec2 point) const { return corner_ + point.x * right_ + point.y * down_; }

  glm::vec3 corner_;
  glm::vec3 right_;  ///< one pixel to the right on the image plane at distance 1
  glm::vec3 down_;
};

}  // namespace mirrorbake::tracing
