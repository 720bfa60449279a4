#include "mirrorbake/prefilter/split_sum.hpp"

#include <cmath>
#include <numbers>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {

// ∫ D F V (n·l) dl with normals drawn in proportion to D (n·h), at the middles of equal cells: tan² θ_h = α²
// u/(1 − u). The integrand is smooth and periodic in the azimuth, of which half is enough.
SplitSum split_sum(double cosine, double alpha) {
  check_above("cosine", cosine, 0.0, 1.0);
  check_above("alpha", alpha, 0.0, 1.0);
  constexpr int kPolar = 96;
  constexpr int kAzimuth = 24;
  const double sine = std::sqrt(1.0 - cosine * cosine);
  const double a2 = alpha * alpha;
  SplitSum sum;
  for (int i = 0; i < kPolar; ++i) {
    // Steps that are short at both ends, where tails and grazing light are.
    const double s = (i + 0.5) / kPolar;
    const double u = s * s * (3.0 - 2.0 * s);
    const double weight = 6.0 * s * (1.0 - s) / (kPolar * kAzimuth);
    const double cos_h = std::sqrt((1.0 - u) / (1.0 + (a2 - 1.0) * u));
    const double sin_h = std::sqrt(std::max(0.0, 1.0 - cos_h * cos_h));
    for (int k = 0; k < kAzimuth; ++k) {
      const double v_h = sin_h * std::cos(std::numbers::pi * (k + 0.5) / kAzimuth) * sine + cos_h * cosine;
      const double n_l = 2.0 * v_h * cos_h - cosine;
      if (!(n_l > 0.0 && v_h > 0.0)) continue;
      // V = G/(4 n·l n·v), and what is drawn has the density D (n·h)/(4 v·h).
      const double visible = 0.5 / (n_l * std::sqrt(cosine * cosine * (1.0 - a2) + a2) +
                                    cosine * std::sqrt(n_l * n_l * (1.0 - a2) + a2));
      const double reflected = 4.0 * n_l * visible * v_h / cos_h * weight;
      const double grazing = 1.0 - v_h;
      const double fresnel = grazing * grazing * grazing * grazing * grazing;
      sum.scale += (1.0 - fresnel) * reflected;
      sum.bias += fresnel * reflected;
    }
  }
  return sum;
}

std::vector<float> split_sum_table(int size, RoughnessScale roughness) {
  check_range("size", size, 1, 4096, " texels");
  const std::size_t n = static_cast<std::size_t>(size);
  std::vector<float> table(n * n * 3);
  parallel_for(n * n, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t row = i / n;
      const double rough = (static_cast<double>(row) + 0.5) / size;
      const SplitSum sum = split_sum((static_cast<double>(i % n) + 0.5) / size,
                                     roughness == RoughnessScale::squared ? rough * rough : rough);
      table[3 * i] = static_cast<float>(sum.scale);
      table[3 * i + 1] = static_cast<float>(sum.bias);
      table[3 * i + 2] = static_cast<float>(sum.scale + sum.bias);
    }
  });
  return table;
}

}  // namespace mirrorbake
