// Compiled once per instruction set (mirrorbake_add_isa_sources): MIRRORBAKE_ISA names the level.
#include "resample_kernels.hpp"

// How vectors are passed differs between instruction sets, but none is passed beyond this file.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace mirrorbake::MIRRORBAKE_ISA {
namespace {

constexpr double kPi = 3.14159265358979323846;

inline double magnitude(double v) { return __builtin_fabs(v); }
inline double larger(double a, double b) { return a > b ? a : b; }

// Rounding may put what lies on an edge a bit beyond it.
inline double within(double v, double side) { return v > 0.0 ? (v < side ? v : side) : 0.0; }

// Positions are above −2³⁰, where a conversion rounds towards zero.
inline int floor_of(double v) {
  const int i = static_cast<int>(v);
  return static_cast<double>(i) > v ? i - 1 : i;
}

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
        (shift <= most_shift * cross) & (longest < farthest) & (side > 1e-6);
    // Above 0 from one texel down, 1 from three quarters down.
    double share = automatic ? 4.0 - 4.0 * side : 0.0;
    share = share > 0.0 ? share : 0.0;
    share = share < 1.0 ? share : 1.0;
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

void centers(const PositionArrays& above, const PositionArrays& below, std::size_t count,
             const PositionArrays& result) {
  const double* __restrict ax = above.x;
  const double* __restrict ay = above.y;
  const double* __restrict bx = below.x;
  const double* __restrict by = below.y;
  double* __restrict x = result.x;
  double* __restrict y = result.y;
  for (std::size_t i = 0; i < count; ++i) {
    x[i] = 0.25 * (ax[i] + ax[i + 1] + bx[i] + bx[i + 1]);
    y[i] = 0.25 * (ay[i] + ay[i + 1] + by[i] + by[i + 1]);
    result.face[i] = above.face[i];
  }
}

void takes_area(const std::uint8_t* __restrict kinds, const std::int32_t* __restrict faces, std::int32_t face,
                std::size_t count, std::uint8_t* __restrict takes) {
  for (std::size_t i = 0; i < count; ++i) {
    takes[i] = static_cast<std::uint8_t>(faces[i] == face ? kinds[i] & kArea : 0);
  }
}

bool either(const std::uint8_t* a, const std::uint8_t* b, std::size_t count,
            std::uint8_t* __restrict result) {
  std::uint8_t any = 0;
  for (std::size_t i = 0; i < count; ++i) {
    result[i] = a[i] | b[i];
    any |= result[i];
  }
  return any != 0;
}

void bounds(const double* __restrict x, const double* __restrict y, const std::uint8_t* __restrict flags,
            std::size_t count, double* low, double* high) {
  for (std::size_t i = 0; i < count; ++i) {
    if (!flags[i]) continue;
    low[0] = x[i] < low[0] ? x[i] : low[0];
    low[1] = y[i] < low[1] ? y[i] : low[1];
    high[0] = x[i] > high[0] ? x[i] : high[0];
    high[1] = y[i] > high[1] ? y[i] : high[1];
  }
}

// Four doubles at any address; one AVX register, or two of SSE2.
typedef double Four __attribute__((vector_size(32)));
typedef double FourAnywhere __attribute__((vector_size(32), aligned(8), may_alias));
typedef float FourFloats __attribute__((vector_size(16), aligned(4), may_alias));

inline Four load(const double* from) { return *reinterpret_cast<const FourAnywhere*>(from); }
inline void store(double* to, Four value) { *reinterpret_cast<FourAnywhere*>(to) = value; }
constexpr Four kLastOne = {0.0, 0.0, 0.0, 1.0};

bool is_finite(const double* sums, int count) {
  bool finite = true;
  for (int k = 0; k < count; ++k) finite = finite && sums[k] - sums[k] == 0.0;
  return finite;
}

// Three channels of texels of three: the hot case. A texel is read with the next one's first value, but for
// the last.
bool running_sums_rgb(const float* __restrict texels, const double* __restrict weights, int weight_step,
                      int width, const FluxWindow& window, double* __restrict result) {
  typedef std::int64_t Mask __attribute__((vector_size(32)));
  constexpr Mask kThree = {-1, -1, -1, 0};
  Four sum = {0.0, 0.0, 0.0, 0.0};
  int from = window.column % width;
  if (from < 0) from += width;
  for (int i = 0; i < window.columns; ++i) {
    store(result + 4 * static_cast<std::size_t>(i), sum);
    const float* t = texels + 3 * static_cast<std::size_t>(from);
    const double weight = weights[from * weight_step];
    Four value;
    if (from + 1 < width) {
      value = __builtin_convertvector(*reinterpret_cast<const FourFloats*>(t), Four);
      value = kThree ? value : kLastOne;
    } else {
      value = Four{static_cast<double>(t[0]), static_cast<double>(t[1]), static_cast<double>(t[2]), 1.0};
    }
    sum += weight * value;
    if (++from == width) from = 0;
  }
  double* end = result + 4 * static_cast<std::size_t>(window.columns);
  store(end, sum);
  store(end + 4, sum);
  return is_finite(end, 4);
}

bool running_sums(const float* texels, const double* weights, int weight_step, int width,
                  const FluxWindow& window, int first, int channels, int stride, double* result) {
  if (channels == 3 && stride == 3 && window.blocks == 1) {
    return running_sums_rgb(texels, weights, weight_step, width, window, result);
  }
  const int sums = 4 * window.blocks;
  for (int k = 0; k < sums; ++k) result[k] = 0.0;
  int from = window.column % width;
  if (from < 0) from += width;
  for (int i = 0; i < window.columns; ++i) {
    const float* texel = texels + static_cast<std::size_t>(from) * static_cast<std::size_t>(stride) + first;
    const double weight = weights[from * weight_step];
    const double* before = result;
    result += sums;
    for (int k = 0; k < sums; ++k) result[k] = before[k];
    for (int k = 0; k < channels; ++k) result[k] += weight * static_cast<double>(texel[k]);
    result[sums - 1] += weight;
    if (++from == width) from = 0;
  }
  for (int k = 0; k < sums; ++k) result[sums + k] = result[k];
  return is_finite(result, sums);
}

// Of edges within the window, in its coordinates. Along a piece within one texel the running sum is linear in
// x, so that its value in the middle is the mean.
template <int kBlocks>
class EdgeWalk {
 public:
  explicit EdgeWalk(const FluxWindow& window)
      : running_(window.running), line_((static_cast<std::size_t>(window.columns) + 2) * 4 * kBlocks) {}

  // From the smaller to the larger y; `sign` is the direction.
  inline void walk(double x0, double y0, double x1, double y1, double sign) {
    const double slope = (x1 - x0) / (y1 - y0);
    int row = static_cast<int>(y0);
    const double* sums = running_ + static_cast<std::size_t>(row) * line_;
    double x = x0;
    double y = y0;
    for (;;) {
      ++row;
      const double end = static_cast<double>(row);
      if (!(end < y1)) break;
      const double next = x0 + slope * (end - y0);
      in_row(sums, x, next, sign * (end - y));
      x = next;
      y = end;
      sums += line_;
    }
    in_row(sums, x, x1, sign * (y1 - y));
  }

  Four sum[kBlocks] = {};

 private:
  inline void in_row(const double* sums, double from, double to, double dy) {
    const double low = from < to ? from : to;
    const double high = from < to ? to : from;
    int column = static_cast<int>(low);
    double end = column + 1;
    if (!(end < high)) {
      piece(sums, column, 0.5 * (low + high), dy);
      return;
    }
    const double per_x = dy / (high - low);
    double x = low;
    do {
      piece(sums, column, 0.5 * (x + end), per_x * (end - x));
      x = end;
      ++column;
      end = column + 1;
    } while (end < high);
    piece(sums, column, 0.5 * (x + high), per_x * (high - x));
  }

  inline void piece(const double* sums, int column, double x, double dy) {
    const double right = dy * (x - column);
    const double left = dy - right;
    const double* a = sums + static_cast<std::size_t>(column) * 4 * kBlocks;
    for (int k = 0; k < kBlocks; ++k) sum[k] += left * load(a + 4 * k) + right * load(a + 4 * (kBlocks + k));
  }

  const double* running_;
  std::size_t line_;
};

template <int kBlocks>
void edge_integrals_of(const FluxWindow& window, const double* x0, const double* y0, const double* x1,
                       const double* y1, const std::uint8_t* needed, std::size_t count, double* result) {
  const double column = window.column;
  const double row = window.row;
  for (std::size_t i = 0; i < count; ++i) {
    if (!needed[i]) continue;
    EdgeWalk<kBlocks> edge(window);
    const bool down = y0[i] < y1[i];
    const double ya = down ? y0[i] : y1[i];
    const double yb = down ? y1[i] : y0[i];
    const double xa = down ? x0[i] : x1[i];
    const double xb = down ? x1[i] : x0[i];
    if (ya < yb) edge.walk(xa - column, ya - row, xb - column, yb - row, down ? 1.0 : -1.0);
    for (int k = 0; k < kBlocks; ++k) {
      store(result + 4 * (i * kBlocks + static_cast<std::size_t>(k)), edge.sum[k]);
    }
  }
}

void edge_integrals(const FluxWindow& window, const double* x0, const double* y0, const double* x1,
                    const double* y1, const std::uint8_t* needed, std::size_t count, double* result) {
  if (window.blocks == 1) {
    edge_integrals_of<1>(window, x0, y0, x1, y1, needed, count, result);
  } else {
    edge_integrals_of<2>(window, x0, y0, x1, y1, needed, count, result);
  }
}

void means_from_edges(const double* __restrict top, const double* __restrict bottom,
                      const double* __restrict verticals, const std::uint8_t* __restrict takes,
                      std::size_t count, int blocks, int channels, int stride, float* __restrict result) {
  const std::size_t sums = 4 * static_cast<std::size_t>(blocks);
  for (std::size_t i = 0; i < count; ++i) {
    if (!takes[i]) continue;
    // Clockwise from the top left, or the other way round if the map mirrors: the sign cancels.
    double flux[8];
    for (std::size_t k = 0; k < sums; k += 4) {
      const std::size_t j = i * sums + k;
      store(flux + k, load(top + j) + load(verticals + j + sums) - load(bottom + j) - load(verticals + j));
    }
    const double scale = 1.0 / flux[sums - 1];
    float* to = result + i * static_cast<std::size_t>(stride);
    for (int k = 0; k < channels; ++k) to[k] = static_cast<float>(flux[k] * scale);
  }
}

template <int kChannels>
void interpolate_of(const FaceTexels& source, const double* x, const double* y, const std::int32_t* face,
                    const std::uint8_t* kinds, const float* share, std::size_t count,
                    float* __restrict result, std::uint8_t* missed) {
  const int c = kChannels > 0 ? kChannels : source.channels;
  const std::size_t texel = static_cast<std::size_t>(c);
  const std::size_t line = static_cast<std::size_t>(source.width) * texel;
  for (std::size_t i = 0; i < count; ++i) {
    if (!(kinds[i] & kInterpolate)) continue;
    const double px = x[i] - 0.5;
    const double py = y[i] - 0.5;
    int column = floor_of(px);
    const int row = floor_of(py);
    const float fx = static_cast<float>(px - column);
    const float fy = static_cast<float>(py - row);
    if (row < 0 || row + 1 >= source.height) {
      missed[i] = 1;
      continue;
    }
    int next = column + 1;
    if (source.wraps) {
      if (column < 0) column += source.width;
      if (column >= source.width) column -= source.width;
      next = column + 1 == source.width ? 0 : column + 1;
    }
    if (column < 0 || next >= source.width) {
      missed[i] = 1;
      continue;
    }
    const float* above = source.values +
                         static_cast<std::size_t>(face[i]) * static_cast<std::size_t>(source.height) * line +
                         static_cast<std::size_t>(row) * line;
    const float* a = above + static_cast<std::size_t>(column) * texel;
    const float* b = above + static_cast<std::size_t>(next) * texel;
    const float wa = (1.0F - fx) * (1.0F - fy);
    const float wb = fx * (1.0F - fy);
    const float wc = (1.0F - fx) * fy;
    const float wd = fx * fy;
    float* to = result + i * texel;
    if (kinds[i] == kInterpolate) {
      for (int k = 0; k < c; ++k) {
        const std::size_t j = static_cast<std::size_t>(k);
        to[j] = wa * a[j] + wb * b[j] + wc * a[line + j] + wd * b[line + j];
      }
    } else {
      const float s = share[i];
      for (int k = 0; k < c; ++k) {
        const std::size_t j = static_cast<std::size_t>(k);
        to[j] = (1.0F - s) * to[j] + s * (wa * a[j] + wb * b[j] + wc * a[line + j] + wd * b[line + j]);
      }
    }
  }
}

void interpolate(const FaceTexels& source, const double* x, const double* y, const std::int32_t* face,
                 const std::uint8_t* kinds, const float* share, std::size_t count, float* result,
                 std::uint8_t* missed) {
  switch (source.channels) {
    case 1: return interpolate_of<1>(source, x, y, face, kinds, share, count, result, missed);
    case 3: return interpolate_of<3>(source, x, y, face, kinds, share, count, result, missed);
    case 4: return interpolate_of<4>(source, x, y, face, kinds, share, count, result, missed);
    default: return interpolate_of<0>(source, x, y, face, kinds, share, count, result, missed);
  }
}

}  // namespace

extern const ResampleKernels kResampleKernels = {latlong_positions,
                                                 cube_positions,
                                                 dual_paraboloid_positions,
                                                 classify,
                                                 centers,
                                                 takes_area,
                                                 either,
                                                 bounds,
                                                 running_sums,
                                                 edge_integrals,
                                                 means_from_edges,
                                                 interpolate};

}  // namespace mirrorbake::MIRRORBAKE_ISA
