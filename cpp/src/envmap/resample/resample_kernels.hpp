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
enum : std::uint8_t { kArea = 1, kInterpolate = 2, kBlend = 3, kIrregular = 4, kAtCenter = 5 };

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

/// Targets that are each made from a rectangle of texels of one face, of the same size for all.
struct BlockGroup {
  std::int32_t face;  ///< of the source
  std::uint32_t rows;
  std::uint32_t columns;
  std::uint32_t targets;
};
constexpr std::size_t kMostBlockTaps = 256;

/// From a texel of the source to the one below and to the one on the right, after a symmetry: what to add to
/// the texel's number.
struct BlockSteps {
  std::int32_t per_row;
  std::int32_t per_column;
};

/// Texels of a tile and their images in the source, each by the number of its corner above left; `pitch` is
/// the number of corners in a row.
struct TileImages {
  PositionArrays corners;
  std::size_t pitch;
  const float* shares;  ///< of interpolation
};

/// The rectangle of texels of the source that a texel of the target reads, by the same numbers.
struct BoxArrays {
  std::int32_t* left;  ///< of a panorama, where columns go on across the seam
  std::int32_t* top;
  std::uint32_t* shapes;  ///< BoxShape, or 0 if it is not on the face, or large
};

/// Texels of the same shape are treated alike.
struct BoxShape {
  std::uint32_t rows;
  std::uint32_t columns;
  std::int32_t face;
  std::uint8_t kind;
};
constexpr std::uint32_t pack(const BoxShape& s) {
  return s.rows | s.columns << 10U | static_cast<std::uint32_t>(s.face) << 20U |
         static_cast<std::uint32_t>(s.kind) << 24U;
}
constexpr BoxShape unpack(std::uint32_t shape) {
  return {shape & 1023U, shape >> 10U & 1023U, static_cast<std::int32_t>(shape >> 20U & 15U),
          static_cast<std::uint8_t>(shape >> 24U)};
}

/// Of a face of the source. A panorama's columns go on across its seam.
struct FaceSize {
  std::int32_t width;
  std::int32_t height;
  bool is_periodic;
};

/// Solid angles of the texels of a face, up to a factor: by row or by texel, row by row, if either is not
/// null.
struct TexelWeights {
  const double* by_row;
  const double* by_texel;
  TexelDensity density;
};

/// Where directions of any length > 0, one array per component, lie in a map.
using PositionLoop = void (*)(const double* dx, const double* dy, const double* dz, std::size_t count,
                              int width, int height, const PositionArrays& result);

struct ResampleKernels {
  /// Directions of points (x, y) of a fisheye map with this half of the field of view, in radians; beyond the
  /// rim, too, up to the corners of the square.
  void (*fisheye_directions)(const double* x, double y, double half_angle, std::size_t count, double* dx,
                             double* dy, double* dz);

  PositionLoop latlong_positions;
  PositionLoop cube_positions;
  PositionLoop dual_paraboloid_positions;

  /// Kinds of a row of texels between two rows of count + 1 corners: irregular unless all four are on one
  /// face and the edges straight; then kArea or, with `automatic`, by the share that interpolation has.
  /// Returns the union of the kinds.
  std::uint8_t (*classify)(const PositionArrays& above, const PositionArrays& below, std::size_t count,
                           const StraightLimits& limits, bool automatic, std::uint8_t* kinds, float* shares);

  /// Boxes of a row of texels.
  void (*find_boxes)(const PositionArrays& above, const PositionArrays& below, const std::uint8_t* kinds,
                     std::size_t count, const FaceSize& face, const BoxArrays& boxes);

  /// Weights of the texels of the source in the boxes of texels of one shape, one after the other: each one's
  /// add up to 1.
  void (*find_weights)(const TileImages& tile, const BoxArrays& boxes, const TexelWeights& source,
                       const BoxShape& shape, const std::uint32_t* texels, std::size_t count, float* weights);

  /// Numbers of texels. Returns the largest.
  std::uint32_t (*number_texels)(const TexelNumbering& numbering, const std::uint16_t* rows,
                                 const std::uint16_t* columns, std::size_t count, std::uint32_t* numbers);

  /// result[targets[i]] = Σ weight · value of the texels of block i, whose first one is texels[i]. Sums are
  /// taken in float; of more than 32 texels row by row, and those of rows in double. Texels of no weight are
  /// not looked at if they are not finite. `may_read_past` allows to read one value past those of a texel.
  void (*apply_blocks)(const float* values, int channels, const BlockGroup& group, const BlockSteps& steps,
                       const std::uint32_t* texels, const float* weights, const std::uint32_t* targets,
                       bool may_read_past, float* result);

  /// result[targets[i]] = Σ weight · values[tap] of target i's counts[i] taps, targets one after the other.
  /// Sums are taken in float, in order, and those of 32 taps each in double.
  void (*apply_taps)(const float* values, int channels, const std::uint32_t* taps, const float* weights,
                     const std::uint32_t* counts, std::size_t target_count, const std::uint32_t* targets,
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
