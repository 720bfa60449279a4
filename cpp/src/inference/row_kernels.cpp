// Compiled once per instruction set (mirrorbake_add_isa_sources): MIRRORBAKE_ISA names the level.
#include "row_kernels.hpp"

#ifdef __AVX2__
#include <immintrin.h>
#endif

// Vectors of 8 floats are never passed between translation units.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace mirrorbake::MIRRORBAKE_ISA {
namespace {

// The channels of one texel, and of two that follow each other. Every level adds up the same lanes in the
// same order, in one register or in two.
using One = float __attribute__((vector_size(16), may_alias));
using Two = float __attribute__((vector_size(32), may_alias));
using TwoInMemory = float __attribute__((vector_size(32), may_alias, aligned(16)));
using Halves = std::uint16_t __attribute__((vector_size(16), may_alias));
using HalvesInMemory = std::uint16_t __attribute__((vector_size(16), may_alias, aligned(2)));
using EightFloats = float __attribute__((vector_size(32), may_alias, aligned(4)));
using FourFloats = float __attribute__((vector_size(16), may_alias, aligned(4)));
using Words = std::uint32_t __attribute__((vector_size(32)));

// Products that are added up in float before they go into doubles.
constexpr std::size_t kRowsInFloat = 64;
constexpr std::size_t kPatternsInFloat = 16;
// Floats after which both three and four channels and the lanes of a register begin anew.
constexpr std::size_t kPattern = 24;

inline TwoInMemory& two_at(float* texels, std::size_t number) {
  return *reinterpret_cast<TwoInMemory*>(texels + 4 * number);
}
inline const TwoInMemory& two_at(const float* texels, std::size_t number) {
  return *reinterpret_cast<const TwoInMemory*>(texels + 4 * number);
}
inline One& one_at(float* texels, std::size_t number) { return *reinterpret_cast<One*>(texels + 4 * number); }
inline const One& one_at(const float* texels, std::size_t number) {
  return *reinterpret_cast<const One*>(texels + 4 * number);
}

inline One all(float value) { return One{value, value, value, value}; }
inline Two twice(One v) { return Two{v[0], v[1], v[2], v[3], v[0], v[1], v[2], v[3]}; }
inline One sum_of(const Two& v) { return One{v[0], v[1], v[2], v[3]} + One{v[4], v[5], v[6], v[7]}; }

// A pair's two weights, each for the four channels of its texel.
inline Two weights_of(const float* weights) {
#ifdef __AVX2__
  double both;
  __builtin_memcpy(&both, weights, sizeof(both));
  const __m256i which = _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1);
  return _mm256_permutevar_ps(_mm256_castpd_ps(_mm256_set1_pd(both)), which);
#else
  const float a = weights[0], b = weights[1];
  return Two{a, a, a, a, b, b, b, b};
#endif
}

inline void add_to(double* sums, One part) {
  for (int k = 0; k < 4; ++k) sums[k] += static_cast<double>(part[k]);
}

template <typename Number>
inline One read(const Number* numbers, const float* weights, std::size_t pairs, const float* x) {
  // Two sums: one would wait for itself.
  Two even{}, odd{};
  std::size_t p = 0;
  for (; p + 1 < pairs; p += 2) {
    even += weights_of(weights + 2 * p) * two_at(x, numbers[p]);
    odd += weights_of(weights + 2 * p + 2) * two_at(x, numbers[p + 1]);
  }
  if (p < pairs) even += weights_of(weights + 2 * p) * two_at(x, numbers[p]);
  return sum_of(even + odd);
}

enum class Residual { of_target, of_product, of_both };

template <Residual residual, typename Number>
void go_through(const PairedRows& rows, const Number* numbers, const float* row_weights, const float* target,
                const float* x, float* y, double* squares) {
  const float* weights = rows.weights;
  for (std::size_t begin = 0; begin < rows.rows; begin += kRowsInFloat) {
    const std::size_t end = begin + kRowsInFloat < rows.rows ? begin + kRowsInFloat : rows.rows;
    One part{};
    for (std::size_t r = begin; r < end; ++r) {
      const std::size_t pairs = rows.counts[r];
      One t = residual == Residual::of_target ? one_at(target, r) : read(numbers, weights, pairs, x);
      if (residual == Residual::of_both) t = one_at(target, r) - t;
      const One weighted = one_at(row_weights, r) * t;
      part += weighted * t;
      const Two given = twice(weighted);
      for (std::size_t p = 0; p < pairs; ++p) {
        two_at(y, numbers[p]) += weights_of(weights + 2 * p) * given;
      }
      numbers += pairs;
      weights += 2 * pairs;
    }
    add_to(squares, part);
  }
}

template <Residual residual>
void go_through(const PairedRows& rows, const float* row_weights, const float* target, const float* x,
                float* y, double* squares) {
  if (rows.narrow != nullptr) {
    go_through<residual>(rows, rows.narrow, row_weights, target, x, y, squares);
  } else {
    go_through<residual>(rows, rows.wide, row_weights, target, x, y, squares);
  }
}

void rows_loop(const PairedRows& rows, const float* weights, const float* target, const float* x, float* y,
               double* squares) {
  if (x == nullptr) {
    go_through<Residual::of_target>(rows, weights, target, x, y, squares);
  } else if (target == nullptr) {
    go_through<Residual::of_product>(rows, weights, target, x, y, squares);
  } else {
    go_through<Residual::of_both>(rows, weights, target, x, y, squares);
  }
}

template <std::size_t stride>
void widen(std::size_t count, const float* from, float* to) {
  for (std::size_t i = 0; i < count; ++i) {
    one_at(to, i) = *reinterpret_cast<const FourFloats*>(from + stride * i);
  }
}
void widen_loop(std::size_t count, std::size_t stride, const float* from, float* to) {
  stride == 3 ? widen<3>(count, from, to) : widen<4>(count, from, to);
}

template <std::size_t stride>
void gather(std::size_t count, const float* from, const std::uint32_t* list, float* to) {
  for (std::size_t i = 0; i < count; ++i) {
    one_at(to, i) = *reinterpret_cast<const FourFloats*>(from + stride * list[i]);
  }
}
void gather_loop(std::size_t count, std::size_t stride, const float* from, const std::uint32_t* list,
                 float* to) {
  stride == 3 ? gather<3>(count, from, list, to) : gather<4>(count, from, list, to);
}

template <std::size_t stride>
void narrow(std::size_t count, const float* from, float* to) {
  // Each overwrites what the one before has put too much. What lies behind the last is another band's.
  for (std::size_t i = 0; i + 1 < count; ++i) {
    *reinterpret_cast<FourFloats*>(to + stride * i) = one_at(from, i);
  }
  if (count == 0) return;
  for (std::size_t k = 0; k < stride; ++k) to[stride * (count - 1) + k] = from[4 * (count - 1) + k];
}
void narrow_loop(std::size_t count, std::size_t stride, const float* from, float* to) {
  stride == 3 ? narrow<3>(count, from, to) : narrow<4>(count, from, to);
}

template <std::size_t stride>
void add(std::size_t count, const SharedPart* parts, float* shares) {
  for (std::size_t i = 0; i < count; ++i) {
    float* to = shares + stride * parts[i].unknown;
    const float* from = shares + stride * parts[i].share;
    // What lies behind may be another thread's.
    const One before{to[0], to[1], to[2], stride == 4 ? to[3] : 0.0F};
    const One sum = before + all(parts[i].weight) * *reinterpret_cast<const FourFloats*>(from);
    // Not as twelve bytes: whoever reads the next one would wait for a store that ends within it.
    __builtin_memcpy(to, &sum, 2 * sizeof(float));
    to[2] = sum[2];
    if (stride == 4) to[3] = sum[3];
  }
}
void add_loop(std::size_t count, std::size_t stride, const SharedPart* parts, float* shares) {
  stride == 3 ? add<3>(count, parts, shares) : add<4>(count, parts, shares);
}

// A value per channel, repeated.
struct Pattern {
  float values[kPattern];
  Pattern(const float* channels, std::size_t stride) {
    for (std::size_t k = 0; k < kPattern; ++k) values[k] = channels[k % stride];
  }
};

inline Two floats_of(Halves halves) {
  return __builtin_bit_cast(Two, __builtin_convertvector(halves, Words) << 16);
}
inline Two floats_of(const HalfFloat* halves) {
  return floats_of(*reinterpret_cast<const HalvesInMemory*>(halves));
}
inline float float_of(HalfFloat half) {
  return __builtin_bit_cast(float, static_cast<std::uint32_t>(half) << 16);
}
inline EightFloats& eight_at(float* values) { return *reinterpret_cast<EightFloats*>(values); }
inline const EightFloats& eight_at(const float* values) {
  return *reinterpret_cast<const EightFloats*>(values);
}

// sums[stride] += what `eight` makes of eight floats from i and `single` of those that are left, per channel;
// k, of their places in the pattern. Products are added up in float before they go into doubles.
template <typename Eight, typename Single>
inline void add_up(std::size_t floats, std::size_t stride, double* sums, const Eight& eight,
                   const Single& single) {
  std::size_t i = 0;
  while (i < floats) {
    Two parts[3] = {};
    for (std::size_t pattern = 0; pattern < kPatternsInFloat && i + kPattern <= floats; ++pattern) {
      for (std::size_t k = 0; k < 3; ++k, i += 8) parts[k] += eight(i, 8 * k);
    }
    float part[kPattern];
    for (std::size_t k = 0; k < 3; ++k) eight_at(part + 8 * k) = parts[k];
    if (i + kPattern > floats) {
      for (std::size_t k = 0; i < floats; ++i, ++k) part[k] += single(i, k);
    }
    for (std::size_t k = 0; k < kPattern; ++k) sums[k % stride] += static_cast<double>(part[k]);
  }
}

void begin_loop(std::size_t count, std::size_t stride, const HalfFloat* free, const float* base,
                const float* upper, const float* x, const float* s, HalfFloat* inverse, float* step,
                double* gamma) {
  const Pattern uppers(upper, stride);
  add_up(
      count * stride, stride, gamma,
      [&](std::size_t i, std::size_t k) {
        const Two at = eight_at(x + i), slope = eight_at(s + i), below = eight_at(base + i);
        const auto held = ((at <= -below) & (slope <= Two{})) |
                          ((at >= eight_at(uppers.values + k) - below) & (slope >= Two{}));
        const Halves halves =
            *reinterpret_cast<const HalvesInMemory*>(free + i) & ~__builtin_convertvector(held, Halves);
        *reinterpret_cast<HalvesInMemory*>(inverse + i) = halves;
        const Two next = floats_of(halves) * slope;
        eight_at(step + i) = next;
        return slope * next;
      },
      [&](std::size_t i, std::size_t k) {
        const bool held =
            (x[i] <= -base[i] && s[i] <= 0.0F) || (x[i] >= uppers.values[k] - base[i] && s[i] >= 0.0F);
        inverse[i] = held ? HalfFloat{0} : free[i];
        step[i] = float_of(inverse[i]) * s[i];
        return s[i] * step[i];
      });
}

void gradient_loop(std::size_t count, std::size_t stride, const float* a, const float* normal,
                   const HalfFloat* inverse, float* s, double* gamma) {
  const Pattern lengths(a, stride);
  add_up(
      count * stride, stride, gamma,
      [&](std::size_t i, std::size_t k) {
        const Two next = eight_at(s + i) - eight_at(lengths.values + k) * eight_at(normal + i);
        eight_at(s + i) = next;
        return next * (floats_of(inverse + i) * next);
      },
      [&](std::size_t i, std::size_t k) {
        s[i] -= lengths.values[k] * normal[i];
        return s[i] * (float_of(inverse[i]) * s[i]);
      });
}

void step_loop(std::size_t count, std::size_t stride, const float* a, const float* b,
               const HalfFloat* inverse, const float* s, float* x, float* step) {
  const Pattern lengths(a, stride), ratios(b, stride);
  const std::size_t floats = count * stride;
  std::size_t i = 0;
  while (i + kPattern <= floats) {
    for (std::size_t k = 0; k < 3; ++k, i += 8) {
      const Two before = eight_at(step + i);
      eight_at(x + i) += eight_at(lengths.values + 8 * k) * before;
      eight_at(step + i) =
          floats_of(inverse + i) * eight_at(s + i) + eight_at(ratios.values + 8 * k) * before;
    }
  }
  for (std::size_t k = 0; i < floats; ++i, ++k) {
    const float before = step[i];
    x[i] += lengths.values[k] * before;
    step[i] = float_of(inverse[i]) * s[i] + ratios.values[k] * before;
  }
}

}  // namespace

extern const SolverLoops kSolverLoops;
const SolverLoops kSolverLoops{&rows_loop, &widen_loop, &gather_loop,   &narrow_loop,
                               &add_loop,  &begin_loop, &gradient_loop, &step_loop};

}  // namespace mirrorbake::MIRRORBAKE_ISA
