#pragma once

#include <span>
#include <utility>
#include <glm/geometric.hpp>

#include "barycentric.hpp"
#include "caustic_guide.hpp"
#include "irradiance_cache.hpp"
#include "lights.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "ray_scene.hpp"
#include "surface.hpp"

namespace mirrorbake::tracing {

/// What rays and lights are prepared from, once per scene.
struct World {
  explicit World(Scene scene_) : scene(std::move(scene_)), rays(scene), lights(scene, rays) {}
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  Scene scene;
  RayScene rays;
  Lights lights;

  bool is_light(const Hit& hit) const { return hit.geometry >= scene.objects.size(); }
  /// Number of a light's hit among the rectangle lights, then the sphere lights.
  int light_number(const Hit& hit) const { return static_cast<int>(hit.geometry - scene.objects.size()); }

  /// Point of an object that a hit is on.
  glm::vec3 position(const Hit& hit) const {
    return interpolate(rays.positions(static_cast<int>(hit.geometry)),
                       scene.objects[hit.geometry].mesh.triangles[hit.triangle], {hit.u, hit.v});
  }

  /// Unit normal of what a ray hits, on the side from which triangles are counter-clockwise and spheres are
  /// round.
  glm::vec3 geometric_normal(const Ray& ray, const Hit& hit) const {
    if (!is_light(hit)) {
      const auto object = static_cast<int>(hit.geometry);
      const std::span<const glm::vec3> p = rays.positions(object);
      const glm::uvec3 t = scene.objects[hit.geometry].mesh.triangles[hit.triangle];
      return triangle_normal(p[t.x], p[t.y], p[t.z]);
    }
    const auto number = static_cast<std::size_t>(light_number(hit));
    if (number < scene.rectangle_lights.size()) {
      const RectangleLight& light = scene.rectangle_lights[number];
      return glm::vec3(glm::normalize(glm::cross(glm::dvec3(light.edge_u), glm::dvec3(light.edge_v))));
    }
    const SphereLight& light = scene.sphere_lights[number - scene.rectangle_lights.size()];
    return glm::normalize(ray.origin + hit.distance * ray.direction - (light.centre - rays.origin()));
  }
};

/// How light gets about that diffuse surfaces pass on.
struct Indirect {
  Indirect(const World& world, const TracerOptions& options)
      : mode(options.indirect),
        guide(mode == IndirectLight::none ? CausticGuide() : CausticGuide(world, options.seed)),
        cache(mode == IndirectLight::cached ? IrradianceCache(world, guide, options) : IrradianceCache()) {}

  IndirectLight mode;
  CausticGuide guide;     ///< empty if the mode is `none`
  IrradianceCache cache;  ///< empty unless the mode is `cached`
};

/// All that the integrators need.
struct LitWorld {
  LitWorld(Scene scene, const TracerOptions& options) : world(std::move(scene)), indirect(world, options) {}
  /// A scene of the same surfaces as another, in which light gets about alike.
  LitWorld(Scene scene, const Indirect& known) : world(std::move(scene)), indirect(known) {}

  World world;
  Indirect indirect;
};

}  // namespace mirrorbake::tracing
