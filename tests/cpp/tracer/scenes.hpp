#pragma once

#include <glm/geometric.hpp>

#include "mirrorbake/scene/scene.hpp"
#include "mirrorbake/scene/shapes.hpp"
#include "mirrorbake/tracer/tracer.hpp"

namespace mirrorbake::test {

inline Material matte(glm::vec3 albedo) {
  Material m;
  m.albedo = albedo;
  return m;
}

inline Material mirror(glm::vec3 reflectance, glm::vec3 albedo = glm::vec3(0.0F)) {
  Material m;
  m.albedo = albedo;
  m.specular = true;
  m.fresnel.r0 = reflectance;
  return m;
}

inline int add_object(Scene& scene, TriangleMesh mesh, const Material& material) {
  scene.materials.push_back(material);
  Object object;
  object.name = "object " + std::to_string(scene.objects.size());
  object.mesh = std::move(mesh);
  object.material = static_cast<int>(scene.materials.size()) - 1;
  scene.objects.push_back(std::move(object));
  return static_cast<int>(scene.objects.size()) - 1;
}

inline EnvironmentLight constant_environment(float radiance) {
  EnvironmentLight light;
  light.panorama = Image(8, 4, {"R", "G", "B"});
  std::fill(light.panorama.pixels.begin(), light.panorama.pixels.end(), radiance);
  return light;
}

/// A box room, 4 m wide, floor at y = 0, its walls facing inwards, lit by a rectangle under the ceiling.
inline Scene small_room() {
  Scene scene;
  const float r = 2.0F;
  const glm::vec3 x(2 * r, 0, 0), y(0, 2 * r, 0), z(0, 0, 2 * r);
  add_object(scene, make_rectangle({-r, 0, r}, x, -z), matte({0.6F, 0.6F, 0.5F}));   // floor, facing up
  add_object(scene, make_rectangle({-r, 2 * r, -r}, x, z), matte(glm::vec3(0.7F)));  // ceiling
  add_object(scene, make_rectangle({-r, 0, -r}, x, y), matte({0.3F, 0.4F, 0.7F}));   // back, facing +z
  add_object(scene, make_rectangle({r, 0, r}, -x, y), matte({0.7F, 0.7F, 0.7F}));    // front, facing −z
  add_object(scene, make_rectangle({-r, 0, r}, -z, y), matte({0.7F, 0.2F, 0.2F}));   // left, facing +x
  add_object(scene, make_rectangle({r, 0, -r}, z, y), matte({0.2F, 0.6F, 0.2F}));    // right, facing −x
  RectangleLight light;
  light.corner = {-0.5F, 3.9F, -0.5F};
  light.edge_u = {1, 0, 0};
  light.edge_v = {0, 0, 1};  // u × v points down
  light.radiance = glm::vec3(12.0F);
  scene.rectangle_lights.push_back(light);
  return scene;
}

}  // namespace mirrorbake::test
