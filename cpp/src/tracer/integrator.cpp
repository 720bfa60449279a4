#include "integrator.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "world.hpp"

namespace mirrorbake::tracing {
namespace {

constexpr float kInversePi = std::numbers::inv_pi_v<float>;

// Shadow rays stop this fraction short of the light they aim at.
constexpr float kShadowEpsilon = 1e-4F;

// Power heuristic with exponent 2 (Veach 1997, §9.2.4), safe for huge densities.
float power_heuristic(float pdf, float other) {
  if (!(pdf > 0.0F)) return 0.0F;
  const float ratio = other / pdf;
  return 1.0F / (1.0F + ratio * ratio);
}

}  // namespace

glm::vec3 direct_irradiance(const World& world, const Surface& surface, glm::vec2 u, bool share_with_cosine) {
  const std::optional<LightSample> light = world.lights.sample(surface.position, u);
  if (!light) return glm::vec3(0.0F);
  const float cosine = glm::dot(surface.normal, light->direction);
  if (!(cosine > 0.0F) || !(glm::dot(surface.geometric_normal, light->direction) > 0.0F))
    return glm::vec3(0.0F);

  Ray shadow;
  shadow.origin = offset_origin(surface, light->direction);
  if (std::isfinite(light->distance)) {
    const glm::vec3 to = surface.position + light->distance * light->direction - shadow.origin;
    const float distance = glm::length(to);
    if (!(distance > 0.0F)) return glm::vec3(0.0F);
    shadow.direction = to / distance;
    shadow.max_distance = distance * (1.0F - kShadowEpsilon);
  } else {
    shadow.direction = light->direction;
  }
  if (world.rays.all().occluded(shadow)) return glm::vec3(0.0F);
  float weight = 1.0F;
  if (share_with_cosine && light->pdf > 0.0F) weight = power_heuristic(light->pdf, cosine * kInversePi);
  return weight * cosine * light->radiance;
}

glm::vec3 body_radiance(const World& world, const Surface& surface, const PathLimits& limits,
                        const SampleStream& stream, int bounce) {
  if (surface.albedo == glm::vec3(0.0F)) return surface.emission;
  const std::uint32_t dimension = dimension_base(bounce, 0);
  const bool path = world.options.indirect == IndirectLight::path && limits.diffuse_depth > 0;
  glm::vec3 irradiance = direct_irradiance(world, surface, stream.get(dimension + light_dimension), path);
  if (world.options.indirect == IndirectLight::cached) irradiance += world.cache.irradiance(surface);
  glm::vec3 radiance = surface.emission + surface.albedo * kInversePi * irradiance;
  if (path) radiance += surface.albedo * diffuse_path_radiance(world, surface, limits, stream, bounce);
  return radiance;
}

glm::vec3 radiance(const World& world, const Ray& first_ray, const Hit& first_hit, const PathLimits& limits,
                   const SampleStream& stream, int bounce) {
  glm::vec3 sum(0.0F);
  glm::vec3 throughput(1.0F);
  Ray ray = first_ray;
  Hit hit = first_hit;
  for (;; ++bounce) {
    if (hit.missed()) return sum + throughput * world.lights.environment_radiance(ray.direction);
    if (world.is_light(hit)) {
      return sum + throughput * world.lights.rectangle_radiance(world.light_number(hit), ray.direction);
    }
    const Surface surface = surface_at(world.scene, world.rays, hit, ray.direction);
    sum += throughput * body_radiance(world, surface, limits, stream, bounce);
    if (!surface.specular() || bounce > limits.specular_depth) return sum;
    throughput *= surface.fresnel;
    if (throughput == glm::vec3(0.0F)) return sum;
    ray = {offset_origin(surface, surface.reflection), surface.reflection};
    hit = world.rays.all().intersect(ray);
  }
}

glm::vec3 diffuse_path_radiance(const World& world, const Surface& start, const PathLimits& limits,
                                const SampleStream& stream, int bounce) {
  glm::vec3 sum(0.0F);
  glm::vec3 throughput(1.0F);
  Surface surface = start;
  int diffuse_bounces = 1;
  int specular_bounces = 0;
  glm::vec3 direction = sample_cosine_hemisphere(Frame(surface.normal),
                                                 stream.get(dimension_base(bounce, 0) + diffuse_dimension));
  float pdf = glm::dot(surface.normal, direction) * kInversePi;
  bool last_was_mirror = false;  // then next-event estimation had no chance, and emission counts in full
  for (int vertex = 1;; ++vertex) {
    if (!last_was_mirror && !(glm::dot(surface.geometric_normal, direction) > 0.0F)) return sum;
    const Ray ray{offset_origin(surface, direction), direction};
    const Hit hit = world.rays.all().intersect(ray);
    if (hit.missed()) {
      const float weight =
          last_was_mirror ? 1.0F : power_heuristic(pdf, world.lights.environment_pdf(direction));
      return sum + throughput * weight * world.lights.environment_radiance(direction);
    }
    if (world.is_light(hit)) {
      const int light = world.light_number(hit);
      const float weight = last_was_mirror
                               ? 1.0F
                               : power_heuristic(pdf, world.lights.rectangle_pdf(light, surface.position,
                                                                                 direction, hit.distance));
      return sum + throughput * weight * world.lights.rectangle_radiance(light, direction);
    }
    const Surface next = surface_at(world.scene, world.rays, hit, direction);
    if (next.emission != glm::vec3(0.0F)) {
      const float weight =
          last_was_mirror ? 1.0F
                          : power_heuristic(pdf, world.lights.mesh_pdf(next.object, next.geometric_normal,
                                                                       direction, hit.distance));
      sum += throughput * weight * next.emission;
    }
    surface = next;

    // One lobe at random, in proportion to what the lobes reflect.
    const std::uint32_t dimension =
        dimension_base(bounce, std::min(vertex, static_cast<int>(vertices_per_bounce) - 1));
    // Stratification pays off where many samples share the vertices before: on the first two of a path.
    const auto random = [&](std::uint32_t use) {
      return vertex <= 2 ? stream.get(dimension + use) : stream.get_independent(dimension + use);
    };
    const glm::vec2 choice = random(lobe_dimension);
    const float diffuse_share = luminance(surface.albedo);
    const float mirror_share = specular_bounces <= limits.specular_depth ? luminance(surface.fresnel) : 0.0F;
    const bool has_diffuse = surface.albedo != glm::vec3(0.0F);
    const bool continue_diffuse = diffuse_bounces < limits.diffuse_depth;
    if (has_diffuse) {
      sum += throughput * surface.albedo * kInversePi *
             direct_irradiance(world, surface, random(light_dimension), continue_diffuse);
    }
    const float total = (continue_diffuse ? diffuse_share : 0.0F) + mirror_share;
    if (!(total > 0.0F)) return sum;
    const float mirror_probability = mirror_share / total;
    if (choice.x < mirror_probability) {
      throughput *= surface.fresnel / mirror_probability;
      direction = surface.reflection;
      ++specular_bounces;
      last_was_mirror = true;
    } else {
      throughput *= surface.albedo / (1.0F - mirror_probability);
      direction = sample_cosine_hemisphere(Frame(surface.normal), random(diffuse_dimension));
      pdf = glm::dot(surface.normal, direction) * kInversePi;
      ++diffuse_bounces;
      last_was_mirror = false;
    }
    // Russian roulette from the third vertex on.
    if (vertex >= 2) {
      const float survival = std::min(0.95F, std::max(throughput.x, std::max(throughput.y, throughput.z)));
      if (!(choice.y < survival)) return sum;
      throughput /= survival;
    }
  }
}

}  // namespace mirrorbake::tracing
