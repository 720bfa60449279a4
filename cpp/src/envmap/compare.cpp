#include "mirrorbake/envmap/compare.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {

Comparison compare(const EnvMapView& a, const EnvMapView& b) {
  validate(a);
  validate(b);
  const EnvMapLayout& layout = a.layout;
  if (layout.projection != b.layout.projection || layout.width != b.layout.width ||
      layout.height != b.layout.height || layout.channels != b.layout.channels) {
    const auto text = [](const EnvMapLayout& l) {
      return to_string(l.projection) + " of " + std::to_string(l.width) + " x " + std::to_string(l.height) +
             " x " + std::to_string(l.channels);
    };
    throw InvalidArgument("a", text(layout), "like b: " + text(b.layout));
  }
  const std::vector<double> angles = texel_solid_angles(layout.projection, layout.width, layout.height);
  const std::span<const float> values_a = a.level(0);
  const std::span<const float> values_b = b.level(0);
  const std::size_t channels = static_cast<std::size_t>(layout.channels);
  Comparison result;
  double weight = 0.0;
  double squares = 0.0;
  double reference = 0.0;
  double largest = 0.0;
  double flux_a = 0.0;
  double flux_b = 0.0;
  for (std::size_t i = 0; i < values_a.size(); ++i) {
    const double va = static_cast<double>(values_a[i]);
    const double vb = static_cast<double>(values_b[i]);
    if (!std::isfinite(va) || !std::isfinite(vb)) {
      ++result.not_finite;
      continue;
    }
    const double angle = angles[i / channels % angles.size()];
    if (angle <= 0.0) continue;
    const double error = std::abs(va - vb);
    result.max_error = std::max(result.max_error, error);
    result.mean_error += angle * error;
    squares += angle * error * error;
    reference += angle * vb * vb;
    largest = std::max(largest, std::abs(vb));
    weight += angle;
    flux_a += angle * va;
    flux_b += angle * vb;
  }
  if (weight > 0.0) {
    result.mean_error /= weight;
    result.rms_error = std::sqrt(squares / weight);
  }
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  result.relative_l2 = squares == 0.0 ? 0.0 : reference > 0.0 ? std::sqrt(squares / reference) : kInfinite;
  result.psnr = squares == 0.0 ? kInfinite : 20.0 * std::log10(largest / result.rms_error);
  result.flux_ratio = flux_a == flux_b ? 1.0 : flux_a / flux_b;
  return result;
}

}  // namespace mirrorbake
