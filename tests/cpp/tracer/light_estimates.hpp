#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <glm/vec3.hpp>

#include "scenes.hpp"

namespace mirrorbake::test {

inline constexpr double kPi = std::numbers::pi;

inline TracerOptions indirect(IndirectLight light) {
  TracerOptions options;
  options.indirect = light;
  return options;
}

// Mean and standard error of the mean over the pixels, which are independent estimates of the same value.
struct Estimate {
  double mean;
  double error;
};
inline Estimate estimate(const Image& image, int channel = 0) {
  double sum = 0;
  double squares = 0;
  const int count = image.width * image.height;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const double v = image.at(x, y)[channel];
      sum += v;
      squares += v * v;
    }
  }
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean) / count)};
}

// A camera that looks at a spot of a horizontal floor: all pixels see nearly the same point.
inline Camera spot(glm::vec3 point) {
  Camera camera;
  camera.eye = point + glm::vec3(0.4F, 1.0F, 0.3F);
  camera.target = point;
  camera.vertical_fov_degrees = 0.01F;
  camera.width = camera.height = 64;
  return camera;
}

inline TriangleMesh floor_at(float y, float half = 3.0F) {
  return make_rectangle({-half, y, half}, {2 * half, 0, 0}, {0, 0, -2 * half});
}

}  // namespace mirrorbake::test
