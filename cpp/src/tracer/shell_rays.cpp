#include "shell_rays.hpp"

#include <algorithm>
#include <cmath>

namespace mirrorbake::tracing {

ShellRays::ShellRays(const World& world, std::span<const ShellRule> rules, int reflector) {
  std::vector<int> hidden;
  float begin = 0.0F;
  bool nothing = false;
  for (const ShellRule& rule : rules.first(rules.size() - 1)) {
    Rule& own = rules_.emplace_back();
    own.nearer_than = rule.nearer_than;
    if (!rule.objects.empty()) own.objects.resize(world.scene.objects.size(), false);
    for (int object : rule.objects) {
      if (object == ShellRule::kItself) object = reflector;
      own.objects[static_cast<std::size_t>(object)] = true;
      const bool is_new = std::find(hidden.begin(), hidden.end(), object) == hidden.end();
      if (own.nearer_than == kUnlimited && is_new) hidden.push_back(object);
    }
    if (own.objects.empty()) begin = std::max(begin, own.nearer_than);
    nothing = nothing || own.all_that_is_hit();
    rests_.push_back({world.rays.without(hidden), begin, nothing});
  }
}

std::size_t ShellRays::shell_of(const Hit& hit) const {
  std::size_t k = 0;
  if (hit.missed()) return rules_.size();
  for (; k < rules_.size(); ++k) {
    const Rule& rule = rules_[k];
    const bool is_kind =
        rule.objects.empty() || (hit.geometry < rule.objects.size() && rule.objects[hit.geometry]);
    if (is_kind && hit.distance < rule.nearer_than) break;
  }
  return k;
}

Hit ShellRays::first_of_rest(std::size_t shell, Ray ray) const {
  const Rest& rest = rests_[shell];
  if (rest.nothing) return {};
  ray.min_distance = rest.begin;
  for (;;) {
    const Hit hit = rest.view.intersect(ray, RayKind::reflection);
    if (shell_of(hit) > shell) return hit;
    // A step of a few roundings, so that the same point is not met for ever.
    ray.min_distance = std::nextafter(hit.distance * (1.0F + 4.0F * 0x1p-23F), kUnlimited);
  }
}

IncidentShells ShellRays::trace(const LitWorld& lit, const Surface& surface, glm::vec3 lobe,
                                const PathLimits& limits, const SampleStream& stream) const {
  IncidentShells found;
  found.count = rules_.size() + 1;
  ShellSample& last = found.shells[rules_.size()];
  last.radiance = glm::vec4(0.0F, 0.0F, 0.0F, 1.0F);
  if (!surface.specular()) return found;  // a matte part of a reflector
  last.radiance = glm::vec4(lobe, 1.0F);
  const SpecularBounce bounce = specular_bounce(surface, stream, 0);
  if (bounce.weight == glm::vec3(0.0F)) return found;
  const Ray ray{offset_origin(surface, bounce.direction), bounce.direction};
  Hit hit = lit.world.rays.all().intersect(ray, RayKind::reflection);
  for (;;) {
    const std::size_t k = shell_of(hit);
    const glm::vec3 incident = radiance(lit, ray, hit, limits, stream, 1, bounce.pdf);
    found.shells[k] = {glm::vec4(lobe + bounce.weight * incident, 1.0F), hit.distance};
    if (k == rules_.size()) return found;
    hit = first_of_rest(k, ray);
  }
}

}  // namespace mirrorbake::tracing
