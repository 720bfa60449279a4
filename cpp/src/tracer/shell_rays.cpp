#include "shell_rays.hpp"

#include <algorithm>
#include <cmath>
namespace mirrorbake::tracing {
ShellRays::ShellRays(const World& world, std::span<const ShellRule> rules, int reflector)
    : rules_(rules.begin(), rules.end() - 1), reflector_(reflector) {
  std::vector<int> hidden;
  float begin = 0.0F;
  for (const ShellRule& rule : rules_) {
    for (int object : rule.objects) {
      if (object == ShellRule::kItself) object = reflector;
      const bool is_new = std::find(hidden.begin(), hidden.end(), object) == hidden.end();
      if (!rule.has_limits() && is_new) hidden.push_back(object);
    }
    begin = std::max(begin, rule.holds_all_before());
    rests_.push_back({world.rays.without(hidden), begin});
  }
}

std::size_t ShellRays::shell_of(const Hit& hit) const {
  if (hit.missed()) return rules_.size();
  const auto holds = [&](const ShellRule& rule) {
    return rule.holds(static_cast<int>(hit.geometry), hit.distance, reflector_);
  };
  return static_cast<std::size_t>(std::find_if(rules_.begin(), rules_.end(), holds) - rules_.begin());
}

Hit ShellRays::first_of_rest(std::size_t shell, Ray ray) const {
  const Rest& rest = rests_[shell];
  if (rest.begin == kUnlimited) return {};
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
