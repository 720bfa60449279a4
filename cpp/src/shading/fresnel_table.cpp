#include "mirrorbake/shading/fresnel_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "fresnel_batch.hpp"
#include "fresnel_formulas.hpp"
#include "fresnel_kernels.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kMaxSize = 65536;

// Between two entries the error is one bump, whose top is that of the parabola through the highest of this
// many samples and those beside it.
constexpr int kSamples = 24;

std::vector<float> tabulate(const ReflectanceFunction& reflectance, std::size_t size) {
  std::vector<float> values(size);
  for (std::size_t i = 0; i < size; ++i) {
    const double value = reflectance(static_cast<double>(i) / static_cast<double>(size - 1));
    if (!(value >= 0.0 && value <= 1.0)) {
      throw InvalidArgument("reflectance", text_of(value), "a function with values in [0,1]");
    }
    values[i] = static_cast<float>(value);
  }
  return values;
}

double top_of_bump(const std::array<double, kSamples + 1>& errors) {
  const auto highest = std::ranges::max_element(errors);
  if (highest == errors.begin() || highest + 1 == errors.end()) return *highest;
  const double before = *(highest - 1);
  const double after = *(highest + 1);
  const double curvature = before - 2.0 * *highest + after;
  if (!(curvature < 0.0)) return *highest;
  return *highest - (before - after) * (before - after) / (8.0 * curvature);
}

/// Largest error of the table, or the first one found above `limit`.
double error_of(const std::vector<float>& values, const ReflectanceFunction& reflectance, double limit) {
  const std::size_t intervals = values.size() - 1;
  std::array<double, kSamples + 1> errors{};
  double worst = 0;
  for (std::size_t i = 0; i < intervals && worst <= limit; ++i) {
    for (std::size_t sample = 0; sample < errors.size(); ++sample) {
      const double f = static_cast<double>(sample) / kSamples;
      const double value = values[i] + f * (static_cast<double>(values[i + 1]) - values[i]);
      const double c = (static_cast<double>(i) + f) / static_cast<double>(intervals);
      errors[sample] = std::abs(value - reflectance(c));
    }
    worst = std::max(worst, top_of_bump(errors));
  }
  return worst;
}

int checked_last(const FresnelTable& table) {
  if (table.values.size() < 2 || table.values.size() > kMaxSize) {
    throw InvalidArgument("table", std::to_string(table.values.size()) + " values", "2 to 65536");
  }
  return static_cast<int>(table.values.size()) - 1;
}

}  // namespace

ReflectanceFunction reflectance_function(const Fresnel& fresnel, int channel) {
  if (channel < 0 || channel > 2) throw InvalidArgument("channel", std::to_string(channel), "0, 1 or 2");
  const double r0 = fresnel.r0[channel];
  const double eta = fresnel.eta[channel];
  const double k = fresnel.k[channel];
  switch (fresnel.model) {
    case FresnelModel::constant: return [r0](double) { return r0; };
    case FresnelModel::schlick: return [r0](double c) { return fresnel_schlick(c, r0); };
    case FresnelModel::dielectric: return [eta](double c) { return fresnel_dielectric(c, eta); };
    case FresnelModel::conductor: return [eta, k](double c) { return fresnel_conductor(c, eta, k); };
  }
  throw InvalidArgument("model", std::to_string(static_cast<int>(fresnel.model)), "a Fresnel model");
}

FresnelTable make_table(const ReflectanceFunction& reflectance, std::size_t size) {
  if (size < 2 || size > kMaxSize) throw InvalidArgument("size", std::to_string(size), "2 to 65536 entries");
  FresnelTable table{tabulate(reflectance, size), 0.0};
  table.max_error = error_of(table.values, reflectance, 2.0);
  return table;
}

FresnelTable table_for_error(const ReflectanceFunction& reflectance, double max_error) {
  if (!(max_error >= 1e-6 && max_error <= 1.0)) {
    throw InvalidArgument("max_error", text_of(max_error), "1e-6 to 1");
  }
  const auto suffices = [&](std::size_t size) {
    return error_of(tabulate(reflectance, size), reflectance, max_error) <= max_error;
  };
  std::size_t size = 2;
  while (!suffices(size)) {
    if (size == kMaxSize) {
      std::ostringstream text;
      text << "max_error " << max_error << " needs a table of more than " << kMaxSize << " entries";
      throw NumericalError(text.str());
    }
    size *= 2;
  }
  // size/2 does not do, size does.
  std::size_t low = size / 2;
  while (size - low > 1) {
    const std::size_t middle = low + (size - low) / 2;
    (suffices(middle) ? size : low) = middle;
  }
  return make_table(reflectance, size);
}

float evaluate(const FresnelTable& table, float c) {
  return baseline::interpolate(baseline::clamp_cosine(c), table.values.data(), checked_last(table));
}

double evaluate(const FresnelTable& table, double c) {
  return baseline::interpolate(baseline::clamp_cosine(c), table.values.data(), checked_last(table));
}

void evaluate(const FresnelTable& table, std::span<const float> c, std::span<float> f) {
  checked_last(table);
  map_cosines(c, f, fresnel_kernels().table_f32, table.values.data(), table.values.size());
}

void evaluate(const FresnelTable& table, std::span<const double> c, std::span<double> f) {
  checked_last(table);
  map_cosines(c, f, fresnel_kernels().table_f64, table.values.data(), table.values.size());
}

}  // namespace mirrorbake
