#pragma once

#include <array>
#include <optional>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "coverage.hpp"
#include "mirrorbake/envmap/resample.hpp"
#include "resample_kernels.hpp"

namespace mirrorbake {

/// What all texels of a resampling share.
struct ResampleJob {
  const EnvMapView& source;
  const EnvMapLayout& target;
  ResampleFilter filter;
  glm::dmat3 source_from_target;
  std::vector<double>
      weights;  ///< solid angles of the texels of a face, or of its rows if they do not differ in a row
  bool weights_by_row = false;

  const double& weight(int row, int column) const {
    return weights[weights_by_row ? static_cast<std::size_t>(row)
                                  : static_cast<std::size_t>(row) * static_cast<std::size_t>(width()) +
                                        static_cast<std::size_t>(column)];
  }

  int width() const { return source.layout.width; }
  int height() const { return source.layout.height; }
  const Projection& projection() const { return source.layout.projection; }
  glm::dvec2 position(double x, double y) const {
    return {0.5 * (x + 1.0) * width(), 0.5 * (1.0 - y) * height()};
  }
  glm::dvec3 direction(int face, double x, double y) const {
    return source_from_target * direction_from_point(target.projection, face, x, y);
  }
};

/// The corners of a texel, or the four points p0 p1 p2 p3 around it, in texels of a face of the source.
using Quad = std::array<glm::dvec2, 4>;

StraightLimits straight_limits(const EnvMapLayout& source);
bool is_straight(const Quad& quad, const StraightLimits& limits);

/// How much of `automatic` is interpolation rather than area for texels that many of the source's long. At
/// less than one texel of the source nothing is left to alias, so that the change is quick.
double interpolated_share(double side);

enum class DiscExtent { inside, crosses_rim, outside };

/// Where a rectangle of a round map lies; always inside for the others.
DiscExtent disc_extent(ProjectionKind kind, glm::dvec2 low, glm::dvec2 high);

/// Texels whose image in the source is not a quadrilateral on one face: around poles and other singularities,
/// across the edges of faces, on the rim of a round map. It subdivides them until they are.
class IrregularTexels {
 public:
  explicit IrregularTexels(const ResampleJob& job);

  /// Writes the texel of `face` that spans the given rectangle of the target.
  void write(int face, glm::dvec2 low, glm::dvec2 high, float* result);

 private:
  static constexpr int kDeepest = 6;
  static constexpr int kDeepestOnRim = 4;  // where all parts along the rim end

  // A direction in the frame of the source, and where it lies there.
  struct Corner {
    glm::dvec3 direction{0.0};
    int face = 0;
    glm::dvec2 position{0.0};
  };
  using Corners = std::array<Corner, 4>;

  Corner corner(int face, double x, double y) const;
  Corners corners(int face, glm::dvec2 low, glm::dvec2 high) const;
  bool covered(const Corner& corner) const;
  const float* texel(const Corner& corner) const;
  std::optional<Quad> regular_quad(const Corners& corners, int depth) const;
  double texels_across(int face, glm::dvec2 low, glm::dvec2 high) const;
  void add(const float* values, double weight);
  void gather(int face, glm::dvec2 low, glm::dvec2 high, const Corners& corners, int depth);
  void gather_quad(int face, const Quad& quad);

  const ResampleJob& job_;
  const StraightLimits limits_;
  // What one part of a texel loses by a straight edge the next one gets; only the texel's own edges matter.
  StraightLimits limits_of_parts_;
  Coverage coverage_;
  bool clipped_ = false;
  std::vector<double> radiance_;  // times solid angle
  double solid_angle_ = 0.0;
  std::vector<double> sample_;
  std::vector<double> point_;
};

}  // namespace mirrorbake
