#pragma once

#include <cstddef>

#include "mirrorbake/core/isa.hpp"

/// The inner loops over arrays, one set per instruction set. Pointers, since the files that are compiled for
/// AVX may not use inline functions of the standard library (see mirrorbake_add_isa_sources).
namespace mirrorbake {

/// n² − 1 − κ² as high + low, and nκ: what is constant over a batch.
struct MediumConstants {
  double high = 0;
  double low = 0;
  double nk = 0;
};

/// Coefficients of the powers of 2c² − 1 in Re g and |g|², g = √((η + ik)² − sin²θ) (fresnel_formulas.hpp).
struct ConductorSeries {
  float a[6];
  float m[6];
};

/// f[i] = F(c[i]) for `count` cosines.
template <typename T>
struct FresnelBatch {
  const T* c = nullptr;
  T* f = nullptr;
  std::size_t count = 0;
  bool is_part_of_large = false;  ///< of an array that no second-level cache holds: written past the caches
};

struct FresnelKernels {
  void (*schlick_f32)(const FresnelBatch<float>& batch, float r0);
  void (*schlick_f64)(const FresnelBatch<double>& batch, double r0);
  void (*dielectric_f32)(const FresnelBatch<float>& batch, float n2_less_1);
  void (*dielectric_f32_in_double)(const FresnelBatch<float>& batch, MediumConstants medium);
  void (*dielectric_f64)(const FresnelBatch<double>& batch, MediumConstants medium);
  void (*conductor_f32)(const FresnelBatch<float>& batch, float a, float nk);
  void (*conductor_series_f32)(const FresnelBatch<float>& batch, const ConductorSeries& series);
  void (*conductor_f32_in_double)(const FresnelBatch<float>& batch, MediumConstants medium);
  void (*conductor_f64)(const FresnelBatch<double>& batch, MediumConstants medium);
  void (*table_f32)(const FresnelBatch<float>& batch, const float* values, std::size_t size);
  void (*table_f64)(const FresnelBatch<double>& batch, const float* values, std::size_t size);

  // One set of parameters per element.
  void (*schlick_each_f32)(const FresnelBatch<float>& batch, const float* r0);
  void (*schlick_each_f64)(const FresnelBatch<double>& batch, const double* r0);
  void (*dielectric_each_f32)(const FresnelBatch<float>& batch, const float* ior);
  void (*dielectric_each_f64)(const FresnelBatch<double>& batch, const double* ior);
  void (*conductor_each_f32)(const FresnelBatch<float>& batch, const float* eta, const float* k);
  void (*conductor_each_f64)(const FresnelBatch<double>& batch, const double* eta, const double* k);
};

/// The loops for active_isa().
const FresnelKernels& fresnel_kernels();

namespace baseline {
extern const FresnelKernels kFresnelKernels;
}
namespace sse42 {
extern const FresnelKernels kFresnelKernels;
}
namespace avx2 {
extern const FresnelKernels kFresnelKernels;
}
namespace avx512 {
extern const FresnelKernels kFresnelKernels;
}

}  // namespace mirrorbake
