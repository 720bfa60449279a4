// Compiled once per instruction set (mirrorbake_add_isa_sources): MIRRORBAKE_ISA names the level.
#include "lookup_kernels.hpp"

#include "lookup_formulas.hpp"

namespace mirrorbake::MIRRORBAKE_ISA {
namespace {

/// Rays per block: the coordinates of a block, one array each, stay in the first-level cache.
constexpr std::size_t kBlock = 128;

template <typename T>
struct Block {
  alignas(64) T x[kBlock];
  alignas(64) T y[kBlock];
  alignas(64) T z[kBlock];
};

template <typename T>
inline void load(const T* __restrict xyz, std::size_t count, Block<T>& block) {
  for (std::size_t i = 0; i < count; ++i) {
    block.x[i] = xyz[3 * i];
    block.y[i] = xyz[3 * i + 1];
    block.z[i] = xyz[3 * i + 2];
  }
}

template <typename T>
inline void store(const Block<T>& block, std::size_t count, T* __restrict xyz) {
  for (std::size_t i = 0; i < count; ++i) {
    xyz[3 * i] = block.x[i];
    xyz[3 * i + 1] = block.y[i];
    xyz[3 * i + 2] = block.z[i];
  }
}

/// x·0 is 0 for finite x and NaN otherwise, which nothing added to the sum takes away again.
template <typename T>
inline bool all_finite(const Block<T>& a, const Block<T>& b, std::size_t count) {
  unsigned bad = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const T sum = (a.x[i] + a.y[i] + a.z[i]) + (b.x[i] + b.y[i] + b.z[i]);
    bad |= sum * T(0) == T(0) ? 0U : 1U;
  }
  if (bad == 0) return true;
  // The sum of finite values may be infinite.
  bad = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const T sum =
        a.x[i] * T(0) + a.y[i] * T(0) + a.z[i] * T(0) + b.x[i] * T(0) + b.y[i] * T(0) + b.z[i] * T(0);
    bad |= sum == T(0) ? 0U : 1U;
  }
  return bad == 0;
}

template <typename T>
inline Vec vec(const Block<T>& block, std::size_t i) {
  return {static_cast<double>(block.x[i]), static_cast<double>(block.y[i]), static_cast<double>(block.z[i])};
}

/// lookups[i] = lookup along direction(position i, second i), block by block.
template <LookupShape shape, bool rotated, typename T, typename Direction>
std::size_t loop(const LookupConstants& constants, const T* positions, const T* seconds, T* lookups,
                 std::size_t count, Direction direction) {
  const LookupConstants k = constants;
  Block<T> p, s;
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t n = count - begin < kBlock ? count - begin : kBlock;
    load(positions + 3 * begin, n, p);
    load(seconds + 3 * begin, n, s);
    if (!all_finite(p, s, n)) return begin;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec position = vec(p, i);
      const Vec second = vec(s, i);
      const Vec result = lookup<shape, rotated>(k, position, direction(position, second));
      p.x[i] = static_cast<T>(result.x);
      p.y[i] = static_cast<T>(result.y);
      p.z[i] = static_cast<T>(result.z);
    }
    store(p, n, lookups + 3 * begin);
  }
  return count;
}

template <typename T, typename Direction>
std::size_t loop_of_shape(const LookupConstants& k, const T* positions, const T* seconds, T* lookups,
                          std::size_t count, Direction direction) {
  switch (k.shape) {
    case LookupShape::infinite:
      return loop<LookupShape::infinite, false>(k, positions, seconds, lookups, count, direction);
    case LookupShape::box:
      return k.rotated ? loop<LookupShape::box, true>(k, positions, seconds, lookups, count, direction)
                       : loop<LookupShape::box, false>(k, positions, seconds, lookups, count, direction);
    case LookupShape::ellipsoid:
      return k.rotated
                 ? loop<LookupShape::ellipsoid, true>(k, positions, seconds, lookups, count, direction)
                 : loop<LookupShape::ellipsoid, false>(k, positions, seconds, lookups, count, direction);
    case LookupShape::hemisphere:
      return k.rotated
                 ? loop<LookupShape::hemisphere, true>(k, positions, seconds, lookups, count, direction)
                 : loop<LookupShape::hemisphere, false>(k, positions, seconds, lookups, count, direction);
  }
  return 0;
}

template <typename T>
std::size_t rays(const LookupConstants& k, const T* positions, const T* directions, T* lookups,
                 std::size_t count) {
  return loop_of_shape(k, positions, directions, lookups, count, [](const Vec&, const Vec& d) { return d; });
}

std::size_t mirrors(const LookupConstants& k, const double* eye, const float* positions, const float* normals,
                    float* lookups, std::size_t count) {
  const Vec e = vec(eye);
  return loop_of_shape(k, positions, normals, lookups, count,
                       [e](const Vec& p, const Vec& n) { return reflect(p, n, e); });
}

}  // namespace

const LookupKernels kLookupKernels = {
    .rays_f32 = rays<float>,
    .rays_f64 = rays<double>,
    .mirrors_f32 = mirrors,
};

}  // namespace mirrorbake::MIRRORBAKE_ISA
