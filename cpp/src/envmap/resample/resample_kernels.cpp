// Compiled once per instruction set (mirrorbake_add_isa_sources): MIRRORBAKE_ISA names the level.
#include "resample_kernels.hpp"

#include "block_weights.hpp"

// How vectors are passed differs between instruction sets, but none is passed beyond this file.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace mirrorbake::MIRRORBAKE_ISA {
namespace {

constexpr double kPi = 3.14159265358979323846;

inline double magnitude(double v) { return __builtin_fabs(v); }
inline double larger(double a, double b) { return a > b ? a : b; }

// Rounding may put what lies on an edge a bit beyond it.
inline double within(double v, double side) { return v > 0.0 ? (v < side ? v : side) : 0.0; }

// Angle of the point (x, y), like std::atan2, within 1e-13 rad; 0 or ±π at the origin. One division: the
// octant folds the slope into [0, 1], and (a − b)/(a + b) turns it by another 45° if it is above tan(π/8).
// The polynomial is the best one for atan(t)/t in t² on [0, tan²(π/8)] (Remez, relative error 2.6e-14).
inline double angle(double y, double x) {
  const double ax = magnitude(x);
  const double ay = magnitude(y);
  const bool steep = ay > ax;
  const double low = steep ? ax : ay;
  const double high = steep ? ay : ax;
  const bool turned = low > 0.41421356237309503 * high;
  const double numerator = turned ? low - high : low;
  const double denominator = turned ? low + high : high;
  const double t = numerator / (denominator > 0.0 ? denominator : 1.0);
  const double z = t * t;
  double p = 0.030711354953105726732;
  p = p * z - 0.05877869216360760;
  p = p * z + 0.07564643494897868;
  p = p * z - 0.09078528899974985;
  p = p * z + 0.11110396086015144;
  p = p * z - 0.14285690907887632;
  p = p * z + 0.19999999615324705;
  p = p * z - 0.33333333330889243;
  p = p * z + 0.99999999999997439;
  double a = t * p;
  a = turned ? a + 0.25 * kPi : a;
  a = steep ? 0.5 * kPi - a : a;
  a = x < 0.0 ? kPi - a : a;
  return __builtin_copysign(a, y);
}

// By the series of sin(a)/a and cos(a) in a², which is at most 2π²: what is left out is below 1e-11.
void fisheye_directions(const double* __restrict x, double y, double half_angle, std::size_t count,
                        double* __restrict dx, double* __restrict dy, double* __restrict dz) {
  for (std::size_t i = 0; i < count; ++i) {
    const double z = half_angle * half_angle * (x[i] * x[i] + y * y);
    double sine = 1.0;
    double cosine = 1.0;
#pragma GCC unroll 13
    for (int k = 13; k > 0; --k) {
      sine = 1.0 - z * sine * (1.0 / (2 * k * (2 * k + 1)));
      cosine = 1.0 - z * cosine * (1.0 / (2 * k * (2 * k - 1)));
    }
    dx[i] = half_angle * sine * x[i];
    dy[i] = half_angle * sine * y;
    dz[i] = -cosine;
  }
}

void latlong_positions(const double* __restrict dx, const double* __restrict dy, const double* __restrict dz,
                       std::size_t count, int width, int height, const PositionArrays& result) {
  double* __restrict x = result.x;
  double* __restrict y = result.y;
  std::int32_t* __restrict face = result.face;
  const double per_longitude = width / (2.0 * kPi);
  const double per_latitude = height / kPi;
  for (std::size_t i = 0; i < count; ++i) {
    x[i] = (angle(dx[i], -dz[i]) + kPi) * per_longitude;
    const double across = __builtin_sqrt(dx[i] * dx[i] + dz[i] * dz[i]);
    y[i] = within((0.5 * kPi - angle(dy[i], across)) * per_latitude, height);
    face[i] = 0;
  }
}

void cube_positions(const double* __restrict dx, const double* __restrict dy, const double* __restrict dz,
                    std::size_t count, int width, int height, const PositionArrays& result) {
  double* __restrict x = result.x;
  double* __restrict y = result.y;
  std::int32_t* __restrict face = result.face;
  for (std::size_t i = 0; i < count; ++i) {
    const double ax = magnitude(dx[i]);
    const double ay = magnitude(dy[i]);
    const double az = magnitude(dz[i]);
    const bool by_y = ay > ax;
    const double a = by_y ? ay : ax;
    const bool by_z = az > a;
    const double major = by_z ? dz[i] : by_y ? dy[i] : dx[i];
    const double sign = major < 0.0 ? -1.0 : 1.0;
    // OpenGL's table of faces (projection/cube.cpp): s grows along ∓Z, +X and ±X, t along −Y, ±Z and −Y.
    const double s = by_z ? sign * dx[i] : by_y ? dx[i] : -sign * dz[i];
    const double t = by_z ? -dy[i] : by_y ? sign * dz[i] : -dy[i];
    const double size = by_z ? az : a;
    const double scale = 0.5 / (size > 0.0 ? size : 1.0);
    x[i] = within((0.5 + s * scale) * width, width);
    y[i] = within((0.5 + t * scale) * height, height);
    const double number = (by_z ? 4.0 : by_y ? 2.0 : 0.0) + (major < 0.0 ? 1.0 : 0.0);
    face[i] = static_cast<std::int32_t>(number);
  }
}

void dual_paraboloid_positions(const double* __restrict dx, const double* __restrict dy,
                               const double* __restrict dz, std::size_t count, int width, int height,
                               const PositionArrays& result) {
  double* __restrict x = result.x;
  double* __restrict y = result.y;
  std::int32_t* __restrict face = result.face;
  for (std::size_t i = 0; i < count; ++i) {
    const double q = __builtin_sqrt(dx[i] * dx[i] + dy[i] * dy[i] + dz[i] * dz[i]) + magnitude(dz[i]);
    const double scale = 0.5 / (q > 0.0 ? q : 1.0);
    x[i] = within((0.5 + dx[i] * scale) * width, width);
    y[i] = within((0.5 - dy[i] * scale) * height, height);
    face[i] = dz[i] >= 0.0 ? 0 : 1;
  }
}

std::uint8_t classify(const PositionArrays& above, const PositionArrays& below, std::size_t count,
                      const StraightLimits& limits, bool automatic, std::uint8_t* __restrict kinds,
                      float* __restrict shares) {
  const double* __restrict ax = above.x;
  const double* __restrict ay = above.y;
  const double* __restrict bx = below.x;
  const double* __restrict by = below.y;
  const double per_length = limits.per_length;
  const double most_shift = limits.shift;
  const double farthest = limits.length;
  const double steepness = automatic ? 4.0 : 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double bend_x = ax[i] + bx[i + 1] - ax[i + 1] - bx[i];
    const double bend_y = ay[i] + by[i + 1] - ay[i + 1] - by[i];
    const double px = bx[i + 1] - ax[i];
    const double py = by[i + 1] - ay[i];
    const double qx = bx[i] - ax[i + 1];
    const double qy = by[i] - ay[i + 1];
    const double cross = magnitude(px * qy - py * qx);
    const double shift = magnitude(bend_x * py - bend_y * px) + magnitude(bend_x * qy - bend_y * qx);
    const double longest = larger(larger(magnitude(px), magnitude(py)), larger(magnitude(qx), magnitude(qy)));
    // The image is as long and as wide as the singular values of the map, whose squares add up to `squares`.
    // A long one, as around a pole, is as fine as it is wide: from 2 : 1 on, where the sum is 2.5 areas,
    // fully at 2.5 : 1.
    const double area = 0.5 * cross;
    const double squares = 0.5 * (px * px + py * py + qx * qx + qy * qy);
    double long_share = 2.5 * squares / larger(area, 1e-30) - 6.25;
    long_share = long_share > 0.0 ? long_share : 0.0;
    long_share = long_share < 1.0 ? long_share : 1.0;
    const double wide2 = area * area * squares / larger(squares * squares - area * area, 1e-30);
    const double side = __builtin_sqrt(area + long_share * (wide2 - area));
    const bool straight =
        (magnitude(bend_x) + magnitude(bend_y) < larger(kStraightBend, per_length * longest)) &
        (shift <= most_shift * cross) & (longest < farthest) & (side > 1e-3);
    // Above 0 from one texel down, 1 from three quarters down, and smooth in between: where it bends, the one
    // filter takes what the other does not give.
    double share = steepness - steepness * side;
    share = share > 0.0 ? share : 0.0;
    share = share < 1.0 ? share : 1.0;
    share = share * share * (3.0 - 2.0 * share);
    shares[i] = static_cast<float>(straight ? share : -1.0);
  }
  const std::int32_t* __restrict above_face = above.face;
  const std::int32_t* __restrict below_face = below.face;
  std::uint8_t all = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t face = above_face[i];
    const bool together =
        (face >= 0) & (face == above_face[i + 1]) & (face == below_face[i]) & (face == below_face[i + 1]);
    const float share = shares[i];
    const int kind = share >= 1.0F ? +kInterpolate : share > 0.0F ? +kBlend : +kArea;
    kinds[i] = static_cast<std::uint8_t>((together & (share >= 0.0F)) ? kind : +kIrregular);
    all |= kinds[i];
  }
  return all;
}

inline double least(double a, double b, double c, double d) {
  const double e = a < b ? a : b;
  const double f = c < d ? c : d;
  return e < f ? e : f;
}
inline double greatest(double a, double b, double c, double d) { return larger(larger(a, b), larger(c, d)); }

// Of positions, which are above −kFarthest; what is cut off is below 1e-10.
inline std::int32_t floor_of(double v) {
  constexpr std::int32_t kFarthest = 1 << 18;
  return static_cast<std::int32_t>(v + kFarthest) - kFarthest;
}

// Of pixels, or of the corners of cells with texels' centres for corners. Edges that rounding has put a bit
// beyond a side do not count.
void find_boxes(const PositionArrays& above, const PositionArrays& below,
                const std::uint8_t* __restrict kinds, std::size_t count, const FaceSize& face,
                const BoxArrays& boxes) {
  constexpr double kRounding = 1e-9;
  constexpr std::size_t kSome = 64;
  constexpr std::int32_t kMost = static_cast<std::int32_t>(kMostBlockTaps);
  constexpr std::int32_t kAnywhere = 1 << 30;
  const std::int32_t first_column = face.is_periodic ? -kAnywhere : 0;
  const std::int32_t last_column = face.is_periodic ? kAnywhere : face.width;
  const std::int32_t width = face.width;
  const std::int32_t height = face.height;
  const double* __restrict ax = above.x;
  const double* __restrict ay = above.y;
  const double* __restrict bx = below.x;
  const double* __restrict by = below.y;
  const std::int32_t* __restrict faces = above.face;
  std::int32_t* __restrict lefts = boxes.left;
  std::int32_t* __restrict tops = boxes.top;
  std::uint32_t* __restrict shapes = boxes.shapes;
  std::int32_t rights[kSome];
  std::int32_t bottoms[kSome];
  for (std::size_t begin = 0; begin < count; begin += kSome) {
    const std::size_t end = count - begin < kSome ? count : begin + kSome;
    for (std::size_t i = begin; i < end; ++i) {
      const double offset = 0.5 * (kinds[i] >> 1 & 1);  // of kInterpolate
      lefts[i] = floor_of(least(ax[i], ax[i + 1], bx[i], bx[i + 1]) + (kRounding - offset));
      tops[i] = floor_of(least(ay[i], ay[i + 1], by[i], by[i + 1]) + (kRounding - offset));
      rights[i - begin] = floor_of(greatest(ax[i], ax[i + 1], bx[i], bx[i + 1]) - (kRounding + offset));
      bottoms[i - begin] = floor_of(greatest(ay[i], ay[i + 1], by[i], by[i + 1]) - (kRounding + offset));
    }
    for (std::size_t i = begin; i < end; ++i) {
      const std::int32_t kind = kinds[i];
      const std::int32_t more = kind >> 1 & 1;
      const std::int32_t right = rights[i - begin];
      const std::int32_t bottom = bottoms[i - begin];
      const std::int32_t columns = (right > lefts[i] ? right - lefts[i] : 0) + more + 1;
      const std::int32_t rows = (bottom > tops[i] ? bottom - tops[i] : 0) + more + 1;
      const bool fits = (kind != kIrregular) & (tops[i] >= 0) & (tops[i] + rows <= height) &
                        (lefts[i] >= first_column) & (lefts[i] + columns <= last_column) &
                        (columns <= width) & (columns <= kMost) & (rows <= kMost) & (rows * columns <= kMost);
      const std::int32_t shape = rows | columns << 10 | faces[i] << 20 | kind << 24;
      shapes[i] = fits ? static_cast<std::uint32_t>(shape) : 0U;
    }
  }
}

std::uint32_t number_texels(const TexelNumbering& numbering, const std::uint16_t* __restrict rows,
                            const std::uint16_t* __restrict columns, std::size_t count,
                            std::uint32_t* __restrict numbers) {
  const TexelNumbering n = numbering;
  const std::uint32_t width = static_cast<std::uint32_t>(n.width);
  std::uint32_t largest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t row = rows[i];
    const std::int32_t column = columns[i];
    const std::int32_t at = n.column_per_row * row + n.column_per_column * column + n.column_offset;
    std::uint32_t number = n.first + n.per_row * static_cast<std::uint32_t>(row) +
                           n.per_column * static_cast<std::uint32_t>(column);
    number += at < 0 ? width : 0U;
    number -= at >= n.width ? width : 0U;
    numbers[i] = number;
    largest = number > largest ? number : largest;
  }
  return largest;
}

// Sums in float of more taps than these lose digits.
constexpr std::uint32_t kFloatTaps = 32;

typedef float FourFloats __attribute__((vector_size(16)));
typedef float FourAnywhere __attribute__((vector_size(16), aligned(4), may_alias));
typedef double FourDoubles __attribute__((vector_size(32)));

inline FourFloats load(const float* from) { return *reinterpret_cast<const FourAnywhere*>(from); }

// Several values of a texel side by side.
template <int kValues>
struct Lanes;

template <>
struct Lanes<1> {
  typedef float Floats;
  typedef double Doubles;
  typedef bool Flags;
  static bool any(Flags v) { return v; }
  static Floats read(const float* from) { return *from; }
  static Doubles widen(Floats v) { return static_cast<double>(v); }
  static Floats narrow(Doubles v) { return static_cast<float>(v); }
  static void write(float* to, Floats v) { *to = v; }
};

template <>
struct Lanes<4> {
  typedef FourFloats Floats;
  typedef FourDoubles Doubles;
  typedef std::int32_t Flags __attribute__((vector_size(16)));
  static bool any(Flags v) { return (v[0] | v[1] | v[2] | v[3]) != 0; }
  static Floats read(const float* from) { return load(from); }
  static Doubles widen(Floats v) { return __builtin_convertvector(v, FourDoubles); }
  static Floats narrow(const Doubles& v) { return __builtin_convertvector(v, FourFloats); }
  static void write(float* to, Floats v) { *reinterpret_cast<FourAnywhere*>(to) = v; }
};

// Three values, read as four.
template <>
struct Lanes<3> : Lanes<4> {
  static void write(float* to, Floats v) {
    typedef float Two __attribute__((vector_size(8), aligned(4), may_alias));
    *reinterpret_cast<Two*>(to) = Two{v[0], v[1]};
    to[2] = v[2];
  }
};

template <typename L>
struct Block {
  const float* from;
  std::ptrdiff_t row_step;
  std::ptrdiff_t column_step;
  std::uint32_t rows;
  std::uint32_t columns;
};

// `kColumns` 0: known at run time only.
template <typename L, std::uint32_t kColumns, bool kSkipZeros>
inline typename L::Floats block_sum(const Block<L>& block, const float* weights) {
  const std::uint32_t columns = kColumns > 0 ? kColumns : block.columns;
  const float* from = block.from;
  typename L::Floats sum = {};
  const auto add_row = [&] {
    const float* texel = from;
    if constexpr (kColumns > 0) {
#pragma GCC unroll 8
      for (std::uint32_t c = 0; c < kColumns; ++c, texel += block.column_step) {
        if (!kSkipZeros || weights[c] != 0.0F) sum += weights[c] * L::read(texel);
      }
    } else {
      for (std::uint32_t c = 0; c < columns; ++c, texel += block.column_step) {
        if (!kSkipZeros || weights[c] != 0.0F) sum += weights[c] * L::read(texel);
      }
    }
    weights += columns;
    from += block.row_step;
  };
  if (block.rows * columns <= kFloatTaps) {
    for (std::uint32_t r = 0; r < block.rows; ++r) add_row();
    return sum;
  }
  typename L::Doubles whole = {};
  for (std::uint32_t r = 0; r < block.rows; ++r) {
    sum = typename L::Floats{};
    add_row();
    whole += L::widen(sum);
  }
  return L::narrow(whole);
}

// `kStride` 0: known at run time only. Returns whether a sum is not a number: texels that are not finite
// spoil sums even if their weight is 0.
template <int kValues, int kStride, std::uint32_t kColumns, bool kSkipZeros>
bool apply_group(const float* __restrict values, std::size_t stride_, const BlockGroup& group,
                 const BlockSteps& steps, const std::uint32_t* __restrict texels,
                 const float* __restrict weights, const std::uint32_t* __restrict targets,
                 float* __restrict result) {
  typedef Lanes<kValues> L;
  const std::size_t stride = kStride > 0 ? kStride : stride_;
  Block<L> block = {nullptr, steps.per_row * static_cast<std::ptrdiff_t>(stride),
                    steps.per_column * static_cast<std::ptrdiff_t>(stride), group.rows, group.columns};
  const std::size_t taps = static_cast<std::size_t>(group.rows) * group.columns;
  typename L::Flags spoilt = {};
  for (std::uint32_t i = 0; i < group.targets; ++i, weights += taps) {
    block.from = values + texels[i] * stride;
    const typename L::Floats sum = block_sum<L, kColumns, kSkipZeros>(block, weights);
    spoilt |= sum != sum;
    L::write(result + targets[i] * stride, sum);
  }
  return L::any(spoilt);
}

template <int kValues, int kStride>
void apply_blocks_of(const float* values, std::size_t stride, const BlockGroup& group,
                     const BlockSteps& steps, const std::uint32_t* texels, const float* weights,
                     const std::uint32_t* targets, float* result) {
  typedef bool (*Apply)(const float*, std::size_t, const BlockGroup&, const BlockSteps&, const std::uint32_t*,
                        const float*, const std::uint32_t*, float*);
  static constexpr Apply kApply[] = {
      apply_group<kValues, kStride, 0, false>, apply_group<kValues, kStride, 1, false>,
      apply_group<kValues, kStride, 2, false>, apply_group<kValues, kStride, 3, false>,
      apply_group<kValues, kStride, 4, false>, apply_group<kValues, kStride, 5, false>,
      apply_group<kValues, kStride, 6, false>, apply_group<kValues, kStride, 7, false>,
      apply_group<kValues, kStride, 8, false>};
  constexpr std::uint32_t kMost = sizeof(kApply) / sizeof(kApply[0]);
  const Apply apply = kApply[group.columns < kMost ? group.columns : 0];
  if (apply(values, stride, group, steps, texels, weights, targets, result)) {
    apply_group<kValues, kStride, 0, true>(values, stride, group, steps, texels, weights, targets, result);
  }
}

template <int kValues>
void apply_taps_of(const float* __restrict values, std::size_t stride, const std::uint32_t* __restrict taps,
                   const float* __restrict weights, const std::uint32_t* __restrict counts,
                   std::size_t target_count, const std::uint32_t* __restrict targets,
                   float* __restrict result) {
  typedef Lanes<kValues> L;
  for (std::size_t i = 0; i < target_count; ++i) {
    typename L::Doubles whole = {};
    for (std::uint32_t k = 0; k < counts[i]; k += kFloatTaps) {
      const std::uint32_t rest = counts[i] - k;
      const std::uint32_t end = rest < kFloatTaps ? rest : kFloatTaps;
      typename L::Floats part = {};
      for (std::uint32_t j = 0; j < end; ++j) part += weights[j] * L::read(values + taps[j] * stride);
      whole += L::widen(part);
      taps += end;
      weights += end;
    }
    L::write(result + targets[i] * stride, L::narrow(whole));
  }
}

void apply_blocks(const float* values, int channels, const BlockGroup& group, const BlockSteps& steps,
                  const std::uint32_t* texels, const float* weights, const std::uint32_t* targets,
                  bool may_read_past, float* result) {
  const std::size_t stride = static_cast<std::size_t>(channels);
  if (channels == 1)
    return apply_blocks_of<1, 1>(values, stride, group, steps, texels, weights, targets, result);
  if (channels == 3 && may_read_past) {
    return apply_blocks_of<3, 3>(values, stride, group, steps, texels, weights, targets, result);
  }
  if (channels == 4)
    return apply_blocks_of<4, 4>(values, stride, group, steps, texels, weights, targets, result);
  int first = 0;
  for (; first + 4 <= channels; first += 4) {
    apply_blocks_of<4, 0>(values + first, stride, group, steps, texels, weights, targets, result + first);
  }
  for (; first < channels; ++first) {
    apply_blocks_of<1, 0>(values + first, stride, group, steps, texels, weights, targets, result + first);
  }
}

void apply_taps(const float* values, int channels, const std::uint32_t* taps, const float* weights,
                const std::uint32_t* counts, std::size_t target_count, const std::uint32_t* targets,
                bool may_read_past, float* result) {
  const std::size_t stride = static_cast<std::size_t>(channels);
  if (channels == 3 && may_read_past) {
    return apply_taps_of<3>(values, stride, taps, weights, counts, target_count, targets, result);
  }
  int first = 0;
  for (; first + 4 <= channels; first += 4) {
    apply_taps_of<4>(values + first, stride, taps, weights, counts, target_count, targets, result + first);
  }
  for (; first < channels; ++first) {
    apply_taps_of<1>(values + first, stride, taps, weights, counts, target_count, targets, result + first);
  }
}

}  // namespace

extern const ResampleKernels kResampleKernels = {
    fisheye_directions, latlong_positions, cube_positions, dual_paraboloid_positions,
    classify,           find_boxes,        find_weights,   number_texels,
    apply_blocks,       apply_taps};

}  // namespace mirrorbake::MIRRORBAKE_ISA
