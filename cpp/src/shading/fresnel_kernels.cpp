// Compiled once per instruction set (mirrorbake_add_isa_sources): MIRRORBAKE_ISA names the level.
#include "fresnel_kernels.hpp"

#include "fresnel_formulas.hpp"

namespace mirrorbake::MIRRORBAKE_ISA {
namespace {

// Plain loops that the compiler vectorises; `__restrict` is what lets it, and callers have checked it.
// Clamping is a loop of its own, within the first-level cache: in one loop GCC follows c = 0 and c = 1 as
// separate paths through the whole formula and blends them at every step, or gives up vectorising.

constexpr std::size_t kBlockBytes = 2048;
constexpr std::size_t kPage = 4096;

/// Where in two pages of `memory` a block stays between its two loops, which read c, write the block, read the block
/// and write f. A load waits for an earlier store that has the same last 12 bits of the address (Intel 64 and IA-32
/// Architectures Optimization Reference Manual, "4-KByte memory aliasing"), and arrays that were allocated one after
/// the other often differ by a little more than whole pages. From here, either loop's stores are half a page
/// and more ahead of its loads.
inline unsigned char* place_of_block(unsigned char* memory, const void* c, const void* f) {
  const auto from = reinterpret_cast<__UINTPTR_TYPE__>(c);
  const auto to = reinterpret_cast<__UINTPTR_TYPE__>(f);
  const __UINTPTR_TYPE__ between = (to - from) % kPage;
  const __UINTPTR_TYPE__ wanted = from + kPage / 2 + between / 2;
  const __UINTPTR_TYPE__ offset = (wanted - reinterpret_cast<__UINTPTR_TYPE__>(memory)) % kPage;
  return memory + offset / 64 * 64;
}

/// f[i] = formula(i, clamped c[i]).
template <typename T, typename Formula>
inline void for_each_cosine(const T* __restrict c, T* __restrict f, std::size_t count, Formula formula) {
  constexpr std::size_t kBlock = kBlockBytes / sizeof(T);
  alignas(64) unsigned char memory[kPage + kBlockBytes];
  for (std::size_t first = 0; first < count; first += kBlock) {
    const std::size_t size = count - first < kBlock ? count - first : kBlock;
    T* __restrict clamped = reinterpret_cast<T*>(place_of_block(memory, c + first, f + first));
    for (std::size_t i = 0; i < size; ++i) clamped[i] = clamp_cosine(c[first + i]);
    for (std::size_t i = 0; i < size; ++i) f[first + i] = formula(first + i, clamped[i]);
  }
}

template <typename T>
void schlick_loop(const T* c, T r0, T* f, std::size_t count) {
  for_each_cosine(c, f, count, [=](std::size_t, T cosine) { return schlick(cosine, r0); });
}

void dielectric_loop(const float* c, float k, float* f, std::size_t count) {
  for_each_cosine(c, f, count, [=](std::size_t, float cosine) { return dielectric_in_float(cosine, k); });
}

template <typename T>
void dielectric_any_loop(const T* c, MediumConstants medium, T* f, std::size_t count) {
  const Double2 a = {medium.high, medium.low};
  for_each_cosine(c, f, count, [=](std::size_t, T cosine) {
    return static_cast<T>(dielectric_any(static_cast<double>(cosine), a));
  });
}

void conductor_loop(const float* c, float a, float nk, float* f, std::size_t count) {
  for_each_cosine(c, f, count, [=](std::size_t, float cosine) { return conductor_in_float(cosine, a, nk); });
}

void conductor_series_loop(const float* c, const ConductorSeries& series, float* f, std::size_t count) {
  for_each_cosine(c, f, count, [series](std::size_t, float cosine) {
    return conductor_series(cosine, series.a, series.m);
  });
}

template <typename T>
void conductor_any_loop(const T* c, MediumConstants constants, T* f, std::size_t count) {
  const Medium medium = {{constants.high, constants.low}, constants.nk};
  for_each_cosine(c, f, count, [=](std::size_t, T cosine) {
    return static_cast<T>(conductor_any(static_cast<double>(cosine), medium));
  });
}

template <typename T>
void table_loop(const T* c, const float* __restrict values, std::size_t size, T* f, std::size_t count) {
  const int last = static_cast<int>(size) - 1;
  for_each_cosine(c, f, count, [=](std::size_t, T cosine) { return interpolate(cosine, values, last); });
}

template <typename T>
void schlick_each_loop(const T* c, const T* __restrict r0, T* f, std::size_t count) {
  for_each_cosine(c, f, count, [=](std::size_t i, T cosine) { return schlick(cosine, r0[i]); });
}

template <typename T>
void dielectric_each_loop(const T* c, const T* __restrict ior, T* f, std::size_t count) {
  for_each_cosine(c, f, count, [=](std::size_t i, T cosine) {
    const Medium medium = make_medium(static_cast<double>(ior[i]), 0.0);
    return static_cast<T>(dielectric_any(static_cast<double>(cosine), medium.a));
  });
}

template <typename T>
void conductor_each_loop(const T* c, const T* __restrict eta, const T* __restrict k, T* f,
                         std::size_t count) {
  for_each_cosine(c, f, count, [=](std::size_t i, T value) {
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
