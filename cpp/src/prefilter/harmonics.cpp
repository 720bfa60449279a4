#include "mirrorbake/prefilter/harmonics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <glm/geometric.hpp>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "source_texels.hpp"

namespace mirrorbake {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kMost = (Harmonics::kLargestOrder + 1) * (Harmonics::kLargestOrder + 1);

std::size_t basis_size(int order) {
  return static_cast<std::size_t>(order + 1) * static_cast<std::size_t>(order + 1);
}

int band_of(std::size_t index) { return static_cast<int>(std::sqrt(static_cast<double>(index) + 0.5)); }

// Smallest value on a grid of directions fine enough for order 8, and in which channel does not matter.
double least_value(const Harmonics& h) {
  constexpr int kRows = 64;
  double least = std::numeric_limits<double>::infinity();
  std::array<double, kMost> basis{};
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < 2 * kRows; ++column) {
      harmonic_basis(direction_from_point({ProjectionKind::latlong}, 0, column_center(column, 2 * kRows),
                                          row_center(row, kRows)),
                     h.order, basis);
      for (std::size_t c = 0; c < static_cast<std::size_t>(h.channels); ++c) {
        double value = 0.0;
        for (std::size_t i = 0; i < basis_size(h.order); ++i) {
          value += h.coefficients[i * static_cast<std::size_t>(h.channels) + c] * basis[i];
        }
        least = std::min(least, value);
      }
    }
  }
  return least;
}

template <typename Factor>
Harmonics scaled(const Harmonics& harmonics, const Factor& factor) {
  Harmonics result = harmonics;
  const std::size_t channels = static_cast<std::size_t>(harmonics.channels);
  for (std::size_t i = 0; i < result.coefficients.size(); ++i) {
    result.coefficients[i] *= factor(band_of(i / channels));
  }
  return result;
}

}  // namespace

void validate(const Harmonics& h) {
  check_range("order", h.order, 0, Harmonics::kLargestOrder);
  check_range("channels", h.channels, 1, 1024);
  check_length("coefficients", h.coefficients.size(),
               basis_size(h.order) * static_cast<std::size_t>(h.channels), "(order + 1)² × channels");
}

// The associated Legendre functions divided by sin^m θ are polynomials of z, and sin^m θ cos mφ, sin^m θ sin
// mφ those of x and y: Sloan, "Efficient Spherical Harmonic Evaluation", JCGT 2013.
void harmonic_basis(const glm::dvec3& d, int order, std::span<double> values) {
  check_range("order", order, 0, Harmonics::kLargestOrder);
  double cosine = 1.0;  // sin^m θ cos mφ
  double sine = 0.0;
  double diagonal = std::sqrt(0.25 / kPi);  // normalised P(m, m) / sin^m θ
  for (int m = 0; m <= order; ++m) {
    if (m > 0) {
      const double next = cosine * d.x - sine * d.y;
      sine = cosine * d.y + sine * d.x;
      cosine = next;
      diagonal *= std::sqrt((2.0 * m + 1.0) / (2.0 * m));
    }
    double before = 0.0;
    double p = diagonal;
    for (int l = m; l <= order; ++l) {
      if (l > m) {
        const double ll = static_cast<double>(l) * l;
        const double mm = static_cast<double>(m) * m;
        const double a = std::sqrt((4.0 * ll - 1.0) / (ll - mm));
        const double previous = static_cast<double>(l - 1) * (l - 1);
        const double b = l - 1 > m ? std::sqrt((previous - mm) / (4.0 * previous - 1.0)) : 0.0;
        const double next = a * (d.z * p - b * before);
        before = p;
        p = next;
      }
      const std::size_t center = static_cast<std::size_t>(l * l + l);
      const std::size_t offset = static_cast<std::size_t>(m);
      if (m == 0) {
        values[center] = p;
      } else {
        values[center + offset] = std::numbers::sqrt2 * p * cosine;
        values[center - offset] = std::numbers::sqrt2 * p * sine;
      }
    }
  }
}

Harmonics project_harmonics(const EnvMapView& map, int order) {
  validate(map);
  check_range("order", order, 0, Harmonics::kLargestOrder);
  const std::size_t bad = count_not_finite(map);
  if (bad > 0) {
    throw InvalidArgument("map", std::to_string(bad) + " NaN or infinite values", "finite values");
  }
  const std::size_t channels = static_cast<std::size_t>(map.layout.channels);
  const std::size_t count = basis_size(order);
  // Texels of small maps are cut up, as for cosine lobes.
  const SourceTexels texels(map.layout, parts_for_width(map.layout, 0.25));
  const std::size_t rows =
      static_cast<std::size_t>(face_count(map.layout.projection)) * static_cast<std::size_t>(texels.height());
  constexpr std::size_t kRows = 16;
  std::vector<std::vector<double>> parts((rows + kRows - 1) / kRows);
  parallel_for(rows, kRows, [&](std::size_t begin, std::size_t end) {
    std::vector<double>& sums = parts[begin / kRows];
    sums.assign(count * channels, 0.0);
    std::array<double, kMost> basis{};
    for (std::size_t line = begin; line < end; ++line) {
      const int face = static_cast<int>(line) / texels.height();
      const int row = static_cast<int>(line) % texels.height();
      const float* values = map.values.data() + map.layout.index(0, face, row / texels.parts(), 0);
      for (int column = 0; column < texels.width(); ++column) {
        const double angle = texels.solid_angle(row, column);
        if (!(angle > 0.0)) continue;
        harmonic_basis(texels.direction(face, row, column), order, basis);
        const float* texel = values + static_cast<std::size_t>(column / texels.parts()) * channels;
        for (std::size_t i = 0; i < count; ++i) {
          for (std::size_t c = 0; c < channels; ++c) {
            sums[i * channels + c] += angle * basis[i] * static_cast<double>(texel[c]);
          }
        }
      }
    }
  });
  Harmonics result{order, map.layout.channels, std::vector<double>(count * channels)};
  for (const std::vector<double>& part : parts) {
    for (std::size_t i = 0; i < part.size(); ++i) result.coefficients[i] += part[i];
  }
  return result;
}

double lambert_factor(int band) {
  if (band == 0) return kPi;
  if (band == 1) return 2.0 * kPi / 3.0;
  if (band % 2 == 1) return 0.0;
  // 2π (−1)^(l/2 − 1) l! / ((l + 2)(l − 1) 2^l (l/2)!²): Ramamoorthi and Hanrahan, JOSA A 2001, eq. 19.
  double central = 1.0;  // l! / (2^l (l/2)!²) = Π (2k − 1)/(2k)
  for (int k = 1; k <= band / 2; ++k) central *= (2.0 * k - 1.0) / (2.0 * k);
  return (band / 2 % 2 == 1 ? 2.0 : -2.0) * kPi * central / ((band + 2.0) * (band - 1.0));
}

Harmonics lambert_harmonics(const Harmonics& radiance) {
  validate(radiance);
  return scaled(radiance, lambert_factor);
}

Harmonics windowed(const Harmonics& harmonics, HarmonicWindow window) {
  validate(harmonics);
  if (window == HarmonicWindow::none) return harmonics;
  if (window == HarmonicWindow::hanning) {
    return scaled(harmonics,
                  [&](int band) { return 0.5 * (1.0 + std::cos(kPi * band / (harmonics.order + 1.0))); });
  }
  const auto damped = [&](double strength) {
    return scaled(harmonics, [&](int band) {
      const double laplacian = static_cast<double>(band) * (band + 1.0);
      return 1.0 / (1.0 + strength * laplacian * laplacian);
    });
  };
  if (least_value(harmonics) >= 0.0) return harmonics;
  // By bisection of log λ. A mean below 0 cannot be helped.
  double low = 1e-6;
  double high = 1e6;
  for (int i = 0; i < 48; ++i) {
    const double middle = std::sqrt(low * high);
    (least_value(damped(middle)) >= 0.0 ? high : low) = middle;
  }
  return damped(high);
}

EnvMap evaluate_harmonics(const Harmonics& h, const PrefilterTarget& target, NegativeLight negative) {
  validate(h);
  EnvMap result = make_envmap({target.projection, target.width, target.height, 1, h.channels});
  const std::size_t channels = static_cast<std::size_t>(h.channels);
  const std::size_t width = static_cast<std::size_t>(target.width);
  const std::size_t height = static_cast<std::size_t>(target.height);
  parallel_for(result.layout.level_texels(0), 1024, [&](std::size_t begin, std::size_t end) {
    std::array<double, kMost> basis{};
    for (std::size_t texel = begin; texel < end; ++texel) {
      harmonic_basis(
          direction_from_point(target.projection, static_cast<int>(texel / (width * height)),
                               column_center(static_cast<int>(texel % width), target.width),
                               row_center(static_cast<int>(texel / width % height), target.height)),
          h.order, basis);
      for (std::size_t c = 0; c < channels; ++c) {
        double value = 0.0;
        for (std::size_t i = 0; i < basis_size(h.order); ++i)
          value += h.coefficients[i * channels + c] * basis[i];
        if (negative == NegativeLight::clamp) value = std::max(value, 0.0);
        result.values[texel * channels + c] = static_cast<float>(value);
      }
    }
  });
  return result;
}

std::vector<double> shader_constants(const Harmonics& radiance) {
  validate(radiance);
  check_range("order", radiance.order, 2, Harmonics::kLargestOrder);
  // The factors before the polynomials of [AEM] eq. 9.
  const double linear = std::sqrt(3.0 / (4.0 * kPi));
  const double product = std::sqrt(15.0 / (4.0 * kPi));
  const std::array<double, 9> factors{std::sqrt(0.25 / kPi),
                                      linear,
                                      linear,
                                      linear,
                                      product,
                                      product,
                                      std::sqrt(5.0 / (16.0 * kPi)),
                                      product,
                                      std::sqrt(15.0 / (16.0 * kPi))};
  const std::size_t channels = static_cast<std::size_t>(radiance.channels);
  std::vector<double> constants(9 * channels);
  for (std::size_t i = 0; i < 9; ++i) {
    for (std::size_t c = 0; c < channels; ++c) {
      constants[i * channels + c] =
          radiance.coefficients[i * channels + c] * lambert_factor(band_of(i)) / kPi * factors[i];
    }
  }
  return constants;
}

}  // namespace mirrorbake
