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

struct FresnelKernels {
  void (*schlick_f32)(const float* c, float r0, float* f, std::size_t count);
  void (*schlick_f64)(const double* c, double r0, double* f, std::size_t count);
  void (*dielectric_f32)(const float* c, float n2_less_1, float* f, std::size_t count);
  void (*dielectric_f32_in_double)(const float* c, MediumConstants medium, float* f, std::size_t count);
  void (*dielectric_f64)(const double* c, MediumConstants medium, double* f, std::size_t count);
  void (*conductor_f32)(const float* c, float a, float nk, float* f, std::size_t count);
  void (*conductor_series_f32)(const float* c, const ConductorSeries& series, float* f, std::size_t count);
  void (*conductor_f32_in_double)(const float* c, MediumConstants medium, float* f, std::size_t count);
  void (*conductor_f64)(const double* c, MediumConstants medium, double* f, std::size_t count);
  void (*table_f32)(const float* c, const float* values, std::size_t size, float* f, std::size_t count);
  void (*table_f64)(const double* c, const float* values, std::size_t size, double* f, std::size_t count);

  // One set of parameters per element.
  void (*schlick_each_f32)(const float* c, const float* r0, float* f, std::size_t count);
  void (*schlick_each_f64)(const double* c, const double* r0, double* f, std::size_t count);
  void (*dielectric_each_f32)(const float* c, const float* ior, float* f, std::size_t count);
  void (*dielectric_each_f64)(const double* c, const double* ior, double* f, std::size_t count);
  void (*conductor_each_f32)(const float* c, const float* eta, const float* k, float* f, std::size_t count);
  void (*conductor_each_f64)(const double* c, const double* eta, const double* k, double* f,
                             std::size_t count);
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
