#include "mirrorbake/surface/lookup.hpp"

#include <string>

#include "mirrorbake/core/check.hpp"

namespace mirrorbake {

Footprint lookup_footprint(const SurfaceSamples& samples, std::size_t i, const Proxy& in_scene,
                           float footprint_scale) {
  const Proxy proxy = samples.origin == glm::dvec3(0.0) ? in_scene : translated(in_scene, -samples.origin);
  const glm::vec3 p = samples.position[i];
  const glm::vec3 r = samples.reflection[i];
  const float s = footprint_scale;
  const glm::vec3 direction = lookup_direction(proxy, p, r);
  return {
      direction,
      lookup_direction(proxy, p + s * samples.dposition_dx[i], r + s * samples.dreflection_dx[i]) - direction,
      lookup_direction(proxy, p + s * samples.dposition_dy[i], r + s * samples.dreflection_dy[i]) -
          direction};
}

TexelReads lookup(const SurfaceSamples& samples, std::size_t i, const Proxy& proxy,
                  const TexelTopology& topology, const RunTimeModel& model) {
  return reads(topology, lookup_footprint(samples, i, proxy, model.footprint_scale),
               {model.filter, model.max_taps});
}

void check_lookup_arrays(const SurfaceSamples& samples) {
  const std::size_t n = samples.size();
  const auto check = [n](const char* name, std::size_t length) {
    check_length(std::string("samples.") + name, length, n, "as many as samples.pixel");
  };
  check("part", samples.part.size());
  check("position", samples.position.size());
  check("reflection", samples.reflection.size());
  check("dposition_dx", samples.dposition_dx.size());
  check("dposition_dy", samples.dposition_dy.size());
  check("dreflection_dx", samples.dreflection_dx.size());
  check("dreflection_dy", samples.dreflection_dy.size());
}

}  // namespace mirrorbake
