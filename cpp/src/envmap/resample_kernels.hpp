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

/// A part of a face, each row with the running sums, from its left end, of the values times solid angle and
/// of the solid angle alone: (columns + 2) × 4 · blocks doubles, the last column a copy. A block of four
/// doubles is what the loops work on; the solid angle is the last one of all blocks. A panorama's columns are
/// counted on across its seam.
struct FluxWindow {
  const double* running = nullptr;
  int row = 0;
  int column = 0;
  int rows = 0;
  int columns = 0;
  int blocks = 1;  ///< 1 for up to 3 channels, 2 for up to 7
};

struct FaceTexels {
  const float* values;  ///< of all faces
  int width;
  int height;
  int channels;
  bool wraps;  ///< the columns of a panorama are periodic
};

/// What a texel of the target takes.
enum : std::uint8_t { kLeave = 0, kArea = 1, kInterpolate = 2, kBlend = 3, kIrregular = 4 };

/// When the edges of a texel's image in the source may be taken for straight: b, by which it deviates from a
/// parallelogram, is below a tenth of a texel or `per_length` of its length, and |b × p| + |b × q| is below
/// `shift` of |p × q|, p and q the diagonals.
struct StraightLimits {
  double per_length = 0.0;
  double shift = 0.0;
  double length = 0.0;  ///< most texels along an axis
};
constexpr double kStraightBend = 0.1;

struct ResampleKernels {
  /// Directions of any length > 0, one array per component.
  void (*latlong_positions)(const double* dx, const double* dy, const double* dz, std::size_t count,
                            int width, int height, const PositionArrays& result);
  void (*cube_positions)(const double* dx, const double* dy, const double* dz, std::size_t count, int width,
                         int height, const PositionArrays& result);
  void (*dual_paraboloid_positions)(const double* dx, const double* dy, const double* dz, std::size_t count,
                                    int width, int height, const PositionArrays& result);

  /// Kinds of a row of texels between two rows of count + 1 corners: irregular unless all four are on one
  /// face and the edges straight; then kArea or, with `automatic`, by the share that interpolation has.
  /// Returns the union of the kinds.
  std::uint8_t (*classify)(const PositionArrays& above, const PositionArrays& below, std::size_t count,
                           const StraightLimits& limits, bool automatic, std::uint8_t* kinds, float* shares);

  /// Means of the corners of a row of texels.
  void (*centers)(const PositionArrays& above, const PositionArrays& below, std::size_t count,
                  const PositionArrays& result);

  /// takes[i] = whether texel i has kArea on a face.
  void (*takes_area)(const std::uint8_t* kinds, const std::int32_t* faces, std::int32_t face,
                     std::size_t count, std::uint8_t* takes);

  /// result[i] = a[i] | b[i]. Returns whether any is set.
  bool (*either)(const std::uint8_t* a, const std::uint8_t* b, std::size_t count, std::uint8_t* result);

  /// Widens low[2] and high[2] by the positions with flags[i] set.
  void (*bounds)(const double* x, const double* y, const std::uint8_t* flags, std::size_t count, double* low,
                 double* high);

  /// One row of a FluxWindow: `texels` and `weights` (solid angles, `weight_step` 1, or a single one, 0) are
  /// the row of the face from its first column. Takes `channels` of them, from number `first`, of texels of
  /// `stride`. Returns whether all sums are finite.
  bool (*running_sums)(const float* texels, const double* weights, int weight_step, int width,
                       const FluxWindow& window, int first, int channels, int stride, double* result);

  /// ∫ G dy along straight edges, G(x, y) the running sum at x in the row of y: edge i goes from (x0[i],
  /// y0[i]) to (x1[i], y1[i]). Edges with needed[i] = 0 are left out. `result` is count × 4 · blocks.
  void (*edge_integrals)(const FluxWindow& window, const double* x0, const double* y0, const double* x1,
                         const double* y1, const std::uint8_t* needed, std::size_t count, double* result);

  /// Means over a row of texels from the integrals along their edges, for those with takes[i]: by Green's
  /// theorem the flux through a texel is ∮ G dy around it. Writes `channels` of the texels' `stride` values.
  void (*means_from_edges)(const double* top, const double* bottom, const double* verticals,
                           const std::uint8_t* takes, std::size_t count, int blocks, int channels, int stride,
                           float* result);

  /// Bilinear interpolation at positions, for texels with kInterpolate; with kBlend too, mixed with `result`
  /// by share[i]. Where a neighbour lies on another face, sets missed[i] = 1 and leaves the texel.
  void (*interpolate)(const FaceTexels& source, const double* x, const double* y, const std::int32_t* face,
                      const std::uint8_t* kinds, const float* share, std::size_t count, float* result,
                      std::uint8_t* missed);
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
