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

template <typename T>
inline Vec vec(const Block<T>& block, std::size_t i) {
  return {static_cast<double>(block.x[i]), static_cast<double>(block.y[i]), static_cast<double>(block.z[i])};
}

/// lookups[i] = lookup along direction(position i, second i), block by block.
template <LookupShape shape, bool rotated, typename T, typename Direction>
void loop(const LookupConstants& constants, const T* positions, const T* seconds, T* lookups,
          std::size_t count, Direction direction) {
  const LookupConstants k = constants;
  Block<T> p, s;
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t n = count - begin < kBlock ? count - begin : kBlock;
    load(positions + 3 * begin, n, p);
    load(seconds + 3 * begin, n, s);
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
}

template <typename T, typename Direction>
void loop_of_shape(const LookupConstants& k, const T* positions, const T* seconds, T* lookups,
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
}

template <typename T>
void rays(const LookupConstants& k, const T* positions, const T* directions, T* lookups, std::size_t count) {
  loop_of_shape(k, positions, directions, lookups, count, [](const Vec&, const Vec& d) { return d; });
}

void mirrors(const LookupConstants& k, const double* eye, const float* positions, const float* normals,
             float* lookups, std::size_t count) {
  const Vec e = vec(eye);
  loop_of_shape(k, positions, normals, lookups, count,
                [e](const Vec& p, const Vec& n) { return reflect(p, n, e); });
}

/// x·0 is 0 for finite x and NaN otherwise, which nothing added to the sum takes away again.
template <typename T>
bool all_finite(const T* values, std::size_t count) {
  constexpr std::size_t kLanes = 32;  // independent sums, so that the loop is vectorised without reordering
  T sums[kLanes] = {};
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) sums[lane] += values[i + lane] * T(0);
  }
  for (; i < count; ++i) sums[0] += values[i] * T(0);
  T sum = 0;
  for (const T lane : sums) sum += lane;
  return sum == T(0);
}

}  // namespace

const LookupKernels kLookupKernels = {
    .rays_f32 = rays<float>,
    .rays_f64 = rays<double>,
    .mirrors_f32 = mirrors,
    .all_finite_f32 = all_finite<float>,
    .all_finite_f64 = all_finite<double>,
};

}  // namespace mirrorbake::MIRRORBAKE_ISA
