#pragma once

#include <numbers>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "integrator.hpp"
#include "world.hpp"

/// What gathering light at the vertices of a mesh takes: the irradiance cache and Tracer::vertex_irradiance.
namespace mirrorbake::tracing {

/// Unit normal on the triangle's front, or 0 if it has no area.
inline glm::vec3 face_normal(const World& world, std::uint32_t object, std::uint32_t triangle) {
  const std::span<const glm::vec3> p = world.rays.positions(static_cast<int>(object));
  const glm::uvec3 t = world.scene.objects[object].mesh.triangles[triangle];
  return triangle_normal(p[t.x], p[t.y], p[t.z]);
}

/// Weights of a triangle's corners at a random point near one of them. At the corner itself a ray would start
/// in the edge between two walls, inside both. `u` in [0,1)².
inline glm::vec3 weights_near_corner(std::uint32_t corner, glm::vec2 u) {
  constexpr float kSpread = 0.25F;  // of the way across the triangle
  const glm::vec2 others = kSpread * u.x * glm::vec2(1.0F - u.y, u.y);
  const auto c = static_cast<int>(corner);
  glm::vec3 weights(0.0F);
  weights[c] = 1.0F - others.x - others.y;
  weights[(c + 1) % 3] = others.x;
  weights[(c + 2) % 3] = others.y;
  return weights;
}

/// A point of a triangle, seen from the side of `towards`. `weights` are those of the second and third
/// corner.
inline Surface surface_of_triangle(const World& world, std::uint32_t object, std::uint32_t triangle,
                                   glm::vec2 weights, glm::vec3 towards) {
  const Hit hit{0.0F, object, triangle, weights.x, weights.y};
  return surface_at(world.scene, world.rays, hit, -towards);
}

/// What a gather ray picks up: the light that diffuse surfaces reflect. Emission is left out: next-event
/// estimation has it, and `caustic_irradiance` that which mirrors show.
struct Gathered {
  glm::vec3 radiance{0.0F};
  glm::vec3 by_mirrors{0.0F};   ///< of it, what specular surfaces have shown
  Hit first;                    ///< with the first surface
  bool nothing = false;         ///< the ray left the scene
  bool dark_back_side = false;  ///< it hit the inside of a body, and no light was there
};

/// Follows specular reflection a few bounces. `irradiance_at(surface, u)` is the irradiance of a surface, u
/// two random numbers.
template <typename IrradianceAt>
Gathered gather_along(const World& world, Ray ray, const SampleStream& stream,
                      const IrradianceAt& irradiance_at) {
  constexpr int kSpecularBounces = 4;
  Gathered result;
  glm::vec3 throughput(1.0F);
  for (int bounce = 0;; ++bounce) {
    const Hit hit = world.rays.all().intersect(ray, RayKind::reflection);
    if (hit.missed() || world.is_light(hit)) {
      result.nothing = bounce == 0 && hit.missed();
      return result;
    }
    const Surface surface = surface_at(world.scene, world.rays, hit, ray.direction);
    if (bounce == 0) result.first = hit;
    if (surface.albedo != glm::vec3(0.0F)) {
      const glm::vec2 u = stream.get(dimension_base(bounce, 0) + light_dimension);
      const glm::vec3 reflected =
          throughput * surface.albedo * std::numbers::inv_pi_v<float> * irradiance_at(surface, u);
      result.radiance += reflected;
      if (bounce > 0) result.by_mirrors += reflected;
    }
    if (bounce == 0) result.dark_back_side = !surface.front && result.radiance == glm::vec3(0.0F);
    if (!surface.specular() || bounce == kSpecularBounces) return result;
    const SpecularBounce next = specular_bounce(surface, stream, bounce);
    throughput *= surface.fresnel * next.weight;
    if (throughput == glm::vec3(0.0F)) return result;
    ray = {offset_origin(surface, next.direction), next.direction};
  }
}

}  // namespace mirrorbake::tracing
