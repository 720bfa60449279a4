#pragma once

#include <vector>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake::tracing {

/// The environment light: bilinear lookup and sampling by luminance.
class EnvironmentSampler {
 public:
  explicit EnvironmentSampler(const EnvironmentLight& light);

  /// What is found in a direction.
  struct Found {
    glm::vec3 radiance;
    float pdf;  ///< density per solid angle with which `sample` takes the direction
  };
  /// `shared`: see Lights.
  Found find(glm::vec3 direction, bool shared) const;
  struct Sample {
    glm::vec3 direction;  ///< unit
    Found found;
  };
  Sample sample(glm::vec2 u, bool shared) const;
  /// ∫ luminance dω.
  double flux() const { return by_luminance_.flux; }

 private:
  glm::vec3 radiance(glm::vec2 uv) const;
  struct Distribution {
    std::vector<float> row_cdf;     ///< height + 1
    std::vector<float> column_cdf;  ///< height × (width + 1)
    double flux = 0.0;              ///< ∫ of what it is made from
  };
  /// Of the texels' luminance above `threshold`.
  Distribution distribution(const std::vector<float>& luminance, double threshold) const;
  float pdf(const Distribution& d, int x, int y) const;  ///< in a texel

  const Image* panorama_;
  float scale_;
  float cosine_;  ///< of the rotation
  float sine_;
  std::vector<double> row_cosine_;  ///< height + 1: cosines of the rows' edges to +Y
  Distribution by_luminance_;
  Distribution by_excess_;  ///< above the average; for shared directions
};

}  // namespace mirrorbake::tracing
