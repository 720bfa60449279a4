#include "integrator.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/tracer/lobe.hpp"
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

// A rough surface's lobe, its view in the lobe's frame.
struct Lobe {
  LobeShape shape;
  Frame frame;
  glm::vec3 view;

  explicit Lobe(const Surface& s)
      : shape{s.material->lobe, s.roughness, s.material->exponent},
        frame(s.normal),
        view(frame.to_local(s.view)) {}
};

// The lobe's Fresnel term as a multiple of `surface.fresnel`, which the layers hold (spec T5).
glm::vec3 fresnel_ratio(const Surface& surface, const Lobe& lobe, glm::vec3 light) {
  if (surface.material->fresnel.model == FresnelModel::constant || lobe.shape.lobe == SpecularLobe::phong)
    return glm::vec3(1.0F);
  const glm::vec3 f = fresnel_at(surface, lobe_fresnel_cosine(lobe.shape, lobe.view, light));
  glm::vec3 ratio(0.0F);
  for (int c = 0; c < 3; ++c) {
    if (surface.fresnel[c] > 0.0F) ratio[c] = f[c] / surface.fresnel[c];
  }
  return ratio;
}

// Which lobes a followed ray samples as well, so that next-event estimation has to share with it.
struct Partners {
  bool cosine = false;
  bool lobe = false;
  bool all = false;  ///< of those that the surface has
};

// Density of the cosine, by which diffuse paths go on; 0 below the surface.
float cosine_pdf(const Surface& surface, glm::vec3 direction) {
  const float cosine = glm::dot(surface.normal, direction);
  return cosine > 0.0F && glm::dot(surface.geometric_normal, direction) > 0.0F ? cosine * kInversePi : 0.0F;
}

struct DirectLight {
  glm::vec3 irradiance{0.0F};
  glm::vec3 lobe{0.0F};  ///< to be multiplied with `surface.fresnel`
};

// What one direction brings.
DirectLight direct_light(const World& world, const Surface& surface, const LightSample& light,
                         Partners partners, bool for_lobe) {
  const float cosine = glm::dot(surface.normal, light.direction);
  if (!(cosine > 0.0F) || !(glm::dot(surface.geometric_normal, light.direction) > 0.0F)) return {};

  DirectLight found;
  const auto share = [&](bool shared, float pdf) {
    return shared && light.pdf > 0.0F ? power_heuristic(light.pdf, pdf) : 1.0F;
  };
  found.irradiance = share(partners.cosine, cosine * kInversePi) * cosine * light.radiance;
  if (for_lobe) {
    const Lobe lobe(surface);
    const glm::vec3 direction = lobe.frame.to_local(light.direction);
    const float response = lobe_response(lobe.shape, lobe.view, direction);
    found.lobe = share(partners.lobe, lobe_density(lobe.shape, lobe.view, direction)) * response *
                 fresnel_ratio(surface, lobe, direction) * light.radiance;
    if (surface.albedo == glm::vec3(0.0F) && found.lobe == glm::vec3(0.0F)) return {};
  }

  Ray shadow;
  shadow.origin = offset_origin(surface, light.direction);
  if (std::isfinite(light.distance)) {
    const glm::vec3 to = surface.position + light.distance * light.direction - shadow.origin;
    const float distance = glm::length(to);
    if (!(distance > 0.0F)) return {};
    shadow.direction = to / distance;
    shadow.max_distance = distance * (1.0F - kShadowEpsilon);
  } else {
    shadow.direction = light.direction;
  }
  if (world.rays.all().occluded(shadow)) return {};
  return found;
}

// By Effort::one.
DirectLight direct_light(const World& world, const Surface& surface, glm::vec2 u, Partners partners,
                         bool for_lobe) {
  const std::optional<LightSample> light = world.lights.sample(surface.position, u, partners.all);
  return light ? direct_light(world, surface, *light, partners, for_lobe) : DirectLight{};
}

// By Effort::many.
DirectLight direct_light(const World& world, const Surface& surface, const SampleStream& stream,
                         std::uint32_t dimension, Partners partners, bool for_lobe) {
  const LightSamples lights = world.lights.sample_many(surface.position, stream, dimension, partners.all);
  DirectLight sum;
  for (std::uint32_t i = 0; i < lights.count; ++i) {
    const DirectLight found = direct_light(world, surface, lights.sample[i], partners, for_lobe);
    sum.irradiance += found.irradiance;
    sum.lobe += found.lobe;
  }
  return sum;
}

bool diffuse_follows(const LitWorld& lit, const PathLimits& limits) {
  return lit.indirect.mode == IndirectLight::path && limits.diffuse_depth > 0;
}

bool specular_follows(const Surface& surface, const PathLimits& limits, int bounce) {
  return surface.specular() && bounce <= limits.specular_depth;
}

}  // namespace

glm::vec3 direct_irradiance(const World& world, const Surface& surface, glm::vec2 u, bool share_with_cosine) {
  return direct_light(world, surface, u, {.cosine = share_with_cosine, .all = share_with_cosine}, false)
      .irradiance;
}

ScatteredLight scattered_light(const LitWorld& lit, const Surface& surface, const PathLimits& limits,
                               const SampleStream& stream, int bounce) {
  const World& world = lit.world;
  const bool has_body = surface.albedo != glm::vec3(0.0F);
  const bool has_lobe = surface.rough() && specular_follows(surface, limits, bounce);
  if (!has_body && !has_lobe) return {};
  const bool path = diffuse_follows(lit, limits);
  const DirectLight direct = direct_light(world, surface, stream, dimension_base(bounce, 0) + light_dimension,
                                          {.cosine = path, .lobe = true, .all = path}, has_lobe);
  ScatteredLight light;
  light.lobe = direct.lobe;
  if (!has_body) return light;
  glm::vec3 irradiance = direct.irradiance;
  if (lit.indirect.mode == IndirectLight::cached) irradiance += lit.indirect.cache.irradiance(surface);
  light.body = surface.albedo * kInversePi * irradiance;
  if (path)
    light.body += surface.albedo * diffuse_path_radiance(lit, surface, limits, stream, bounce, Effort::many);
  return light;
}

SpecularBounce specular_bounce(const Surface& surface, glm::vec2 u) {
  if (!surface.rough()) return {surface.reflection, glm::vec3(1.0F), 0.0F};
  const Lobe lobe(surface);
  const glm::vec3 local = sample_lobe(lobe.shape, lobe.view, u);
  SpecularBounce bounce;
  bounce.direction = glm::normalize(lobe.frame.to_world(local));
  bounce.pdf = lobe_density(lobe.shape, lobe.view, local);
  if (!(bounce.pdf > 0.0F) || !(glm::dot(bounce.direction, surface.geometric_normal) > 0.0F)) return bounce;
  bounce.weight =
      lobe_response(lobe.shape, lobe.view, local) / bounce.pdf * fresnel_ratio(surface, lobe, local);
  return bounce;
}

SpecularBounce specular_bounce(const Surface& surface, const SampleStream& stream, int bounce) {
  const glm::vec2 u =
      surface.rough() ? stream.get(dimension_base(bounce + 1, 0) + rough_dimension) : glm::vec2(0.0F);
  return specular_bounce(surface, u);
}

glm::vec3 emitted_light(const World& world, const Ray& ray, const Hit& hit, float pdf, NextEvent how) {
  if (hit.missed()) {
    const EnvironmentSampler::Found found = world.lights.environment(ray, how);
    return pdf > 0.0F ? power_heuristic(pdf, found.pdf) * found.radiance : found.radiance;
  }
  const int light = world.light_number(hit);
  const glm::vec3 radiance = world.lights.hit_radiance(light, ray);
  if (!(pdf > 0.0F) || radiance == glm::vec3(0.0F)) return radiance;
  return power_heuristic(pdf, world.lights.hit_pdf(light, ray, hit.distance, how.effort)) * radiance;
}

glm::vec3 emitted_light(const World& world, const Ray& ray, const Hit& hit, const Surface& surface, float pdf,
                        Effort effort) {
  if (!(pdf > 0.0F) || surface.emission == glm::vec3(0.0F)) return surface.emission;
  const float other = world.lights.mesh_pdf(hit, surface.geometric_normal, ray, effort);
  return power_heuristic(pdf, other) * surface.emission;
}

glm::vec3 radiance(const LitWorld& lit, const Ray& first_ray, const Hit& first_hit, const PathLimits& limits,
                   const SampleStream& stream, int bounce, float pdf) {
  const World& world = lit.world;
  glm::vec3 sum(0.0F);
  glm::vec3 throughput(1.0F);
  Ray ray = first_ray;
  Hit hit = first_hit;
  for (;; ++bounce) {
    if (hit.missed() || world.is_light(hit))
      return sum +
             throughput * emitted_light(world, ray, hit, pdf, {Effort::many, diffuse_follows(lit, limits)});
    const Surface surface = surface_at(world.scene, world.rays, hit, ray.direction);
    const ScatteredLight scattered = scattered_light(lit, surface, limits, stream, bounce);
    sum += throughput * (emitted_light(world, ray, hit, surface, pdf, Effort::many) + scattered.body);
    if (!specular_follows(surface, limits, bounce)) return sum;
    throughput *= surface.fresnel;
    if (throughput == glm::vec3(0.0F)) return sum;
    sum += throughput * scattered.lobe;
    const SpecularBounce next = specular_bounce(surface, stream, bounce);
    throughput *= next.weight;
    if (throughput == glm::vec3(0.0F)) return sum;
    pdf = next.pdf;
    ray = {offset_origin(surface, next.direction), next.direction};
    hit = world.rays.all().intersect(ray, RayKind::reflection);
  }
}

namespace {

// The random numbers of a vertex of a diffuse path.
struct VertexNumbers {
  const SampleStream& stream;
  std::uint32_t first_dimension;
  bool stratified;

  VertexNumbers(const SampleStream& stream_, int bounce, int vertex)
      : stream(stream_),
        first_dimension(dimension_base(bounce, std::min(vertex, static_cast<int>(vertices_per_bounce) - 1))),
        // It pays off where many samples share the vertices before: on the first two of a path.
        stratified(vertex <= 2) {}

  glm::vec2 operator()(std::uint32_t use) const {
    return stratified ? stream.get(first_dimension + use) : stream.get_independent(first_dimension + use);
  }
};

// Radiance of the lights that `ray` finds by way of specular surfaces alone, times `throughput`.
// `specular_bounces` were before.
glm::vec3 caustic_light(const World& world, Ray ray, glm::vec3 throughput, const PathLimits& limits,
                        int specular_bounces, const VertexNumbers& numbers) {
  glm::vec3 sum(0.0F);
  float lobe_pdf = 0.0F;
  for (int chain = 0;; ++chain) {
    const Hit hit = world.rays.all().intersect(ray, RayKind::reflection);
    if (hit.missed() || world.is_light(hit)) {
      return chain > 0 ? sum + throughput * emitted_light(world, ray, hit, lobe_pdf, {Effort::one, true})
                       : sum;
    }
    const Surface surface = surface_at(world.scene, world.rays, hit, ray.direction);
    if (chain > 0) sum += throughput * emitted_light(world, ray, hit, surface, lobe_pdf, Effort::one);
    if (chain == CausticGuide::kSpecularBounces) return sum;
    if (!specular_follows(surface, limits, specular_bounces + chain)) return sum;
    throughput *= surface.fresnel;
    glm::vec2 lobe(0.0F);
    if (surface.rough()) {
      const std::uint32_t use = guide_dimension + 1 + 2 * static_cast<std::uint32_t>(chain);
      sum += throughput * direct_light(world, surface, numbers(use), {.lobe = true, .all = true}, true).lobe;
      lobe = numbers(use + 1);
    }
    const SpecularBounce next = specular_bounce(surface, lobe);
    throughput *= next.weight;
    if (throughput == glm::vec3(0.0F)) return sum;
    ray = {offset_origin(surface, next.direction), next.direction};
    lobe_pdf = next.pdf;
  }
}

// What a guided ray brings: an estimate of π⁻¹ × irradiance, weighted (power heuristic) for a partner that
// follows the cosine, `guided_partner_weight`.
glm::vec3 guided_light(const LitWorld& lit, const Surface& start, CausticGuide::Cell cell,
                       const PathLimits& limits, int specular_bounces, const VertexNumbers& numbers) {
  const glm::vec2 u = numbers(guide_dimension);
  if (!(u.x < cell.rays)) return glm::vec3(0.0F);
  const glm::vec3 direction = lit.indirect.guide.sample(cell, {u.x / cell.rays, u.y});
  const float pdf = cosine_pdf(start, direction);
  const float guided = cell.rays * lit.indirect.guide.pdf(cell, direction);
  if (!(pdf > 0.0F) || !(guided > 0.0F)) return glm::vec3(0.0F);
  return caustic_light(lit.world, {offset_origin(start, direction), direction},
                       glm::vec3(pdf / guided * power_heuristic(guided, pdf)), limits, specular_bounces,
                       numbers);
}

// Weight of what `guided_light` finds as well, for a ray along the cosine.
float guided_partner_weight(const LitWorld& lit, CausticGuide::Cell cell, glm::vec3 direction, float pdf) {
  return cell.rays > 0.0F ? power_heuristic(pdf, cell.rays * lit.indirect.guide.pdf(cell, direction)) : 1.0F;
}

float brightest(glm::vec3 c) { return std::max(c.x, std::max(c.y, c.z)); }

// Russian roulette: whether a path goes on; the throughput of those that do makes up for the others. Paths
// are short-lived only once little is left: an early end saves less time than its noise costs.
bool survives(glm::vec3& throughput, int vertex, float random) {
  constexpr float kLittle = 0.25F;
  const float left = brightest(throughput);
  if (!(left > 0.0F)) return false;
  if (vertex < 2 || left >= kLittle) return true;
  const float survival = left / kLittle;
  if (!(random < survival)) return false;
  throughput /= survival;
  return true;
}

}  // namespace

glm::vec3 caustic_irradiance(const World& world, const CausticGuide& guide, const Surface& surface,
                             const SampleStream& stream) {
  // Some rays follow the cosine, for light from where the guide knows of none.
  constexpr float kCosineShare = 0.1F;
  const CausticGuide::Cell cell = guide.cell(surface.position);
  if (!(cell.rays > 0.0F)) return glm::vec3(0.0F);
  const VertexNumbers numbers(stream, 0, 0);
  const glm::vec2 u = numbers(guide_dimension);
  const glm::vec3 direction = u.x < kCosineShare
                                  ? sample_cosine_hemisphere(Frame(surface.normal), {u.x / kCosineShare, u.y})
                                  : guide.sample(cell, {(u.x - kCosineShare) / (1.0F - kCosineShare), u.y});
  const float pdf = cosine_pdf(surface, direction);
  if (!(pdf > 0.0F)) return glm::vec3(0.0F);
  const float chosen = kCosineShare * pdf + (1.0F - kCosineShare) * guide.pdf(cell, direction);
  return std::numbers::pi_v<float> * caustic_light(world, {offset_origin(surface, direction), direction},
                                                   glm::vec3(pdf / chosen), PathLimits{}, 0, numbers);
}

glm::vec3 diffuse_path_radiance(const LitWorld& lit, const Surface& start, const PathLimits& limits,
                                const SampleStream& stream, int bounce, Effort effort) {
  const World& world = lit.world;
  glm::vec3 sum(0.0F);
  glm::vec3 throughput(1.0F);
  Surface surface = start;
  int diffuse_bounces = 0;
  int specular_bounces = 0;
  glm::vec3 direction(0.0F);
  float pdf = 0.0F;             // 0 after a mirror: emission counts in full
  NextEvent how{effort, true};  // where the followed ray starts
  // Since the last diffuse surface: what is known of caustics there, the specular surfaces passed, and the
  // weight of the light that they show.
  CausticGuide::Cell cell;
  int chain = 0;
  float chain_weight = 1.0F;
  const auto leave_diffuse = [&](const VertexNumbers& numbers) {
    cell = lit.indirect.guide.cell_of_path(surface.position);
    if (cell.rays > 0.0F) {
      cell.rays *= std::min(1.0F, brightest(throughput));
      sum += throughput * guided_light(lit, surface, cell, limits, specular_bounces, numbers);
    }
    direction = sample_cosine_hemisphere(Frame(surface.normal), numbers(diffuse_dimension));
    pdf = cosine_pdf(surface, direction);
    ++diffuse_bounces;
    chain = 0;
    chain_weight = 1.0F;
  };
  leave_diffuse({stream, bounce, 0});
  for (int vertex = 1;; ++vertex) {
    if (throughput == glm::vec3(0.0F) || !(glm::dot(surface.geometric_normal, direction) > 0.0F)) return sum;
    const Ray ray{offset_origin(surface, direction), direction};
    const Hit hit = world.rays.all().intersect(ray, RayKind::reflection);
    if (hit.missed() || world.is_light(hit))
      return sum + chain_weight * throughput * emitted_light(world, ray, hit, pdf, how);
    surface = surface_at(world.scene, world.rays, hit, direction);
    sum += chain_weight * throughput * emitted_light(world, ray, hit, surface, pdf, how.effort);

    const VertexNumbers numbers(stream, bounce, vertex);
    const bool has_body = surface.albedo != glm::vec3(0.0F);
    const bool continue_diffuse = has_body && diffuse_bounces < limits.diffuse_depth;
    const bool continue_specular = specular_follows(surface, limits, specular_bounces);
    const bool has_lobe = surface.rough() && continue_specular;
    if (continue_specular && chain == 0) chain_weight = guided_partner_weight(lit, cell, direction, pdf);
    if (chain == CausticGuide::kSpecularBounces) chain_weight = 1.0F;
    how = {Effort::one, continue_diffuse || !has_body};
    if (has_body || has_lobe) {
      const DirectLight direct =
          direct_light(world, surface, numbers(light_dimension),
                       {.cosine = continue_diffuse, .lobe = true, .all = how.shared}, has_lobe);
      sum += throughput *
             (surface.albedo * kInversePi * direct.irradiance + chain_weight * surface.fresnel * direct.lobe);
    }
    // One lobe at random, in proportion to what the lobes reflect.
    const glm::vec2 choice = numbers(lobe_dimension);
    const float diffuse_share = continue_diffuse ? luminance(surface.albedo) : 0.0F;
    const float specular_share = continue_specular ? luminance(surface.fresnel) : 0.0F;
    const float total = diffuse_share + specular_share;
    if (!(total > 0.0F)) return sum;
    const float specular_probability = specular_share / total;
    const bool follow_specular = choice.x < specular_probability;
    SpecularBounce next;
    if (follow_specular) {
      next = specular_bounce(surface, surface.rough() ? numbers(rough_dimension) : glm::vec2(0.0F));
      throughput *= surface.fresnel * next.weight / specular_probability;
    } else {
      throughput *= surface.albedo / (1.0F - specular_probability);
    }
    if (!survives(throughput, vertex, choice.y)) return sum;
    if (follow_specular) {
      direction = next.direction;
      pdf = next.pdf;
      ++specular_bounces;
      ++chain;
    } else {
      leave_diffuse(numbers);
    }
  }
}

}  // namespace mirrorbake::tracing
