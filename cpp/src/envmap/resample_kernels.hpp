#pragma once

#include <cstddef>
#include <cstdint>

/// The inner loops of resampling, one set per instruction set. Pointers, since the files that are compiled
/// for AVX may not use inline functions of the standard library or GLM (see mirrorbake_add_isa_sources).
namespace mirrorbake {

/// Where directions lie in a face of width × height texels, in texels from its top left corner.
struct PositionArrays {
  double* x;
  double* y;
  std::int32_t* face;
};

/// What a texel of the target takes.
enum : std::uint8_t { kArea = 1, kInterpolate = 2, kBlend = 3, kIrregular = 4 };

/// When the edges of a texel's image in the source may be taken for straight: b, by which it deviates from a
/// parallelogram, is below a tenth of a texel or `per_length` of its length, and |b × p| + |b × q| is below
/// `shift` of |p × q|, p and q the diagonals.
struct StraightLimits {
  double per_length = 0.0;
  double shift = 0.0;
  double length = 0.0;  ///< most texels along an axis
};
constexpr double kStraightBend = 0.1;

/// Solid angle of a texel as a function of its place in the face: `scale` times 1, (1 + r²)^(−3/2),
/// (1 + r²)^(−2) or sin(a r)/(a r), r the distance of its centre from that of the face, of half-width 1.
struct TexelDensity {
  enum Kind { equal, cube, paraboloid, fisheye };
  Kind kind = equal;
  int width = 1;
  int height = 1;
  double half_angle = 0.0;  ///< a: half of a fisheye's field of view, in radians
  double scale = 1.0;       ///< steradians; multiply_density() leaves it out
};

/// Number of a texel: number of (0, 0) + `per_row` · row + `per_column` · column, and columns, which are
/// `column_per_row` · row + `column_per_column` · column + `column_offset`, modulo the width. Modulo 2³².
struct TexelNumbering {
  std::uint32_t first;
  std::uint32_t per_row;
  std::uint32_t per_column;
  std::int32_t column_per_row;
  std::int32_t column_per_column;
  std::int32_t column_offset;
  std::int32_t width;
};

/// Targets of equally many taps, one after the other.
struct TapGroup {
  std::uint32_t taps;
  std::uint32_t targets;
};

/// Where directions of any length > 0, one array per component, lie in a map.
using PositionLoop = void (*)(const double* dx, const double* dy, const double* dz, std::size_t count,
                              int width, int height, const PositionArrays& result);

struct ResampleKernels {
  PositionLoop latlong_positions;
  PositionLoop cube_positions;
  PositionLoop dual_paraboloid_positions;

  /// Kinds of a row of texels between two rows of count + 1 corners: irregular unless all four are on one
  /// face and the edges straight; then kArea or, with `automatic`, by the share that interpolation has.
  /// Returns the union of the kinds.
  std::uint8_t (*classify)(const PositionArrays& above, const PositionArrays& below, std::size_t count,
                           const StraightLimits& limits, bool automatic, std::uint8_t* kinds, float* shares);

  /// Multiplies weights by the density of their texels.
  void (*multiply_density)(const TexelDensity& density, const std::uint16_t* rows,
                           const std::uint16_t* columns, std::size_t count, float* weights);

  /// Numbers of texels. Returns the largest.
  std::uint32_t (*number_texels)(const TexelNumbering& numbering, const std::uint16_t* rows,
                                 const std::uint16_t* columns, std::size_t count, std::uint32_t* numbers);

  /// result[targets[i]] = Σ weight · values[tap] of target i's taps, groups of targets one after the other.
  /// Sums are taken in float, in order, and those of 32 taps each in double. `may_read_past` allows to read
  /// one value past those of a texel.
  void (*apply)(const float* values, int channels, const std::uint32_t* taps, const float* weights,
                const TapGroup* groups, std::size_t group_count, const std::uint32_t* targets,
                bool may_read_past, float* result);
};

/// The loops for active_isa().
const ResampleKernels& resample_kernels();

namespace baseline {
extern const ResampleKernels kResampleKernels;
}
namespace sse42 {
extern const ResampleKernels kResampleKernels;
}
namespace avx2 {
extern const ResampleKernels kResampleKernels;
}
namespace avx512 {
extern const ResampleKernels kResampleKernels;
}

}  // namespace mirrorbake
