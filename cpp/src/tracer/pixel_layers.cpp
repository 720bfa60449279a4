#include "pixel_layers.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "mirrorbake/image/color.hpp"

namespace mirrorbake::tracing {
namespace {

// What is brighter than the display is clipped.
double displayed(double radiance) { return srgb_encode(static_cast<float>(std::clamp(radiance, 0.0, 1.0))); }

}  // namespace

void PixelLayers::plan(int samples) {
  assert(taken_ == 0 || samples % planned_ == 0);
  if (taken_ > 0) {
    // Whole quarters become parts of larger ones.
    const auto ratio = static_cast<std::size_t>(samples / planned_);
    std::array<Quarter, 4> larger;
    for (std::size_t q = 0; q < 4; ++q) {
      larger[q / ratio].beauty += quarters_[q].beauty;
      larger[q / ratio].covered += quarters_[q].covered;
    }
    quarters_ = larger;
  }
  planned_ = samples;
}

void PixelLayers::add(const Surface& s, glm::vec3 beauty, glm::vec3 body, const IncidentShells& incident,
                      glm::dvec3 position, std::uint16_t part) {
  Quarter& quarter = quarters_[static_cast<std::size_t>(4 * static_cast<std::int64_t>(taken_) / planned_)];
  quarter.beauty += beauty;
  ++quarter.covered;
  ++taken_;
  ++covered_;
  diffuse_ += body;
  fresnel_ += s.fresnel;
  for (std::size_t k = 0; k < shells_.size(); ++k) shells_[k] += incident.shells[k].radiance;
  const float distance = incident.shells[shells_.size() - 1].distance;
  if (std::isfinite(distance)) {
    distance_ += distance;
    ++finite_distances_;
  }
  reflection_ += s.reflection;
  normal_ += s.normal;
  position_ += position;
  parts_.push_back(part);
}

void PixelLayers::add_other(glm::vec3 beauty) {
  ++taken_;
  background_ += beauty;
}

double PixelLayers::display_variance() const {
  double sum = 0.0;
  for (int c = 0; c < 3; ++c) {
    double count = 0.0;
    double mean = 0.0;
    double squares = 0.0;
    for (const Quarter& q : quarters_) {
      if (q.covered == 0) continue;
      const double value = displayed(q.beauty[c] / q.covered);
      count += 1.0;
      mean += value;
      squares += value * value;
    }
    if (count < 2.0) return 0.0;
    mean /= count;
    sum += std::max(0.0, squares / count - mean * mean) / (count - 1.0);
  }
  return sum / 3.0;
}

void PixelLayers::write(float* out) const {
  const double share = covered_ > 0 ? 1.0 / covered_ : 0.0;
  const auto put = [&](const auto& sum, double scale) {
    for (int i = 0; i < sum.length(); ++i) *out++ = static_cast<float>(sum[i] * scale);
  };
  glm::dvec3 beauty(0.0);
  for (const Quarter& q : quarters_) beauty += q.beauty;
  put(beauty + background_, 1.0 / planned_);
  *out++ = static_cast<float>(covered_) / static_cast<float>(planned_);
  put(diffuse_, share);
  put(fresnel_, share);
  for (const glm::dvec4& shell : shells_) {
    if (&shell != &shells_.back()) {
      put(shell, share);
    } else {
      put(glm::dvec3(shell), share);
    }
  }
  *out++ = covered_ == 0            ? 0.0F
           : finite_distances_ == 0 ? std::numeric_limits<float>::infinity()
                                    : static_cast<float>(distance_ / finite_distances_);
  put(reflection_, share);
  put(normal_, share);
  put(position_, share);
  *out++ = static_cast<float>(most_frequent_part());
  glm::dvec3 incident(0.0);
  double transmittance = 1.0;
  for (const glm::dvec4& shell : shells_) {
    incident += transmittance * glm::dvec3(shell);
    transmittance *= 1.0 - shell.a * share;
  }
  put(beauty - (diffuse_ + fresnel_ * share * incident), share);
  put(background_, 1.0 / planned_);
}

int PixelLayers::most_frequent_part() const {
  std::vector<std::uint16_t> parts = parts_;
  std::sort(parts.begin(), parts.end());
  int best = -1;
  std::ptrdiff_t most = 0;
  for (auto p = parts.begin(); p != parts.end();) {
    const auto end = std::upper_bound(p, parts.end(), *p);
    if (end - p > most) {
      most = end - p;
      best = *p;
    }
    p = end;
  }
  return best;
}

std::vector<std::string> layer_channels(std::span<const ShellRule> shells) {
  std::vector<std::string> names{"R", "G", "B", "coverage"};
  const auto add = [&](const std::string& layer, const char* channels) {
    for (; *channels != 0; ++channels) names.push_back(layer + "." + *channels);
  };
  add("diffuse", "RGB");
  add("fresnel", "RGB");
  for (const ShellRule& shell : shells) {
    add("specular_" + shell.name, &shell == &shells.back() ? "RGB" : "RGBA");
  }
  names.emplace_back("distance");
  for (const char* layer : {"reflection", "normal", "position"}) add(layer, "XYZ");
  names.emplace_back("part");
  add("covariance", "RGB");
  add("background", "RGB");
  return names;
}

}  // namespace mirrorbake::tracing
