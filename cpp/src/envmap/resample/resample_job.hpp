#pragma once

#include <span>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/envmap/resample.hpp"
#include "resample_kernels.hpp"

namespace mirrorbake {

/// What all texels of a resampling share.
struct ResampleJob {
  ResampleJob(const EnvMapLayout& source_, const EnvMapLayout& target_, const ResampleOptions& options);

  EnvMapLayout source;  ///< of one level and one channel, as far as positions are concerned
  EnvMapLayout target;
  ResampleFilter filter;
  glm::dmat3 source_from_target;
  TexelDensity density;
  /// Solid angles of the source's rows, if they do not differ in a row, or texels
  std::vector<double> weights;

  int width() const { return source.width; }
  int height() const { return source.height; }
  const Projection& projection() const { return source.projection; }
  bool is_periodic() const { return is_panorama(source.projection.kind); }

  std::span<const double> row_weights() const {
    return is_periodic() ? std::span<const double>(weights) : std::span<const double>();
  }

  TexelWeights texel_weights() const {
    const double* table = weights.empty() ? nullptr : weights.data();
    return {is_periodic() ? table : nullptr, is_periodic() ? nullptr : table, density};
  }

  /// Of a point of a face of the source, in texels from its top left corner.
  glm::dvec2 position(double x, double y) const {
    return {0.5 * (x + 1.0) * width(), 0.5 * (1.0 - y) * height()};
  }
  /// Of a point of the target, in the frame of the source.
  glm::dvec3 direction(int face, double x, double y) const {
    return source_from_target * direction_from_point(target.projection, face, x, y);
  }
  /// Solid angle of a texel of the source, as if the rim did not cut it: it cuts the images
  /// of the target's texels. Where texels are many and small, the density in their centre will do.
  double weight(int row, int column) const;
};

/// A corner of a texel of the target, and where it lies in the source.
struct TexelCorner {
  glm::dvec3 direction{0.0};
  int face = 0;
  glm::dvec2 position{0.0};
};

enum class DiscExtent { inside, crosses_rim, outside };

/// Where a rectangle of a round map lies; always inside for the others.
DiscExtent disc_extent(ProjectionKind kind, glm::dvec2 low, glm::dvec2 high);

}  // namespace mirrorbake
