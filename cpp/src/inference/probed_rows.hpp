#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "display_rows.hpp"
#include "mirrorbake/inference/probe.hpp"

namespace mirrorbake {

/// The rows of a view that a renderer draws of which only pictures are to be had. Every map is probed by
/// itself, the others black.
class ProbedView {
 public:
  /// Probes all maps with α = 0 everywhere, so that nothing hides those behind. Throws InvalidArgument if
  /// the pictures do not fit to the view's targets, or no pixel is linear in the maps.
  ProbedView(const FitModel& model, const DisplayView& view, const ProbeOptions& options);

  /// A row for each map and pixel that reads it, whatever the number of parts that do.
  LayerRows layer_rows() const;

  /// Rows of the pixels; maps behind others are probed again with `alpha`, of every texel of the stack of
  /// maps, so that what is in front of them is in the weights as the renderer has it.
  DisplayRows display_rows(std::span<const float> alpha);

  const ProbingReport& report() const { return report_; }

 private:
  ProbedMatrix probe(std::size_t map, std::span<const float> alpha);
  /// Traced light of the layers that a map holds, mean over the parts that read it, and their coverage.
  glm::vec4 layer_light(std::size_t map, std::size_t pixel, float& coverage) const;
  bool is_last(std::size_t map) const;
  bool is_hidden(std::size_t map, std::span<const float> alpha) const;

  const FitModel& model_;
  const DisplayView& view_;
  ProbeOptions options_;
  std::vector<ProbedMatrix> maps_;  // a row for each lookup, number lookup · pixels + pixel
  std::size_t pixels_, lookups_ = 0;
  std::vector<float> covered_;  // of every pixel, summed over the lookups
  ProbingReport report_;
};

}  // namespace mirrorbake
