#pragma once

#include "resample_kernels.hpp"

namespace mirrorbake::MIRRORBAKE_ISA {

/// ResampleKernels::find_weights().
void find_weights(const TileImages& tile, const BoxArrays& boxes, const TexelWeights& source,
                  std::uint8_t kind, const std::uint32_t* texels, std::size_t count, std::uint32_t rows,
                  std::uint32_t columns, float* weights);

}  // namespace mirrorbake::MIRRORBAKE_ISA
