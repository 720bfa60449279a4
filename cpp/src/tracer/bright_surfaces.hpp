#pragma once

#include <cstdint>
#include <vector>
#include <glm/vec2.hpp>

#include "ray_scene.hpp"
#include "triangle_sampler.hpp"

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

  bool empty() const { return points_.triangles().empty(); }

  /// A random point, as if a ray had hit it. `u` in [0,1)². Not to be called of an empty set.
  Hit sample(glm::vec2 u) const { return points_.sample(u); }
  /// Of points, m⁻²; 0 where a surface is not bright.
  float density(std::uint32_t object, std::uint32_t triangle) const {
    const std::vector<float>& of_object = density_[object];
    return of_object.empty() ? 0.0F : of_object[triangle];
  }

 private:
  TriangleSampler points_;
  std::vector<std::vector<float>> density_;  ///< per object and triangle; empty for an object without any
};

}  // namespace mirrorbake::tracing
