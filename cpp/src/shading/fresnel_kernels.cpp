// Compiled once per instruction set (mirrorbake_add_isa_sources): MIRRORBAKE_ISA names the level.
#include "fresnel_kernels.hpp"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "fresnel_formulas.hpp"
#include "mirrorbake/core/vector_bytes.hpp"

namespace mirrorbake::MIRRORBAKE_ISA {
namespace {

// Plain loops that the compiler vectorises; `__restrict` is what lets it, and callers have checked it.

/// Whether to go through c and f from their ends. A load waits for an earlier store that has the same last 12
/// bits of the address (Intel 64 and IA-32 Architectures Optimization Reference Manual, "4-KByte memory
/// aliasing"), and arrays that were allocated one after the other often differ by a little more than whole
/// pages: then the stores to f run just ahead of the loads from c, unless both run backwards.
inline bool runs_backwards(const void* c, const void* f) {
  constexpr __UINTPTR_TYPE__ kPage = 4096;
  const __UINTPTR_TYPE__ ahead =
      (reinterpret_cast<__UINTPTR_TYPE__>(f) - reinterpret_cast<__UINTPTR_TYPE__>(c)) % kPage;
  return ahead > 0 && ahead < kPage / 2;
}

/// How far ahead of itself a loop asks for memory. For what it will write: a store to a line that is in no
/// cache waits for it, and the processor fetches ahead for loads alone. For what it will read past the
/// caches' size: the processor does not fetch ahead across pages.
constexpr std::size_t kWriteAheadBytes = 2048;
constexpr std::size_t kReadAheadBytes = 4096;

/// Writes a vector to aligned memory without reading it into the caches first, where the processor can.
inline void write_past_caches(void* to, const void* from) {
#if defined(__AVX512F__)
  _mm512_stream_si512(static_cast<__m512i*>(to), _mm512_load_si512(from));
#elif defined(__AVX2__)
  _mm256_stream_si256(static_cast<__m256i*>(to), _mm256_load_si256(static_cast<const __m256i*>(from)));
#elif defined(__SSE2__)
  _mm_stream_si128(static_cast<__m128i*>(to), _mm_load_si128(static_cast<const __m128i*>(from)));
#else
  __builtin_memcpy(to, from, kVectorBytes);
#endif
}

/// Such writes may pass later ones, until this.
inline void order_writes() {
#if defined(__SSE2__)
  _mm_sfence();
#endif
}

/// f[i] = formula(first + i, clamped c[i]).
template <typename T, typename Formula>
inline void evaluate(const T* __restrict c, T* __restrict f, std::size_t first, std::size_t count,
                     Formula formula) {
  // What GCC unrolls it no longer vectorises.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC unroll 1
#endif
  for (std::size_t i = 0; i < count; ++i) f[i] = formula(first + i, clamp_cosine(c[i]));
}

/// One vector, number `first` and on, of a batch.
template <bool kPastCaches, typename T, typename Formula>
inline void evaluate_vector(const FresnelBatch<T>& batch, std::size_t first, bool backwards,
                            Formula formula) {
  constexpr std::size_t kVector = kVectorBytes / sizeof(T);
  T* const f = batch.f + first;
  if constexpr (kPastCaches) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(batch.c + first);
    __builtin_prefetch(backwards ? bytes - kReadAheadBytes : bytes + kReadAheadBytes, 0);
    alignas(kVectorBytes) T values[kVector];
    evaluate(batch.c + first, values, first, kVector, formula);
    write_past_caches(f, values);
  } else {
    const auto* bytes = reinterpret_cast<const unsigned char*>(f);
    __builtin_prefetch(backwards ? bytes - kWriteAheadBytes : bytes + kWriteAheadBytes, 1);
    evaluate(batch.c + first, f, first, kVector, formula);
  }
}

template <bool kPastCaches, typename T, typename Formula>
inline void evaluate_vectors(const FresnelBatch<T>& batch, std::size_t begin, std::size_t end,
                             Formula formula) {
  constexpr std::size_t kVector = kVectorBytes / sizeof(T);
  if (runs_backwards(batch.c, batch.f)) {
    for (std::size_t i = end; i > begin; i -= kVector) {
      evaluate_vector<kPastCaches>(batch, i - kVector, true, formula);
    }
  } else {
    for (std::size_t i = begin; i < end; i += kVector) evaluate_vector<kPastCaches>(batch, i, false, formula);
  }
}

/// f[i] = formula(i, clamped c[i]).
template <typename T, typename Formula>
inline void for_each_cosine(const FresnelBatch<T>& batch, Formula formula) {
  constexpr std::size_t kVector = kVectorBytes / sizeof(T);
  std::size_t begin = 0;
  if (batch.is_part_of_large) {
    const std::size_t past = reinterpret_cast<__UINTPTR_TYPE__>(batch.f) % kVectorBytes / sizeof(T);
    begin = past > 0 ? kVector - past : 0;
    if (begin > batch.count) begin = batch.count;
  }
  const std::size_t end = begin + (batch.count - begin) / kVector * kVector;
  evaluate(batch.c, batch.f, 0, begin, formula);
  if (batch.is_part_of_large) {
    evaluate_vectors<true>(batch, begin, end, formula);
    order_writes();
  } else {
    evaluate_vectors<false>(batch, begin, end, formula);
  }
  evaluate(batch.c + end, batch.f + end, end, batch.count - end, formula);
}

template <typename T>
void schlick_loop(const FresnelBatch<T>& batch, T r0) {
  for_each_cosine(batch, [=](std::size_t, T cosine) { return schlick(cosine, r0); });
}

void dielectric_loop(const FresnelBatch<float>& batch, float k) {
  for_each_cosine(batch, [=](std::size_t, float cosine) { return dielectric_in_float(cosine, k); });
}

template <typename T>
void dielectric_any_loop(const FresnelBatch<T>& batch, MediumConstants medium) {
  const Double2 a = {medium.high, medium.low};
  for_each_cosine(batch, [=](std::size_t, T cosine) {
    return static_cast<T>(dielectric_any(static_cast<double>(cosine), a));
  });
}

void conductor_loop(const FresnelBatch<float>& batch, float a, float nk) {
  for_each_cosine(batch, [=](std::size_t, float cosine) { return conductor_in_float(cosine, a, nk); });
}

void conductor_series_loop(const FresnelBatch<float>& batch, const ConductorSeries& series) {
  for_each_cosine(
      batch, [series](std::size_t, float cosine) { return conductor_series(cosine, series.a, series.m); });
}

template <typename T>
void conductor_any_loop(const FresnelBatch<T>& batch, MediumConstants constants) {
  const Medium medium = {{constants.high, constants.low}, constants.nk};
  for_each_cosine(batch, [=](std::size_t, T cosine) {
    return static_cast<T>(conductor_any(static_cast<double>(cosine), medium));
  });
}

template <typename T>
void table_loop(const FresnelBatch<T>& batch, const float* __restrict values, std::size_t size) {
  const int last = static_cast<int>(size) - 1;
  for_each_cosine(batch, [=](std::size_t, T cosine) { return interpolate(cosine, values, last); });
}

template <typename T>
void schlick_each_loop(const FresnelBatch<T>& batch, const T* __restrict r0) {
  for_each_cosine(batch, [=](std::size_t i, T cosine) { return schlick(cosine, r0[i]); });
}

template <typename T>
void dielectric_each_loop(const FresnelBatch<T>& batch, const T* __restrict ior) {
  for_each_cosine(batch, [=](std::size_t i, T cosine) {
    const Medium medium = make_medium(static_cast<double>(ior[i]), 0.0);
    return static_cast<T>(dielectric_any(static_cast<double>(cosine), medium.a));
  });
}

template <typename T>
void conductor_each_loop(const FresnelBatch<T>& batch, const T* __restrict eta, const T* __restrict k) {
  for_each_cosine(batch, [=](std::size_t i, T value) {
    const double cosine = static_cast<double>(value);
    const double kappa = static_cast<double>(k[i]);
    const Medium medium = make_medium(static_cast<double>(eta[i]), kappa);
    const double transparent = dielectric_any(cosine, medium.a);
    const double absorbing = conductor_any(cosine, medium);
    return static_cast<T>(kappa < 1e-100 ? transparent : absorbing);
  });
}

}  // namespace

const FresnelKernels kFresnelKernels = {
    .schlick_f32 = schlick_loop<float>,
    .schlick_f64 = schlick_loop<double>,
    .dielectric_f32 = dielectric_loop,
    .dielectric_f32_in_double = dielectric_any_loop<float>,
    .dielectric_f64 = dielectric_any_loop<double>,
    .conductor_f32 = conductor_loop,
    .conductor_series_f32 = conductor_series_loop,
    .conductor_f32_in_double = conductor_any_loop<float>,
    .conductor_f64 = conductor_any_loop<double>,
    .table_f32 = table_loop<float>,
    .table_f64 = table_loop<double>,
    .schlick_each_f32 = schlick_each_loop<float>,
    .schlick_each_f64 = schlick_each_loop<double>,
    .dielectric_each_f32 = dielectric_each_loop<float>,
    .dielectric_each_f64 = dielectric_each_loop<double>,
    .conductor_each_f32 = conductor_each_loop<float>,
    .conductor_each_f64 = conductor_each_loop<double>,
};

}  // namespace mirrorbake::MIRRORBAKE_ISA
