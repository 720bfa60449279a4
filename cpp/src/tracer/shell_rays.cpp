#include "shell_rays.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "options.hpp"

namespace mirrorbake::tracing {
namespace {

void check_rule(const ShellRule& rule, const std::string& where, int objects) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  if (rule.name.empty() || !std::all_of(rule.name.begin(), rule.name.end(), is_plain)) {
    throw InvalidArgument(where + ".name", "'" + rule.name + "'", "letters, digits, _ or -");
  }
  for (const int object : rule.objects) {
    if (object == ShellRule::kItself || (object >= 0 && object < objects)) continue;
    throw InvalidArgument(where + ".objects", std::to_string(object),
                          "object numbers below " + std::to_string(objects) + ", or -1 for the reflector");
  }
  if (!(rule.nearer_than > 0.0F)) {
    throw InvalidArgument(where + ".nearer_than", text_of(rule.nearer_than), "more than 0");
  }
}

}  // namespace

void check_shells(const std::vector<ShellRule>& shells, std::size_t objects) {
  check_range("shells", static_cast<int>(shells.size()), 1, static_cast<int>(kMostShells));
  for (std::size_t k = 0; k < shells.size(); ++k) {
    const std::string where = "shells[" + std::to_string(k) + "]";
    check_rule(shells[k], where, static_cast<int>(objects));
    for (std::size_t other = 0; other < k; ++other) {
      if (shells[other].name != shells[k].name) continue;
      throw InvalidArgument(where + ".name", "'" + shells[k].name + "' again", "different names");
    }
  }
  if (!shells.back().objects.empty() || std::isfinite(shells.back().nearer_than)) {
    throw InvalidArgument("shells", "'" + shells.back().name + "' last, with a rule",
                          "a last one without a rule, which takes the rest");
  }
}

ShellRays::ShellRays(const World& world, std::span<const ShellRule> rules, int reflector) {
  std::vector<int> hidden;
  float begin = 0.0F;
  bool nothing = false;
  for (const ShellRule& rule : rules.first(rules.size() - 1)) {
    Rule& own = rules_.emplace_back(Rule{rule, {}});
    if (!rule.objects.empty()) own.is_of.resize(world.scene.objects.size(), false);
    for (int object : rule.objects) {
      if (object == ShellRule::kItself) object = reflector;
      own.is_of[static_cast<std::size_t>(object)] = true;
      const bool is_new = std::find(hidden.begin(), hidden.end(), object) == hidden.end();
      if (rule.nearer_than == kUnlimited && is_new) hidden.push_back(object);
    }
    if (rule.objects.empty()) begin = std::max(begin, rule.nearer_than);
    nothing = nothing || own.all_that_is_hit();
    rests_.push_back({world.rays.without(hidden), begin, nothing});
  }
}

std::size_t ShellRays::shell_of(const Hit& hit) const {
  std::size_t k = 0;
  if (hit.missed()) return rules_.size();
  for (; k < rules_.size(); ++k) {
    const std::vector<bool>& is_of = rules_[k].is_of;
    const bool is_kind = is_of.empty() || (hit.geometry < is_of.size() && is_of[hit.geometry]);
    if (is_kind && hit.distance < rules_[k].rule.nearer_than) break;
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
