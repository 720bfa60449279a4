#pragma once

#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/surface/surface_samples.hpp"

namespace mirrorbake::testing {

/// Surface samples of a mirror sphere of radius `radius` at the origin, seen from +Z by an orthographic
/// camera whose image just holds it: closed forms for everything, no ray tracer needed. The upper half is
/// part 0, the lower part 1.
inline SurfaceSamples mirror_sphere_samples(int size, int samples_per_pixel, float radius = 1.0F) {
  SurfaceSamples samples;
  samples.width = samples.height = size;
  samples.samples_per_pixel = samples_per_pixel;
  const float pixel_size = 2.0F * radius / static_cast<float>(size);
  const auto reflect = [radius](float x, float y, glm::vec3& p, glm::vec3& n, glm::vec3& r) {
    const float z2 = radius * radius - x * x - y * y;
    p = {x, y, std::sqrt(std::max(z2, 0.0F))};
    n = p / radius;
    r = 2.0F * n.z * n - glm::vec3(0, 0, 1);
    return z2 > 1e-3F * radius * radius;
  };
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const std::uint32_t pixel = static_cast<std::uint32_t>(y * size + x);
      for (int s = 0; s < samples_per_pixel; ++s) {
        const glm::vec2 u = sobol_2d(static_cast<std::uint32_t>(s), pixel);
        const float px = (static_cast<float>(x) + u.x) * pixel_size - radius;
        const float py = radius - (static_cast<float>(y) + u.y) * pixel_size;
        glm::vec3 p, n, r;
        if (!reflect(px, py, p, n, r)) continue;
        glm::vec3 p1, n1, r1, p2, n2, r2;
        reflect(px + 0.1F * pixel_size, py, p1, n1, r1);
        reflect(px, py - 0.1F * pixel_size, p2, n2, r2);
        samples.pixel.push_back(pixel);
        samples.part.push_back(py < 0.0F ? 1 : 0);
        samples.triangle.push_back(0);
        samples.barycentric.emplace_back(0.25F, 0.25F);
        samples.position.push_back(p);
        samples.normal.push_back(n);
        samples.reflection.push_back(r);
        samples.dposition_dx.push_back(10.0F * (p1 - p));
        samples.dposition_dy.push_back(10.0F * (p2 - p));
        samples.dreflection_dx.push_back(10.0F * (r1 - r));
        samples.dreflection_dy.push_back(10.0F * (r2 - r));
        samples.fresnel.emplace_back(1.0F);
        samples.albedo.emplace_back(0.0F);
      }
    }
  }
  return samples;
}

inline std::vector<float> random_values(std::size_t count, std::uint64_t seed) {
  std::vector<float> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = unit_float(static_cast<std::uint32_t>(hash64(seed, i)));
  return values;
}

}  // namespace mirrorbake::testing
