#include "mirrorbake/shading/metals.hpp"

#include <glm/common.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "spectral_tables.hpp"

namespace mirrorbake {
namespace {

struct MetalData {
  Metal metal;
  std::string_view name;
  std::string_view symbol;
  OpticalConstants constants;
};

constexpr MetalData kMetals[] = {
    {Metal::aluminium, "aluminium", "Al", {kAluminium, kRakic1995}},
    {Metal::silver, "silver", "Ag", {kSilver, kJohnsonChristy1972}},
    {Metal::gold, "gold", "Au", {kGold, kJohnsonChristy1972}},
    {Metal::copper, "copper", "Cu", {kCopper, kJohnsonChristy1972}},
    {Metal::chromium, "chromium", "Cr", {kChromium, kJohnsonChristy1974}},
    {Metal::titanium, "titanium", "Ti", {kTitanium, kJohnsonChristy1974}},
};

constexpr Metal kAll[] = {Metal::aluminium, Metal::silver,   Metal::gold,
                          Metal::copper,    Metal::chromium, Metal::titanium};

const MetalData& data_of(Metal metal) {
  const auto index = static_cast<std::size_t>(metal);
  if (index >= std::size(kMetals))
    throw InvalidArgument("metal", std::to_string(index), "a value of the enum");
  return kMetals[index];
}

// IEC 61966-2-1, from XYZ with the white of D65 at Y = 1.
constexpr glm::dmat3 kRec709FromXyz = {
    {3.2406, -0.9689, 0.0557}, {-1.5372, 1.8758, -0.2040}, {-0.4986, 0.0415, 1.0570}};

/// What one wavelength contributes to R, G and B, with Σ = (1, 1, 1): a perfect mirror is white.
std::vector<glm::dvec3> rgb_weights(Illuminant illuminant) {
  std::vector<glm::dvec3> weights;
  glm::dvec3 sum(0.0);
  for (const ColorimetricEntry& entry : kColorimetry) {
    const double power = illuminant == Illuminant::d65 ? entry.d65 : 1.0;
    weights.push_back(kRec709FromXyz * (power * glm::dvec3(entry.x, entry.y, entry.z)));
    sum += weights.back();
  }
  for (glm::dvec3& weight : weights) weight /= sum;
  return weights;
}

OpticalConstants::Entry interpolate(const OpticalConstants& constants, double wavelength) {
  const auto next = std::upper_bound(
      constants.entries.begin() + 1, constants.entries.end() - 1, wavelength,
      [](double value, const OpticalConstants::Entry& entry) { return value < entry.wavelength; });
  const OpticalConstants::Entry& b = *next;
  const OpticalConstants::Entry& a = *(next - 1);
  const double t = (wavelength - a.wavelength) / (b.wavelength - a.wavelength);
  return {wavelength, std::lerp(a.eta, b.eta, t), std::lerp(a.k, b.k, t)};
}

/// Cosines of the fits: midpoints, so that grazing incidence, where every model is 1, has no special weight.
constexpr int kFitCount = 128;
double fit_cosine(int i) { return (i + 0.5) / kFitCount; }

using Curve = std::array<double, kFitCount>;

/// Least squares for r0 in F = w + r0 (1 − w), w = (1 − c)⁵.
double fit_schlick(const Curve& target) {
  double numerator = 0;
  double denominator = 0;
  for (int i = 0; i < kFitCount; ++i) {
    const double w = fresnel_schlick(fit_cosine(i), 0.0);
    numerator += (1 - w) * (target[i] - w);
    denominator += (1 - w) * (1 - w);
  }
  return std::clamp(numerator / denominator, 0.0, 1.0);
}

// Bounds of the effective index: with both at their ends F is above 0.999 throughout, for a target above 1.
constexpr double kLeastIndex = 0.01;
constexpr double kLargestIndex = 20.0;

struct Index {
  double eta;
  double k;
};

double squared_error(const Curve& target, Index index) {
  double sum = 0;
  for (int i = 0; i < kFitCount; ++i) {
    const double difference = fresnel_conductor(fit_cosine(i), index.eta, index.k) - target[i];
    sum += difference * difference;
  }
  return sum;
}

/// Least squares for η and k by pattern search in their logarithms: two unknowns, and a valley too curved for
/// Gauss–Newton steps where the target exceeds 1.
Index fit_conductor(const Curve& target, Index start) {
  Index best = start;
  double least = squared_error(target, best);
  double step = 0.5;
  while (step > 1e-7) {
    bool improved = false;
    for (const auto& [along_eta, along_k] :
         {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}) {
      const Index candidate = {std::clamp(best.eta * std::exp(step * along_eta), kLeastIndex, kLargestIndex),
                               std::clamp(best.k * std::exp(step * along_k), kLeastIndex, kLargestIndex)};
      const double error = squared_error(target, candidate);
      if (error < least) {
        best = candidate;
        least = error;
        improved = true;
      }
    }
    if (!improved) step *= 0.5;
  }
  return best;
}

}  // namespace

std::string_view to_string(Metal metal) { return data_of(metal).name; }

Metal parse_metal(std::string_view name) {
  for (const MetalData& data : kMetals) {
    if (name == data.name || name == data.symbol) return data.metal;
  }
  throw InvalidArgument("metal", name, "aluminium, silver, gold, copper, chromium or titanium");
}

std::span<const Metal> all_metals() { return kAll; }

OpticalConstants optical_constants(Metal metal) { return data_of(metal).constants; }

glm::dvec3 metal_reflectance(Metal metal, double c, Illuminant illuminant) {
  static const std::array<std::vector<glm::dvec3>, 2> weights = {rgb_weights(Illuminant::d65),
                                                                 rgb_weights(Illuminant::e)};
  const OpticalConstants& constants = data_of(metal).constants;
  glm::dvec3 rgb(0.0);
  for (std::size_t i = 0; i < std::size(kColorimetry); ++i) {
    const OpticalConstants::Entry index = interpolate(constants, kColorimetry[i].wavelength);
    rgb += fresnel_conductor(c, index.eta, index.k) * weights[static_cast<std::size_t>(illuminant)][i];
  }
  return rgb;
}

MetalFit fit_metal(Metal metal, Illuminant illuminant) {
  std::array<Curve, 3> curves{};
  for (int i = 0; i < kFitCount; ++i) {
    const glm::dvec3 rgb = metal_reflectance(metal, fit_cosine(i), illuminant);
    for (int channel = 0; channel < 3; ++channel) curves[channel][i] = rgb[channel];
  }
  MetalFit fit;
  fit.schlick.model = FresnelModel::schlick;
  fit.conductor.model = FresnelModel::conductor;
  constexpr double kDominant[] = {610.0, 550.0, 465.0};  // nm, near the primaries: a start
  for (int channel = 0; channel < 3; ++channel) {
    const OpticalConstants::Entry start = interpolate(data_of(metal).constants, kDominant[channel]);
    const Index index = fit_conductor(curves[channel], {start.eta, start.k});
    fit.schlick.r0[channel] = static_cast<float>(fit_schlick(curves[channel]));
    fit.conductor.eta[channel] = static_cast<float>(index.eta);
    fit.conductor.k[channel] = static_cast<float>(index.k);
  }
  constexpr int kChecks = 1024;
  for (int i = 0; i <= kChecks; ++i) {
    const double c = static_cast<double>(i) / kChecks;
    const glm::dvec3 exact = metal_reflectance(metal, c, illuminant);
    const glm::dvec3 schlick(evaluate(fit.schlick, static_cast<float>(c)));
    const glm::dvec3 conductor(evaluate(fit.conductor, static_cast<float>(c)));
    fit.schlick_error = glm::max(fit.schlick_error, glm::abs(schlick - exact));
    fit.conductor_error = glm::max(fit.conductor_error, glm::abs(conductor - exact));
  }
  return fit;
}

}  // namespace mirrorbake
