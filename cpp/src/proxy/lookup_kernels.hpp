#pragma once

#include <cstddef>

/// The inner loops over rays, one set per instruction set. Pointers, since the files that are compiled for
/// AVX may not use inline functions of the standard library or GLM (see mirrorbake_add_isa_sources).
namespace mirrorbake {

enum class LookupShape : int;  // lookup_formulas.hpp

/// A proxy as the loops want it: local = rows · (p − centre), where the rows of the 3×3 matrix are the
/// proxy's axes, divided by its size along them for shapes that are scaled.
struct LookupConstants {
  LookupShape shape{};
  bool rotated = false;
  double centre[3] = {};
  double rows[9] = {};
  double extent[3] = {};  ///< its size along the axes
  double origin[3] = {};
};

/// Arrays of xyz triples; `lookups` may be the same memory as an input, but for mirrors in several proxies,
/// whose lookups begin `stride` triples after one another. The loops go through the rays in blocks, stop
/// before the first block that holds a NaN or an infinite value, and return how many rays they are done with.
struct LookupKernels {
  std::size_t (*rays_f32)(const LookupConstants& k, const float* positions, const float* directions,
                          float* lookups, std::size_t count);
  std::size_t (*rays_f64)(const LookupConstants& k, const double* positions, const double* directions,
                          double* lookups, std::size_t count);
  std::size_t (*mirrors_f32)(const LookupConstants* proxies, std::size_t proxy_count, const double* eye,
                             const float* positions, const float* normals, float* lookups, std::size_t stride,
                             std::size_t count);
};

/// The loops for active_isa().
const LookupKernels& lookup_kernels();

namespace baseline {
extern const LookupKernels kLookupKernels;
}
namespace sse42 {
extern const LookupKernels kLookupKernels;
}
namespace avx2 {
extern const LookupKernels kLookupKernels;
}
namespace avx512 {
extern const LookupKernels kLookupKernels;
}

}  // namespace mirrorbake
