#pragma once

#include <cstdint>
#include <span>

#include "mirrorbake/envmap/texel_topology.hpp"
#include "texel_vector.hpp"

namespace mirrorbake {

/// Where the texels that nothing is known about go.
enum class FillTowards {
  neighbours,  ///< smoothly between the known ones
  zero,        ///< away from the known ones towards zero: for differences from a prior
};

/// Sets the texels of a map that are not `known` from those that are: pull up the pyramid, push down
/// bilinearly from the coarser level, smooth what was pushed (after Gortler et al., The Lumigraph, SIGGRAPH
/// 1996, §3.4).
void fill_unknown(const TexelTopology& topology, std::span<const std::uint8_t> known, FillTowards towards,
                  std::span<Channels> texels);

}  // namespace mirrorbake
