#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/image/image.hpp"
#include "mirrorbake/shading/fresnel.hpp"

/// What a scene is made of: plain values. World space is right-handed, +Y up, in metres; colours and radiance
/// are scene-linear with Rec.709 primaries.
namespace mirrorbake {

struct TriangleMesh {
  std::vector<glm::vec3> positions;
  std::vector<glm::vec3> normals;     ///< unit, one per vertex; empty: flat shading
  std::vector<glm::vec2> uvs;         ///< one per vertex, v up; empty: (0,0)
  std::vector<glm::uvec3> triangles;  ///< counter-clockwise seen from outside
  std::vector<std::uint16_t> parts;   ///< part of each triangle; empty: all belong to part 0
};

/// How diffuse and specular light add up ([EMT] §3; spec F5): `additive` is F·L_m + L_d, `coated` is
/// F·L_m + (1−F)·L_d, for a diffuse body under a clear coat.
enum class LayerModel { additive, coated };

struct Material {
  std::string name;
  glm::vec3 albedo{0.5F};   ///< Lambertian reflectance, in [0,1]
  int albedo_texture = -1;  ///< index into Scene::textures, multiplied with `albedo`; −1: none
  bool specular = false;    ///< has a mirror lobe, weighted by `fresnel`
  Fresnel fresnel;
  LayerModel layers = LayerModel::additive;
  glm::vec3 emission{0.0F};  ///< radiance emitted on the front side, W sr⁻¹ m⁻²
};

/// One thing of the scene: what a capture hides, and what a reflector is, are objects.
struct Object {
  std::string name;
  TriangleMesh mesh;                    ///< in world space
  int material = 0;                     ///< index into Scene::materials
  std::vector<std::string> part_names;  ///< e.g. {"body", "lid"}; empty: one part, named as the object
};

/// A one-sided rectangle `corner + a·edge_u + b·edge_v`, a and b in [0,1], that emits along edge_u × edge_v.
/// It is visible to rays.
struct RectangleLight {
  glm::vec3 corner{0.0F};
  glm::vec3 edge_u{1.0F, 0.0F, 0.0F};
  glm::vec3 edge_v{0.0F, 0.0F, 1.0F};
  glm::vec3 radiance{1.0F};  ///< W sr⁻¹ m⁻²
};

struct PointLight {
  glm::vec3 position{0.0F};
  glm::vec3 intensity{1.0F};  ///< W sr⁻¹
};

/// Radiance from infinity, a latitude-longitude panorama: its centre looks along −Z, +X is to the right of
/// the centre, +Y is the top row.
struct EnvironmentLight {
  Image panorama;  ///< three channels
  float scale = 1.0F;
  float rotation_degrees = 0.0F;  ///< counter-clockwise about +Y, seen from above
};

struct Scene {
  std::vector<Object> objects;
  std::vector<Material> materials;
  std::vector<Image> textures;  ///< three channels, scene-linear, repeating
  std::vector<RectangleLight> rectangle_lights;
  std::vector<PointLight> point_lights;
  std::optional<EnvironmentLight> environment;
};

/// Throws InvalidArgument if anything in the scene is unusable: indices out of range, arrays of unequal
/// length, vertices that are not finite or beyond ±1e12, normals that are not unit vectors, a mesh without
/// area (single triangles may be degenerate), albedo, texels or reflectance outside [0,1], negative radiance.
/// The message names the object, material, texture or light, the field, its value and what was expected.
void validate(const Scene& scene);

/// The same for one mesh.
void validate(const TriangleMesh& mesh);

/// Axis-aligned bounds of a mesh's vertices. Throws InvalidArgument if there are none.
struct Bounds {
  glm::vec3 min{0.0F};
  glm::vec3 max{0.0F};
};
Bounds bounds(const TriangleMesh& mesh);

}  // namespace mirrorbake
