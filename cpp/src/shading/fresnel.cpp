#include "mirrorbake/shading/fresnel.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <optional>
#include <sstream>
#include <string_view>

#include "fresnel_batch.hpp"
#include "fresnel_formulas.hpp"
#include "fresnel_kernels.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

using baseline::clamp_cosine;
using baseline::make_medium;
using baseline::Medium;

// The polynomials for a conductor cost some microseconds to set up.
constexpr std::size_t kLeastForSeries = 4096;

// Below this, k changes nothing a double can show, and its square would underflow.
constexpr double kLeastK = 1e-100;

// Where float forms keep the promise of the header (fresnel_formulas.hpp says why).
bool dielectric_fits_float(float ior) { return ior >= 1.05F && ior <= 1e9F; }

bool conductor_fits_float(const Medium& medium, float eta, float k) {
  const double n = eta;
  const double k2 = static_cast<double>(k) * k;
  // R_s falls with c, to this at normal incidence.
  const bool reflective = ((n - 1) * (n - 1) + k2) >= 0.1 * ((n + 1) * (n + 1) + k2);
  const bool no_cancellation = medium.a.high <= -2.0 || medium.a.high >= 0.0 || medium.nk >= 0.5;
  return reflective && no_cancellation && eta <= 1e5F && k <= 1e5F;
}

/// The polynomials for a conductor, or nothing where degree 5 or float does not do: nothing is lost, the loop
/// with square roots is right everywhere else.
std::optional<ConductorSeries> conductor_series(const Medium& medium) {
  constexpr int kTerms = baseline::kSeriesDegree + 1;
  const auto g = [&](double y) {
    return std::sqrt(std::complex(medium.a.high + 0.5 * (y + 1.0), 2.0 * medium.nk));
  };

  // Chebyshev interpolation, then Σ c_j T_j(y) to powers of y by T_{j+1} = 2y T_j − T_{j−1}. The coefficients
  // fall so fast that the conversion loses nothing.
  std::array<double, kTerms> a{};
  std::array<double, kTerms> m{};
  std::array<double, kTerms> chebyshev{};  // powers of T_j
  std::array<double, kTerms> previous{};   // powers of T_{j−1}
  chebyshev[0] = 1.0;
  for (int j = 0; j < kTerms; ++j) {
    double a_j = 0;
    double m_j = 0;
    for (int node = 0; node < kTerms; ++node) {
      const double angle = std::numbers::pi * (node + 0.5) / kTerms;
      const std::complex<double> value = g(std::cos(angle));
      const double weight = (j == 0 ? 1.0 : 2.0) / kTerms * std::cos(j * angle);
      a_j += weight * value.real();
      m_j += weight * std::norm(value);
    }
    std::array<double, kTerms> next{};
    for (int power = 0; power < kTerms; ++power) {
      a[power] += a_j * chebyshev[power];
      m[power] += m_j * chebyshev[power];
      next[power] -= previous[power];
      if (power + 1 < kTerms) next[power + 1] += (j == 0 ? 1.0 : 2.0) * chebyshev[power];
    }
    previous = chebyshev;
    chebyshev = next;
  }

  // Accept an error below half a unit of float.
  constexpr int kChecks = 33;
  for (int i = 0; i < kChecks; ++i) {
    const double y = 2.0 * i / (kChecks - 1) - 1.0;
    const std::complex<double> exact = g(y);
    double a_y = 0;
    double m_y = 0;
    for (int power = kTerms - 1; power >= 0; --power) {
      a_y = a_y * y + a[power];
      m_y = m_y * y + m[power];
    }
    const bool close = std::abs(a_y - exact.real()) <= 1e-8 * exact.real() &&
                       std::abs(m_y - std::norm(exact)) <= 1e-8 * std::norm(exact);
    if (!close) return std::nullopt;
  }

  ConductorSeries series{};
  for (int power = 0; power < kTerms; ++power) {
    series.a[power] = static_cast<float>(a[power]);
    series.m[power] = static_cast<float>(m[power]);
  }
  return series;
}

MediumConstants constants_of(const Medium& medium) { return {medium.a.high, medium.a.low, medium.nk}; }

[[noreturn]] void reject(std::string_view name, double value, std::string_view expected) {
  std::ostringstream text;
  text << value;
  throw InvalidArgument(name, text.str(), expected);
}

// Ranges of the header; comparisons that a NaN fails.
struct Range {
  std::string_view name;
  double low;
  double high;
  bool positive;
  std::string_view expected;
};
constexpr Range kR0 = {"r0", 0.0, 1.0, false, "a reflectance in [0,1]"};
constexpr Range kIor = {"ior", 0.0, 1e100, true, "a relative index > 0, at most 1e100"};
constexpr Range kEta = {"eta", 0.0, 1e40, true, "a refractive index > 0, at most 1e40"};
constexpr Range kK = {"k", 0.0, 1e40, false, "an extinction coefficient in [0, 1e40]"};

void check(const Range& range, double value) {
  const double low = range.positive ? 1e-100 : range.low;
  if (!(value >= low && value <= range.high)) reject(range.name, value, range.expected);
}

}  // namespace

const FresnelKernels& fresnel_kernels() {
#ifdef MIRRORBAKE_HAS_X86_LEVELS
  switch (active_isa()) {
    case Isa::avx512: return avx512::kFresnelKernels;
    case Isa::avx2: return avx2::kFresnelKernels;
    case Isa::sse42: return sse42::kFresnelKernels;
    case Isa::baseline: break;
  }
#endif
  return baseline::kFresnelKernels;
}

float fresnel_schlick(float c, float r0) { return baseline::schlick(clamp_cosine(c), r0); }
double fresnel_schlick(double c, double r0) { return baseline::schlick(clamp_cosine(c), r0); }

float fresnel_dielectric(float c, float ior) {
  const float cosine = clamp_cosine(c);
  const Medium medium = make_medium(static_cast<double>(ior), 0.0);
  if (dielectric_fits_float(ior))
    return baseline::dielectric_in_float(cosine, static_cast<float>(medium.a.high));
  return static_cast<float>(baseline::dielectric_any(static_cast<double>(cosine), medium.a));
}

double fresnel_dielectric(double c, double ior) {
  return baseline::dielectric_any(clamp_cosine(c), make_medium(ior, 0.0).a);
}

float fresnel_dielectric_transmittance(float c, float ior) {
  return static_cast<float>(
      fresnel_dielectric_transmittance(static_cast<double>(c), static_cast<double>(ior)));
}

double fresnel_dielectric_transmittance(double c, double ior) {
  return baseline::dielectric_transmittance(clamp_cosine(c), ior);
}

float fresnel_conductor(float c, float eta, float k) {
  if (k == 0.0F) return fresnel_dielectric(c, eta);
  const float cosine = clamp_cosine(c);
  const Medium medium = make_medium(static_cast<double>(eta), static_cast<double>(k));
  if (conductor_fits_float(medium, eta, k)) {
    return baseline::conductor_in_float(cosine, static_cast<float>(medium.a.high),
                                        static_cast<float>(medium.nk));
  }
  return static_cast<float>(baseline::conductor_any(static_cast<double>(cosine), medium));
}

double fresnel_conductor(double c, double eta, double k) {
  if (k < kLeastK) return fresnel_dielectric(c, eta);
  return baseline::conductor_any(clamp_cosine(c), make_medium(eta, k));
}

namespace {

template <typename T>
void check_each(const Range& range, std::span<const T> values, std::span<T> f) {
  check_input(range.name, values, f);
  for (T value : values) check(range, static_cast<double>(value));
}

}  // namespace

void fresnel_schlick(std::span<const float> c, float r0, std::span<float> f) {
  check(kR0, static_cast<double>(r0));
  map_cosines(c, f, fresnel_kernels().schlick_f32, r0);
}

void fresnel_schlick(std::span<const double> c, double r0, std::span<double> f) {
  check(kR0, r0);
  map_cosines(c, f, fresnel_kernels().schlick_f64, r0);
}

void fresnel_dielectric(std::span<const float> c, float ior, std::span<float> f) {
  check(kIor, static_cast<double>(ior));
  const Medium medium = make_medium(static_cast<double>(ior), 0.0);
  if (dielectric_fits_float(ior)) {
    map_cosines(c, f, fresnel_kernels().dielectric_f32, static_cast<float>(medium.a.high));
  } else {
    map_cosines(c, f, fresnel_kernels().dielectric_f32_in_double, constants_of(medium));
  }
}

void fresnel_dielectric(std::span<const double> c, double ior, std::span<double> f) {
  check(kIor, ior);
  map_cosines(c, f, fresnel_kernels().dielectric_f64, constants_of(make_medium(ior, 0.0)));
}

void fresnel_conductor(std::span<const float> c, float eta, float k, std::span<float> f) {
  check(kEta, static_cast<double>(eta));
  check(kK, static_cast<double>(k));
  if (k == 0.0F) return fresnel_dielectric(c, eta, f);
  const Medium medium = make_medium(static_cast<double>(eta), static_cast<double>(k));
  if (conductor_fits_float(medium, eta, k)) {
    const auto series = c.size() >= kLeastForSeries ? conductor_series(medium) : std::nullopt;
    if (series) return map_cosines(c, f, fresnel_kernels().conductor_series_f32, *series);
    map_cosines(c, f, fresnel_kernels().conductor_f32, static_cast<float>(medium.a.high),
                static_cast<float>(medium.nk));
  } else {
    map_cosines(c, f, fresnel_kernels().conductor_f32_in_double, constants_of(medium));
  }
}

void fresnel_conductor(std::span<const double> c, double eta, double k, std::span<double> f) {
  check(kEta, eta);
  check(kK, k);
  if (k < kLeastK) return fresnel_dielectric(c, eta, f);
  map_cosines(c, f, fresnel_kernels().conductor_f64, constants_of(make_medium(eta, k)));
}

void fresnel_schlick(std::span<const float> c, std::span<const float> r0, std::span<float> f) {
  check_each(kR0, r0, f);
  map_cosines_each(c, f, fresnel_kernels().schlick_each_f32, r0);
}

void fresnel_schlick(std::span<const double> c, std::span<const double> r0, std::span<double> f) {
  check_each(kR0, r0, f);
  map_cosines_each(c, f, fresnel_kernels().schlick_each_f64, r0);
}

void fresnel_dielectric(std::span<const float> c, std::span<const float> ior, std::span<float> f) {
  check_each(kIor, ior, f);
  map_cosines_each(c, f, fresnel_kernels().dielectric_each_f32, ior);
}

void fresnel_dielectric(std::span<const double> c, std::span<const double> ior, std::span<double> f) {
  check_each(kIor, ior, f);
  map_cosines_each(c, f, fresnel_kernels().dielectric_each_f64, ior);
}

void fresnel_conductor(std::span<const float> c, std::span<const float> eta, std::span<const float> k,
                       std::span<float> f) {
  check_each(kEta, eta, f);
  check_each(kK, k, f);
  map_cosines_each(c, f, fresnel_kernels().conductor_each_f32, eta, k);
}

void fresnel_conductor(std::span<const double> c, std::span<const double> eta, std::span<const double> k,
                       std::span<double> f) {
  check_each(kEta, eta, f);
  check_each(kK, k, f);
  map_cosines_each(c, f, fresnel_kernels().conductor_each_f64, eta, k);
}

glm::vec3 evaluate(const Fresnel& fresnel, float c) {
  glm::vec3 f(0.0F);
  for (int i = 0; i < 3; ++i) {
    switch (fresnel.model) {
      case FresnelModel::constant: f[i] = fresnel.r0[i]; break;
      case FresnelModel::schlick: f[i] = fresnel_schlick(c, fresnel.r0[i]); break;
      case FresnelModel::dielectric: f[i] = fresnel_dielectric(c, fresnel.eta[i]); break;
      case FresnelModel::conductor: f[i] = fresnel_conductor(c, fresnel.eta[i], fresnel.k[i]); break;
    }
  }
  return f;
}

void evaluate(const Fresnel& fresnel, std::span<const float> c, std::span<glm::vec3> f) {
  if (c.size() != f.size()) {
    throw InvalidArgument("c", std::to_string(c.size()) + " elements",
                          "as many as the output: " + std::to_string(f.size()));
  }
  constexpr std::size_t kBlock = 1024;  // a block of one channel stays in the first-level cache
  parallel_for(c.size(), kFresnelGrain, [&](std::size_t begin, std::size_t end) {
    std::array<float, kBlock> channel;
    for (std::size_t first = begin; first < end; first += kBlock) {
      const auto cosines = c.subspan(first, std::min(kBlock, end - first));
      const std::span<float> values(channel.data(), cosines.size());
      for (int i = 0; i < 3; ++i) {
        switch (fresnel.model) {
          case FresnelModel::constant: std::fill(values.begin(), values.end(), fresnel.r0[i]); break;
          case FresnelModel::schlick: fresnel_schlick(cosines, fresnel.r0[i], values); break;
          case FresnelModel::dielectric: fresnel_dielectric(cosines, fresnel.eta[i], values); break;
          case FresnelModel::conductor:
            fresnel_conductor(cosines, fresnel.eta[i], fresnel.k[i], values);
            break;
        }
        for (std::size_t j = 0; j < values.size(); ++j) f[first + j][i] = values[j];
      }
    }
  });
}

}  // namespace mirrorbake
