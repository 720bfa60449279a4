#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "cdf.hpp"
#include "ray_scene.hpp"

/// Points of triangles.
namespace mirrorbake::tracing {

/// In double: products of small edges underflow in float.
inline double triangle_area(std::span<const glm::vec3> positions, glm::uvec3 corners) {
  const glm::dvec3 a = positions[corners.x];
  return 0.5 *
         glm::length(glm::cross(glm::dvec3(positions[corners.y]) - a, glm::dvec3(positions[corners.z]) - a));
}

/// Weights of the second and third corner of a point that may be anywhere in a triangle. `u` in [0,1)².
inline glm::vec2 uniform_on_triangle(glm::vec2 u) {
  const float root = std::sqrt(u.x);
  return {root * (1.0F - u.y), root * u.y};
}

/// Points of some triangles of a scene's objects, which are chosen by weight.
class TriangleSampler {
 public:
  struct Triangle {
    std::uint32_t object;
    std::uint32_t triangle;
  };

  /// Of none.
  TriangleSampler() = default;
  /// As many weights as triangles, not negative.
  TriangleSampler(std::vector<Triangle> triangles, std::span<const double> weights)
      : triangles_(std::move(triangles)) {
    if (triangles_.empty()) return;
    cdf_.resize(triangles_.size() + 1);
    weight_ = normalise_cdf(cdf_.data(), weights.data(), static_cast<int>(triangles_.size()));
  }

  const std::vector<Triangle>& triangles() const { return triangles_; }
  /// Of all of them.
  double weight() const { return weight_; }
  double probability(std::size_t number) const { return interval_width(cdf_.data(), number); }

  /// A random point, as if a ray had hit it. There has to be a triangle. `u` in [0,1)².
  Hit sample(glm::vec2 u) const {
    const CdfSample pick = sample_cdf(cdf_.data(), static_cast<int>(triangles_.size()), u.x);
    const Triangle& t = triangles_[static_cast<std::size_t>(pick.index)];
    const glm::vec2 weights = uniform_on_triangle({pick.place, u.y});
    return {0.0F, t.object, t.triangle, weights.x, weights.y};
  }

 private:
  std::vector<Triangle> triangles_;
  std::vector<float> cdf_;
  double weight_ = 0.0;
};

}  // namespace mirrorbake::tracing
