#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <glm/geometric.hpp>

#include "cdf.hpp"
#include "lights.hpp"

/// Which lights next-event estimation takes, and how often.
namespace mirrorbake::tracing {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// Shadows are not foreseen: a share of the picks goes to all lights alike that can be seen at all.
constexpr float kEqualShare = 0.2F;

LightSample over(LightSample sample, float mean_samples) {
  sample.radiance /= mean_samples;
  sample.pdf *= mean_samples;
  return sample;
}

// No more than at the light's rim, where the square of the distance no longer tells.
float over_square(glm::vec3 from, float radius) {
  return 1.0F / std::max(std::max(glm::dot(from, from), radius * radius), 1e-30F);
}

}  // namespace

float Lights::estimate(const Light& light, glm::vec3 position) const {
  const auto index = static_cast<std::size_t>(light.index);
  switch (light.kind) {
    case Kind::rectangle: {
      const Rectangle& r = rectangles_[index];
      const float height = glm::dot(position - r.corner, r.normal);
      if (!(height > 0.0F)) return 0.0F;
      const float square = over_square(position - r.centre, 0.5F * r.diagonal);
      return light.luminance * r.area * square * std::clamp(height * std::sqrt(square), 0.05F, 1.0F);
    }
    case Kind::sphere: {
      const Sphere& s = spheres_[index];
      return light.luminance * kPi * s.radius * s.radius * over_square(position - s.centre, s.radius);
    }
    case Kind::point: return light.luminance * over_square(position - points_[index].position, 0.0F);
    case Kind::directional: return light.luminance;
    case Kind::spot: {
      const SpotLight& spot = scene_->spot_lights[index];
      const glm::vec3 from = position - spots_[index].position;
      const float square = over_square(from, 0.0F);
      const glm::vec3 direction = from * std::sqrt(square);
      return light.luminance * square * spot_falloff(spot, glm::dot(spot.direction, direction));
    }
    case Kind::mesh: {
      // A convex body shows a quarter of its surface on average.
      const Mesh& mesh = meshes_[index];
      return light.luminance * 0.25F * mesh.area * over_square(position - mesh.centre, mesh.radius);
    }
    case Kind::environment: return 0.5F * light.luminance;
  }
  return 0.0F;
}

Lights::Pick Lights::pick(glm::vec3 position, float u) const {
  if (lights_.size() > kWeighed) {
    const CdfSample found = sample_cdf(power_cdf_.data(), static_cast<int>(lights_.size()), u);
    const auto i = static_cast<std::size_t>(found.index);
    return {found.index, found.place, power_cdf_[i + 1] - power_cdf_[i]};
  }
  std::array<float, kWeighed> weight;
  float sum = 0.0F;
  int lit = 0;
  for (std::size_t i = 0; i < lights_.size(); ++i) {
    weight[i] = estimate(lights_[i], position);
    sum += weight[i];
    lit += weight[i] > 0.0F ? 1 : 0;
  }
  Pick found{-1, u, 1.0F};
  float left = u;
  for (std::size_t i = 0; i < lights_.size(); ++i) {
    if (!(weight[i] > 0.0F)) continue;
    if (found.light >= 0) left -= found.probability;
    found.light = static_cast<int>(i);
    found.probability = (1.0F - kEqualShare) * weight[i] / sum + kEqualShare / static_cast<float>(lit);
    if (left < found.probability) break;
  }
  found.place = std::clamp(left / found.probability, 0.0F, 0x1.fffffep-1F);
  return found;
}

float Lights::pick_probability(int light, glm::vec3 position) const {
  const auto number = static_cast<std::size_t>(light);
  if (lights_.size() > kWeighed) return power_cdf_[number + 1] - power_cdf_[number];
  float sum = 0.0F;
  int lit = 0;
  for (const Light& other : lights_) {
    const float weight = estimate(other, position);
    sum += weight;
    lit += weight > 0.0F ? 1 : 0;
  }
  const float own = estimate(lights_[number], position);
  return own > 0.0F ? (1.0F - kEqualShare) * own / sum + kEqualShare / static_cast<float>(lit) : 0.0F;
}

std::uint32_t Lights::samples_of(const Light& light) const {
  const bool is_point =
      light.kind == Kind::point || light.kind == Kind::directional || light.kind == Kind::spot;
  return is_point ? 1 : LightSamples::kMost / kFew;
}

float Lights::mean_samples(int light, glm::vec3 position, Effort effort) const {
  if (light < 0) return 0.0F;
  if (effort == Effort::one) return pick_probability(light, position);
  if (few()) return static_cast<float>(samples_of(lights_[static_cast<std::size_t>(light)]));
  return static_cast<float>(kFew) * pick_probability(light, position);
}

std::optional<LightSample> Lights::sample(glm::vec3 position, glm::vec2 u, bool shared) const {
  if (lights_.empty()) return std::nullopt;
  const Pick found = pick(position, u.x);
  if (found.light < 0) return std::nullopt;
  const auto sample =
      sample_light(lights_[static_cast<std::size_t>(found.light)], position, {found.place, u.y}, shared);
  if (!sample) return std::nullopt;
  return over(*sample, found.probability);
}

LightSamples Lights::sample_many(glm::vec3 position, const SampleStream& stream, std::uint32_t dimension,
                                 bool shared) const {
  LightSamples samples;
  const auto take = [&](const Light& light, glm::vec2 u, float mean) {
    const auto sample = sample_light(light, position, u, shared);
    if (sample) samples.sample[samples.count++] = over(*sample, mean);
  };
  if (few()) {
    for (std::size_t i = 0; i < lights_.size(); ++i) {
      if (!(estimate(lights_[i], position) > 0.0F)) continue;
      const std::uint32_t count = samples_of(lights_[i]);
      for (std::uint32_t k = 0; k < count; ++k) {
        const SampleStream own{hash64(stream.key, i), stream.index * count + k};
        take(lights_[i], own.get(dimension), static_cast<float>(count));
      }
    }
    return samples;
  }
  for (std::uint32_t k = 0; k < kFew; ++k) {
    const glm::vec2 u = SampleStream{stream.key, stream.index * kFew + k}.get(dimension);
    const Pick found = pick(position, u.x);
    if (found.light < 0) return samples;
    take(lights_[static_cast<std::size_t>(found.light)], {found.place, u.y},
         static_cast<float>(kFew) * found.probability);
  }
  return samples;
}

}  // namespace mirrorbake::tracing
