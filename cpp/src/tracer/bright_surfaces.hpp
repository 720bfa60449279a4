#pragma once

#include <cstdint>
#include <vector>
#include <glm/vec2.hpp>

#include "ray_scene.hpp"
#include "surface.hpp"

namespace mirrorbake::tracing {

struct World;

/// Small diffuse surfaces close to a light, such as the frame of a window. What they reflect matters to
/// places from which rays of a random direction seldom hit them; those places choose points of them as they
/// choose points of lights.
class BrightSurfaces {
 public:
  /// None.
  BrightSurfaces() = default;
  /// Looks at all diffuse surfaces under direct light.
  BrightSurfaces(const World& world, std::uint64_t seed);

  bool empty() const { return triangles_.empty(); }

  /// Point of a triangle.
  struct Point {
    std::uint32_t object = 0;
    std::uint32_t triangle = 0;
    glm::vec2 barycentric{0.0F};  ///< weights of the second and third vertex
  };
  /// With the density `density` of the triangle. `u` in [0,1)². Not to be called of an empty set.
  Point sample(glm::vec2 u) const;
  /// Of points, m⁻²; 0 where a surface is not bright.
  float density(std::uint32_t object, std::uint32_t triangle) const {
    const std::vector<float>& of_object = density_[object];
    return of_object.empty() ? 0.0F : of_object[triangle];
  }

 private:
  struct Triangle {
    std::uint32_t object, triangle;
  };
  std::vector<Triangle> triangles_;
  std::vector<float> cdf_;                   ///< their number + 1, in [0,1]
  std::vector<std::vector<float>> density_;  ///< per object and triangle; empty for an object without any
};

}  // namespace mirrorbake::tracing
