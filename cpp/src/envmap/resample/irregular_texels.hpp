#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "bilinear_mean.hpp"
#include "coverage.hpp"
#include "resample_job.hpp"
#include "straight_texels.hpp"
#include "tap.hpp"

namespace mirrorbake {

/// Texels whose image in the source is not a quadrilateral on one face: around poles and other singularities,
/// across the edges of faces, on the rim of a round map, or large. In a panorama the outline of the image is
/// traced as closely as needed; elsewhere the texel is subdivided until its parts are quadrilaterals.
class IrregularTexels {
 public:
  explicit IrregularTexels(const ResampleJob& job);

  /// Most taps that find() returns.
  static constexpr std::size_t kMostTaps = 1 << 16;

  /// The taps of the texel of `face` that spans the given rectangle of the target; their weights add up to 1,
  /// or there are none. Nothing if there are too many: such a texel shrinks the source so much that
  /// `automatic` does not interpolate.
  std::optional<std::span<const Tap>> find(int face, glm::dvec2 low, glm::dvec2 high);

  /// The same of a texel whose image is a quadrilateral on one face of the source, with this share of
  /// interpolation.
  std::optional<std::span<const Tap>> find_straight(int face, const Quad& quad, double share);

  /// Hands the taps of a texel of any size out, some at a time, for the filter `area`. A texel may come
  /// several times. Returns the sum of their weights.
  double stream(int face, glm::dvec2 low, glm::dvec2 high,
                const std::function<void(std::span<const Tap>)>& consume);

 private:
  static constexpr int kDeepest = 6;
  static constexpr int kDeepestOnRim = 4;  // where all parts along the rim end
  static constexpr int kDeepestIfLong = 12;

  enum class Content { constant_texels, interpolated };
  using Corners = std::array<TexelCorner, 4>;

  TexelCorner corner(int face, double x, double y) const;
  Corners corners(int face, glm::dvec2 low, glm::dvec2 high) const;
  bool covered(const TexelCorner& corner) const;
  FaceTexel texel(const TexelCorner& corner) const;
  std::optional<Quad> quad_on_face(const Corners& corners) const;
  double texels_across(int face, glm::dvec2 low, glm::dvec2 high) const;
  void start(Content content);
  void take_part(double share);
  void add(const FaceTexel& texel, double weight);
  static void merge(std::vector<Tap>& taps);
  void gather(int face, glm::dvec2 low, glm::dvec2 high, const Corners& corners, int depth);
  void gather_point(const TexelCorner& at, double weight);
  void gather_polygon(int face, std::span<const glm::dvec2> corners);
  void split(int face, glm::dvec2 low, glm::dvec2 high, const Corners& corners, int depth);

  // A point of a texel's outline, in the plane of the target's face and in texels of the source.
  struct OutlinePoint {
    glm::dvec2 at;
    glm::dvec2 position;
  };
  OutlinePoint outline_point(int face, glm::dvec2 at) const;
  bool gather_outline(int face, glm::dvec2 low, glm::dvec2 high, const Corners& corners, DiscExtent place);
  void trace(int face, const OutlinePoint& from, const OutlinePoint& to, bool along_rim, int depth);
  void trace_around(int face, glm::dvec2 low, glm::dvec2 high);
  void trace_within_disc(int face, glm::dvec2 low, glm::dvec2 high);
  void unroll_outline();
  bool is_pole(glm::dvec2 position) const;
  double unrolled(double x, double near) const;

  const ResampleJob& job_;
  const StraightLimits limits_;
  // What one part of a texel loses by a straight edge the next one gets; only the texel's own edges matter.
  StraightLimits limits_of_parts_;
  Coverage coverage_;
  BilinearMean interpolated_;
  Content content_ = Content::constant_texels;
  bool clipped_ = false;
  bool too_many_ = false;
  int polygons_ = 0;  // that taps come from; different ones may have the same texels
  const std::function<void(std::span<const Tap>)>* consume_ = nullptr;
  std::vector<glm::dvec2> outline_;  // in texels of the source
  std::vector<glm::dvec2> polygon_;  // the same, going on across the seam
  std::vector<Tap> part_;            // unnormalised
  std::vector<Tap> taps_;
  double total_ = 0.0;
};

}  // namespace mirrorbake
