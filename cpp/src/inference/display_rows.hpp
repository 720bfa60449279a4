#pragma once

#include <span>
#include <vector>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mirrorbake/inference/display_fit.hpp"

namespace mirrorbake {

/// What the rows of a view have in common, whatever they are rows of.
struct FitModel {
  std::span<const FitPart> parts;
  std::span<const TexelTopology> maps;
  std::vector<std::size_t> first_texel;  ///< of each map, in the stack of all; then the number of texels
  const RunTimeModel* run_time;

  std::size_t texels() const { return first_texel.back(); }
};

/// Rows of every layer by itself: one for each part, shell and pixel that sees it.
struct LayerRows {
  RenderingMatrix matrix;
  std::vector<glm::vec4> target;   ///< the traced layer
  std::vector<glm::vec3> fresnel;  ///< mean over the lookups
  std::vector<float> coverage;     ///< share of the pixel's traced samples that see the part
};
LayerRows build_layer_rows(const FitModel& model, const DisplayView& view);

/// Rows of the pixels, each divided by its mean F per channel.
struct DisplayRows {
  RenderingMatrix matrix;
  std::vector<glm::vec3> target;   ///< reflected light over `fresnel`, 0 where that is 0
  std::vector<glm::vec3> fresnel;  ///< mean over the lookups
  std::vector<glm::vec3> diffuse;
  std::vector<float> coverage;
};
/// `alpha`: of every texel of the stack of maps.
DisplayRows build_display_rows(const FitModel& model, const DisplayView& view, std::span<const float> alpha);

}  // namespace mirrorbake
