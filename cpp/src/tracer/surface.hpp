#pragma once

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/scene/scene.hpp"
#include "ray_scene.hpp"

namespace mirrorbake::tracing {

/// The point of an object that a ray hits, with what shading needs. Surfaces are two-sided: normals are
/// turned to the side that the ray came from.
struct Surface {
  int object = 0;
  std::uint32_t triangle = 0;
  glm::vec2 barycentric{0.0F};  ///< weights of the second and third vertex
  const Material* material = nullptr;
  bool front = true;  ///< the ray hit the side from which the triangle is counter-clockwise
  glm::vec3 position{0.0F};
  float position_error = 0.0F;        ///< bound of each coordinate's error
  glm::vec3 geometric_normal{0.0F};   ///< unit
  glm::vec3 normal{0.0F};             ///< unit shading normal
  glm::vec3 view{0.0F};               ///< unit, towards where the ray came from
  glm::vec3 albedo{0.0F};             ///< with texture; times (1 − F) under a coat
  glm::vec3 fresnel{0.0F};            ///< at the cosine of normal and view; 0 unless specular
  glm::vec3 reflection{0.0F};         ///< unit mirror direction; above the geometric surface if specular
  glm::vec3 emission{0.0F};           ///< radiance emitted towards `view`
  glm::vec3 reflectance_scale{1.0F};  ///< of the Fresnel term's r0, by a texture
  float roughness = 0.0F;             ///< of the lobe `ggx`, with texture

  bool specular() const { return material->specular; }
  bool rough() const { return specular() && material->lobe != SpecularLobe::mirror; }
};

/// `hit` must be a hit of an object (not of a light).
Surface surface_at(const Scene& scene, const RayScene& rays, const Hit& hit, glm::vec3 ray_direction);

/// Origin for a ray that leaves the surface along `direction`: moved off the surface by the bound of its
/// error.
glm::vec3 offset_origin(const Surface& surface, glm::vec3 direction);

/// Fresnel reflectance of a specular surface for a cosine to its facets, with textures.
glm::vec3 fresnel_at(const Surface& surface, float cosine);

/// How a surface's position and mirror direction change with the ray's direction ([Igehy 1999], §3.1).
struct SurfaceDifferential {
  glm::vec3 position{0.0F};
  glm::vec3 reflection{0.0F};
};

/// For a ray from a fixed point at `distance`, whose unit direction changes by `ddirection`.
SurfaceDifferential surface_differential(const Scene& scene, const RayScene& rays, const Surface& surface,
                                         float distance, glm::vec3 ddirection);

/// `triangle_normal` in double: with edges below a tenth of a millimetre the square underflows in float.
glm::vec3 small_triangle_normal(glm::vec3 a, glm::vec3 b, glm::vec3 c);
/// Unit normal of the side from which the corners are counter-clockwise; 0 if the triangle has no area.
inline glm::vec3 triangle_normal(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) {
  const glm::vec3 n = glm::cross(b - a, c - a);
  const float square = glm::dot(n, n);
  return square > 1e-30F && square < 1e30F ? n / std::sqrt(square) : small_triangle_normal(a, b, c);
}

inline float luminance(glm::vec3 c) { return 0.2126F * c.x + 0.7152F * c.y + 0.0722F * c.z; }

}  // namespace mirrorbake::tracing
