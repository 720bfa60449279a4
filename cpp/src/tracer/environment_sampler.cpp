#include "environment_sampler.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <glm/geometric.hpp>

#include "cdf.hpp"
#include "mirrorbake/core/bilinear.hpp"
#include "surface.hpp"

namespace mirrorbake::tracing {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

}  // namespace

EnvironmentSampler::EnvironmentSampler(const EnvironmentLight& light)
    : panorama_(&light.panorama), scale_(light.scale) {
  const double angle = static_cast<double>(light.rotation_degrees) * std::numbers::pi / 180.0;
  cosine_ = static_cast<float>(std::cos(angle));
  sine_ = static_cast<float>(std::sin(angle));

  const int width = panorama_->width;
  const int height = panorama_->height;
  const auto value = [&](int x, int y) {
    const float* p = panorama_->at((x + width) % width, std::clamp(y, 0, height - 1));
    return static_cast<double>(scale_) * static_cast<double>(luminance({p[0], p[1], p[2]}));
  };
  const auto w = static_cast<std::size_t>(width);
  for (int y = 0; y <= height; ++y) row_cosine_.push_back(std::cos(std::numbers::pi * y / height));
  std::vector<float> means(w * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    // Mean of the bilinear interpolant over the texel: weights 1/8, 3/4, 1/8 each way. The density by
    // luminance is positive wherever the radiance is.
    for (int x = 0; x < width; ++x) {
      double mean = 0.0;
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          mean += (i == 0 ? 0.75 : 0.125) * (j == 0 ? 0.75 : 0.125) * value(x + i, y + j);
        }
      }
      means[static_cast<std::size_t>(y) * w + static_cast<std::size_t>(x)] = static_cast<float>(mean);
    }
  }
  by_luminance_ = distribution(means, 0.0);
  by_excess_ = distribution(means, by_luminance_.flux / (4.0 * std::numbers::pi));
  if (!(by_excess_.flux > 0.0)) by_excess_ = by_luminance_;  // an even sky
}

EnvironmentSampler::Distribution EnvironmentSampler::distribution(const std::vector<float>& luminance,
                                                                  double threshold) const {
  const auto width = static_cast<std::size_t>(panorama_->width);
  const auto height = static_cast<std::size_t>(panorama_->height);
  Distribution d;
  d.row_cdf.resize(height + 1);
  d.column_cdf.resize(height * (width + 1));
  std::vector<double> row_sums(height);
  std::vector<double> row(width);
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      row[x] = std::max(0.0, static_cast<double>(luminance[y * width + x]) - threshold);
    }
    const double sum = normalise_cdf(&d.column_cdf[y * (width + 1)], row.data(), panorama_->width);
    row_sums[y] = sum * (row_cosine_[y] - row_cosine_[y + 1]) * 2.0 * std::numbers::pi / panorama_->width;
  }
  d.flux = normalise_cdf(d.row_cdf.data(), row_sums.data(), panorama_->height);
  return d;
}

glm::vec3 EnvironmentSampler::radiance(glm::vec2 uv) const {
  const int width = panorama_->width;
  const int height = panorama_->height;
  const BilinearCell<float> cell =
      bilinear_cell(uv.x * static_cast<float>(width), uv.y * static_cast<float>(height));
  const int x = cell.column;
  const int y = cell.row;
  const auto texel = [&](int i, int j) {
    if (i < 0) i += width;
    if (i >= width) i -= width;
    const float* p = panorama_->at(i, std::clamp(j, 0, height - 1));
    return glm::vec3(p[0], p[1], p[2]);
  };
  return scale_ * cell.mix(texel(x, y), texel(x + 1, y), texel(x, y + 1), texel(x + 1, y + 1));
}

float EnvironmentSampler::pdf(const Distribution& d, int x, int y) const {
  const auto edge = static_cast<std::size_t>(y);
  const int width = panorama_->width;
  const float* row = &d.column_cdf[edge * (static_cast<std::size_t>(width) + 1)];
  const float probability = (d.row_cdf[edge + 1] - d.row_cdf[edge]) * (row[x + 1] - row[x]);
  // Samples are uniform in solid angle within a texel.
  const double solid_angle = (row_cosine_[edge] - row_cosine_[edge + 1]) * 2.0 * std::numbers::pi / width;
  return static_cast<float>(probability / solid_angle);
}

EnvironmentSampler::Found EnvironmentSampler::find(glm::vec3 direction, bool shared) const {
  // Undo the rotation about +Y, then: the centre is −Z, +X to its right.
  const float x = cosine_ * direction.x - sine_ * direction.z;
  const float z = sine_ * direction.x + cosine_ * direction.z;
  // acos(y) loses half its digits at the poles.
  const glm::vec2 uv(std::clamp(0.5F + std::atan2(x, -z) / (2.0F * kPi), 0.0F, 1.0F),
                     std::clamp(std::atan2(std::sqrt(x * x + z * z), direction.y) / kPi, 0.0F, 1.0F));
  const int width = panorama_->width;
  const int height = panorama_->height;
  return {radiance(uv), pdf(shared ? by_excess_ : by_luminance_,
                            std::min(static_cast<int>(uv.x * static_cast<float>(width)), width - 1),
                            std::min(static_cast<int>(uv.y * static_cast<float>(height)), height - 1))};
}

EnvironmentSampler::Sample EnvironmentSampler::sample(glm::vec2 u, bool shared) const {
  const Distribution& d = shared ? by_excess_ : by_luminance_;
  const int width = panorama_->width;
  const int height = panorama_->height;
  const CdfSample row = sample_cdf(d.row_cdf.data(), height, u.y);
  const auto edge = static_cast<std::size_t>(row.index);
  const CdfSample column =
      sample_cdf(&d.column_cdf[edge * (static_cast<std::size_t>(width) + 1)], width, u.x);
  const float across = (static_cast<float>(column.index) + column.place) / static_cast<float>(width);
  const double y = row_cosine_[edge] + row.place * (row_cosine_[edge + 1] - row_cosine_[edge]);
  const auto radius = static_cast<float>(std::sqrt(std::max(0.0, (1.0 - y) * (1.0 + y))));
  const float azimuth = 2.0F * kPi * (across - 0.5F);
  const float x = radius * std::sin(azimuth);
  const float z = -radius * std::cos(azimuth);
  const glm::vec3 direction(cosine_ * x + sine_ * z, y, -sine_ * x + cosine_ * z);
  const glm::vec2 uv(across, std::atan2(radius, direction.y) / kPi);
  return {glm::normalize(direction), {radiance(uv), pdf(d, column.index, row.index)}};
}

}  // namespace mirrorbake::tracing
