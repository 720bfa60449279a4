#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "lobe_kernels.hpp"
#include "mirrorbake/prefilter/lobe.hpp"

/// How finely the source has to be looked at for a lobe, by the chord 2 sin(γ/2) from its axis.
namespace mirrorbake {

struct LobePlan {
  static constexpr std::size_t kSteps = 512;  ///< of the chord from 0 to 2

  double width = 1.0;  ///< σ of the Gaussian that the peak looks like, in radians
  double cut = 2.0;    ///< chord beyond which weights count for nothing
  // Widest nodes, in radians: no closer than the chord, and where the weight has a corner at cos γ = 0.
  std::array<float, kSteps + 1> allowed = {};
  std::array<float, kSteps + 1> allowed_bright = {};  ///< of nodes that are brighter than most
  float at_horizon = 1.0F;
  float bright_at_horizon = 1.0F;
  std::vector<float> table = {};
  LobeTerms terms = {};

  float allowed_at(float chord) const { return allowed[step_of(chord)]; }
  float allowed_bright_at(float chord) const { return allowed_bright[step_of(chord)]; }
  static std::size_t step_of(float chord) {
    const float position = chord * (0.5F * kSteps);
    return position > 0.0F
               ? (position < static_cast<float>(kSteps) ? static_cast<std::size_t>(position) : kSteps)
               : std::size_t{0};
  }
  double finest() const;  ///< of all but the bright ones
};

/// `plan.terms.table` points into `plan.table`: the plan must not be copied.
void make_plan(const Lobe& lobe, LobePlan& plan);

}  // namespace mirrorbake
