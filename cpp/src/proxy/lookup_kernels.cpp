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

/// lookups[i] = lookup from position i along direction i.
template <LookupShape shape, bool rotated, typename P, typename D>
void look_up(const LookupConstants& constants, const Block<P>& positions, const Block<D>& directions,
             std::size_t count, Block<P>& __restrict lookups) {
  const LookupConstants k = constants;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec result = lookup<shape, rotated>(k, vec(positions, i), vec(directions, i));
    lookups.x[i] = static_cast<P>(result.x);
    lookups.y[i] = static_cast<P>(result.y);
    lookups.z[i] = static_cast<P>(result.z);
  }
}

template <typename P, typename D>
void look_up_block(const LookupConstants& k, const Block<P>& positions, const Block<D>& directions,
                   std::size_t count, Block<P>& lookups) {
  with_shape(k.shape, [&]<LookupShape shape>() {
    if (k.rotated) {
      look_up<shape, true>(k, positions, directions, count, lookups);
    } else {
      look_up<shape, false>(k, positions, directions, count, lookups);
    }
  });
}

/// Calls block(first ray, count, positions, seconds) for block after block.
template <typename T, typename Function>
std::size_t for_blocks(const T* positions, const T* seconds, std::size_t count, Function block) {
  Block<T> p, s;
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t n = count - begin < kBlock ? count - begin : kBlock;
    load(positions + 3 * begin, n, p);
    load(seconds + 3 * begin, n, s);
    if (!all_finite(p, s, n)) return begin;
    block(begin, n, p, s);
  }
  return count;
}

template <typename T>
std::size_t rays(const LookupConstants& k, const T* positions, const T* directions, T* lookups,
                 std::size_t count) {
  Block<T> l;
  return for_blocks(positions, directions, count,
                    [&](std::size_t begin, std::size_t n, const Block<T>& p, const Block<T>& d) {
                      look_up_block(k, p, d, n, l);
                      store(l, n, lookups + 3 * begin);
                    });
}

std::size_t mirrors(const LookupConstants* proxies, std::size_t proxy_count, const double* eye,
                    const float* positions, const float* normals, float* lookups, std::size_t stride,
                    std::size_t count) {
  const Vec e = vec(eye);
  Block<double> d;
  Block<float> l;
  return for_blocks(positions, normals, count,
                    [&](std::size_t begin, std::size_t n, const Block<float>& p, const Block<float>& normal) {
                      for (std::size_t i = 0; i < n; ++i) {
                        const Vec direction = reflect(vec(p, i), vec(normal, i), e);
                        d.x[i] = direction.x;
                        d.y[i] = direction.y;
                        d.z[i] = direction.z;
                      }
                      for (std::size_t j = 0; j < proxy_count; ++j) {
                        look_up_block(proxies[j], p, d, n, l);
                        store(l, n, lookups + 3 * (j * stride + begin));
                      }
                    });
}

}  // namespace

const LookupKernels kLookupKernels = {
    .rays_f32 = rays<float>,
    .rays_f64 = rays<double>,
    .mirrors_f32 = mirrors,
};

}  // namespace mirrorbake::MIRRORBAKE_ISA
