#pragma once

#include <cstdint>
#include <vector>

#include "mirrorbake/envmap/cube_pyramid.hpp"
#include "texel_vector.hpp"

namespace mirrorbake {

/// What unknown texels tend to, far from known ones: the mean of the known ones, or zero.
enum class FillTowards { neighbours, zero };

/// Fills the texels with `known[i] == 0` smoothly from the others, across all levels: first every coarse texel from
/// its known children (pull), then every fine one from the coarse level, bilinearly (push), then a few relaxations
/// to the mean of the neighbours. The layout's size is a power of two.
void fill_unknown(const CubePyramidLayout& layout, const std::vector<std::uint8_t>& known,
                  FillTowards towards, std::vector<Channels>& texels);

}  // namespace mirrorbake
