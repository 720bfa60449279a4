#pragma once

#include "resample_kernels.hpp"

namespace mirrorbake::MIRRORBAKE_ISA {

/// ResampleKernels::find_weights().
void find_weights(const TileImages& tile, const BoxArrays& boxes, const TexelWeights& source,
                  const BoxShape& shape, const std::uint32_t* texels, std::size_t count, float* weights);

}  // namespace mirrorbake::MIRRORBAKE_ISA
