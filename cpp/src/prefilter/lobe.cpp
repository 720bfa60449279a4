#include "mirrorbake/prefilter/lobe.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

constexpr double kPi = std::numbers::pi;

LobeDerivatives phong(double exponent, double half_versine) {
  const double c = 1.0 - 2.0 * half_versine;
  if (c <= 0.0) return {};
  // log1p keeps the digits of small angles.
  const double weight = std::exp(exponent * std::log1p(-2.0 * half_versine));
  return {weight, exponent * weight / c, exponent * (exponent - 1.0) * weight / (c * c)};
}

// With n = v, (n·h)² = (1 + cos γ)/2, and the denominator of D is α² + (1 − α²)(1 − cos γ)/2.
LobeDerivatives ggx(double alpha, double half_versine) {
  const double c = 1.0 - 2.0 * half_versine;
  if (c <= 0.0) return {};
  const double a = alpha * alpha;
  const double slope = 0.5 * (1.0 - a);
  const double w = a + (1.0 - a) * half_versine;
  const double d = a * a / (w * w);
  const double d1 = 2.0 * slope * d / w;
  const double d2 = 3.0 * slope * d1 / w;
  return {c * d, d + c * d1, 2.0 * d1 + c * d2};
}

// Slopes at the knots by Fritsch and Carlson, in the simple form of Butland: the harmonic mean of both sides.
double knot_slope(const std::vector<double>& values, std::size_t i) {
  if (i == 0 || i + 1 == values.size()) return 0.0;
  const double before = values[i] - values[i - 1];
  const double after = values[i + 1] - values[i];
  return before * after > 0.0 ? 2.0 * before * after / (before + after) : 0.0;
}

LobeDerivatives from_table(const Lobe& lobe, double sine_of_half) {
  const double angle = 2.0 * std::asin(std::clamp(sine_of_half, 0.0, 1.0));
  const double step =
      lobe.table_angle * (kPi / 180.0) / static_cast<double>(std::max<std::size_t>(lobe.table.size() - 1, 1));
  const double position = angle / step;
  if (lobe.table.size() == 1) return {position <= 1.0 ? lobe.table[0] : 0.0, 0.0, 0.0};
  if (position > static_cast<double>(lobe.table.size() - 1)) return {};
  const std::size_t i = std::min(static_cast<std::size_t>(position), lobe.table.size() - 2);
  const double t = position - static_cast<double>(i);
  const double m0 = knot_slope(lobe.table, i);
  const double m1 = knot_slope(lobe.table, i + 1);
  const double rise = lobe.table[i + 1] - lobe.table[i];
  const double c2 = 3.0 * rise - 2.0 * m0 - m1;
  const double c3 = m0 + m1 - 2.0 * rise;
  const double value = lobe.table[i] + t * (m0 + t * (c2 + t * c3));
  const double slope = (m0 + t * (2.0 * c2 + t * 3.0 * c3)) / step;
  const double bend = (2.0 * c2 + 6.0 * t * c3) / (step * step);
  // d/dc = −1/sin γ d/dγ. Flat at 0, where both forms are 0/0: there the first derivative is −k″(γ).
  const double s = std::sin(angle);
  if (s < 1e-4) return {value, -bend, 0.0};
  return {value, -slope / s, (bend - slope * std::cos(angle) / s) / (s * s)};
}

}  // namespace

Lobe make_lobe(LobeKind kind, double parameter, std::vector<double> table) {
  Lobe lobe{kind};
  switch (kind) {
    case LobeKind::lambert: break;
    case LobeKind::phong: lobe.exponent = parameter; break;
    case LobeKind::ggx: lobe.alpha = parameter; break;
    case LobeKind::table: lobe.table_angle = parameter; break;
  }
  lobe.table = std::move(table);
  validate(lobe);
  return lobe;
}

void validate(const Lobe& lobe) {
  switch (lobe.kind) {
    case LobeKind::lambert: return;
    case LobeKind::phong:
      if (std::isinf(lobe.exponent) && lobe.exponent > 0.0) return;
      if (!(lobe.exponent >= 1.0 && lobe.exponent <= 1e6)) {
        throw InvalidArgument("exponent", text_of(lobe.exponent), "1 to 1e6, or infinity for a mirror");
      }
      return;
    case LobeKind::ggx:
      if (lobe.alpha != 0.0 && !(lobe.alpha >= 0.01 && lobe.alpha <= 1.0)) {
        throw InvalidArgument("alpha", text_of(lobe.alpha), "0.01 to 1, or 0 for a mirror");
      }
      return;
    case LobeKind::table: {
      check_range("table", lobe.table.size(), std::size_t{1}, std::size_t{1} << 20U, " values");
      check_above("table_angle", lobe.table_angle, 0.0, 180.0);
      double largest = 0.0;
      for (std::size_t i = 0; i < lobe.table.size(); ++i) {
        check_at_least("table[" + std::to_string(i) + "]", lobe.table[i], 0.0);
        largest = std::max(largest, lobe.table[i]);
      }
      if (largest == 0.0) throw InvalidArgument("table", "all 0", "a weight above 0");
      return;
    }
  }
}

bool is_mirror(const Lobe& lobe) {
  return (lobe.kind == LobeKind::phong && std::isinf(lobe.exponent)) ||
         (lobe.kind == LobeKind::ggx && lobe.alpha == 0.0);
}

LobeDerivatives lobe_derivatives(const Lobe& lobe, double sine_of_half) {
  const double half_versine = sine_of_half * sine_of_half;
  switch (lobe.kind) {
    case LobeKind::lambert: return phong(1.0, half_versine);
    case LobeKind::phong: return phong(lobe.exponent, half_versine);
    case LobeKind::ggx: return ggx(lobe.alpha, half_versine);
    case LobeKind::table: return from_table(lobe, sine_of_half);
  }
  return {};
}

double lobe_weight(const Lobe& lobe, double cosine) {
  if (is_mirror(lobe)) return cosine >= 1.0 ? 1.0 : 0.0;
  return lobe_derivatives(lobe, std::sqrt(std::max(0.0, 0.5 * (1.0 - cosine)))).weight;
}

double lobe_integral(const Lobe& lobe) {
  validate(lobe);
  if (is_mirror(lobe)) return 0.0;
  if (lobe.kind == LobeKind::lambert) return kPi;
  if (lobe.kind == LobeKind::phong) return 2.0 * kPi / (lobe.exponent + 1.0);
  // ∫ k 2π dc with c = 1 − 2 s²: by Gauss's rule of three points on steps that are short where s is.
  constexpr int kSteps = 4096;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double low = std::pow(static_cast<double>(i) / kSteps, 2.0);
    const double high = std::pow(static_cast<double>(i + 1) / kSteps, 2.0);
    const double middle = 0.5 * (low + high);
    const double reach = 0.5 * (high - low);
    for (const int side : {-1, 0, 1}) {
      const double s = middle + side * std::sqrt(0.6) * reach;
      sum += (side == 0 ? 8.0 / 9.0 : 5.0 / 9.0) * reach * lobe_derivatives(lobe, s).weight * 8.0 * kPi * s;
    }
  }
  return sum;
}

double alpha_from_exponent(double exponent) { return std::sqrt(2.0 / (exponent + 2.0)); }
double exponent_from_alpha(double alpha) { return 2.0 / (alpha * alpha) - 2.0; }

}  // namespace mirrorbake
