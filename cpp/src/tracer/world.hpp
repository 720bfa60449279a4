#pragma once

#include <memory>

#include "irradiance_cache.hpp"
#include "lights.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "ray_scene.hpp"

namespace mirrorbake::tracing {

/// All that is prepared once per scene.
struct World {
  World(Scene scene_, const TracerOptions& options_)
      : scene(std::move(scene_)), options(options_), rays(scene), lights(scene, rays) {}
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  Scene scene;
  TracerOptions options;
  RayScene rays;
  Lights lights;
  IrradianceCache cache;  ///< empty unless options.indirect is `cached`

  bool is_light(const Hit& hit) const { return hit.geometry >= scene.objects.size(); }
  int light_number(const Hit& hit) const { return static_cast<int>(hit.geometry - scene.objects.size()); }
};

}  // namespace mirrorbake::tracing
