#pragma once

#include <cstddef>

namespace mirrorbake {

/// Width of the widest vectors of the instruction set that a file is compiled for. Not inline, as it differs
/// from file to file (see mirrorbake_add_isa_sources).
#if defined(__AVX512F__)
static constexpr std::size_t kVectorBytes = 64;
#elif defined(__AVX2__)
static constexpr std::size_t kVectorBytes = 32;
#else
static constexpr std::size_t kVectorBytes = 16;
#endif

}  // namespace mirrorbake
