#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/image/image.hpp"
#include "mirrorbake/image/texture_file.hpp"
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
  /// One per vertex, in [0,1], linear, multiply the albedo; empty: (1,1,1)
  std::vector<glm::vec3> colors = {};
  /// One per vertex: the unit direction in which u grows, and in w the sign of the bitangent, ±1, which is
  /// w·(normal × xyz). All 0: this vertex has none. Empty: none has. Normal textures use them; where a corner
  /// of a triangle has none, they use the directions in which the triangle's own coordinates grow.
  std::vector<glm::vec4> tangents = {};
};

/// Texels that materials refer to: in memory, or in a file.
struct Texture {
  Image
      /// one channel, which stands for all three, or R, G, B; scene-linear; unused if there is a file
      image;
  TextureWrap wrap_u = TextureWrap::repeat;
  TextureWrap wrap_v = TextureWrap::repeat;
  std::shared_ptr<const TextureFile> file = nullptr;
};

/// A use of a texture. The texture coordinates are transformed as KHR_texture_transform defines it, in that
/// extension's coordinates, whose v counts downwards: scaled, turned counter-clockwise about (0, 0), moved.
struct TextureReference {
  int texture = -1;  ///< index into Scene::textures; −1: none
  glm::vec2 offset{0.0F};
  glm::vec2 scale{1.0F};
  float rotation = 0.0F;  ///< radians

  bool operator==(const TextureReference&) const = default;
};

/// The coordinates, v up, at which a texture is looked up for a mesh's coordinates `uv`, v up.
glm::vec2 texture_coordinates(const TextureReference& reference, glm::vec2 uv);

/// Texels around a point, interpolated bilinearly; `uv`, v up, are the texture's own coordinates. Throws
/// FileError if the texture's file has changed since it was opened.
glm::vec3 texture_lookup(const Texture& texture, glm::vec2 uv);

/// Mean of all texels.
glm::vec3 texture_mean(const Texture& texture);

/// All texels of the finest level, row 0 at the top: R, G, B, or one channel that stands for all three.
/// Throws FileError if the texture's file has changed since it was opened.
Image texture_image(const Texture& texture);

/// Shape of the specular lobe about the mirror direction: a perfect mirror; microfacets with normals
/// distributed after Trowbridge and Reitz (GGX; Walter et al., "Microfacet models for refraction through
/// rough surfaces", EGSR 2007); or (r·l)^N, normalised ([EMT] eq. 17).
enum class SpecularLobe { mirror, ggx, phong };

template <>
struct EnumNames<SpecularLobe> {
  static constexpr std::string_view what = "lobe";
  static constexpr auto names = enum_names("mirror", "ggx", "phong");
};

/// How diffuse and specular light add up ([EMT] §3; spec F5): `additive` is F·L_m + L_d, `coated` is
/// F·L_m + (1−F)·L_d, for a diffuse body under a clear coat.
enum class LayerModel { additive, coated };

template <>
struct EnumNames<LayerModel> {
  static constexpr std::string_view what = "layers";
  static constexpr auto names = enum_names("additive", "coated");
};

struct Material {
  std::string name;
  glm::vec3 albedo{0.5F};           ///< Lambertian reflectance, in [0,1]
  TextureReference albedo_texture;  ///< multiplies `albedo`
  bool specular = false;            ///< has a specular lobe, weighted by `fresnel`
  Fresnel fresnel;
  TextureReference specular_texture;  ///< multiplies fresnel.r0; for constant and Schlick's reflectance only
  SpecularLobe lobe = SpecularLobe::mirror;
  float roughness = 0.1F;              ///< of the lobe `ggx`: its α, in (0,1]
  TextureReference roughness_texture;  ///< its first channel multiplies `roughness`
  float exponent = 100.0F;             ///< of the lobe `phong`: N, in [1, 1e6]
  LayerModel layers = LayerModel::additive;
  glm::vec3 emission{0.0F};           ///< radiance emitted on the front side, W sr⁻¹ m⁻²
  TextureReference emission_texture;  ///< multiplies `emission`
  float opacity = 1.0F;               ///< part of the surface that is there, in [0,1]: rays pass between
  TextureReference opacity_texture;   ///< its first channel multiplies `opacity`; its texels are in memory
  /// All is there where the opacity is at least this, nothing elsewhere
  std::optional<float> opacity_cutoff;
  /// Bends the shading normal as glTF 2.0 §3.9.3 has it: texels (x, y, z)/2 + 1/2 in the frame of the mesh's
  /// tangent, bitangent and normal. Without tangents: of ∂p/∂u, ∂p/∂v, with v up, and the normal.
  TextureReference normal_texture;
  float normal_scale = 1.0F;             ///< of the texels' x and y
  bool colors_tint_reflectance = false;  ///< the mesh's colours multiply fresnel.r0, too: of a metal
};

/// A set of the kinds of rays that see an object.
enum class Visibility : std::uint8_t {
  none = 0,
  camera = 1,      ///< rays from the eye, and those of a capture
  reflection = 2,  ///< rays that leave a surface, specular or diffuse
  shadow = 4,      ///< rays towards a light
  all = 7
};

constexpr Visibility operator|(Visibility a, Visibility b) {
  return static_cast<Visibility>(static_cast<std::uint8_t>(a) | static_cast<std::uint8_t>(b));
}
constexpr Visibility operator&(Visibility a, Visibility b) {
  return static_cast<Visibility>(static_cast<std::uint8_t>(a) & static_cast<std::uint8_t>(b));
}

/// One thing of the scene: what a capture hides, and what a reflector is, are objects.
struct Object {
  std::string name;
  TriangleMesh mesh;                    ///< in world space
  int material = 0;                     ///< index into Scene::materials
  std::vector<std::string> part_names;  ///< e.g. {"body", "lid"}; empty: one part, named as the object
  Visibility visibility = Visibility::all;
  /// One per part, indices into Scene::materials; empty: all parts are of `material`.
  std::vector<int> part_materials = {};
};

/// Index of the material of an object's triangle.
inline int material_of(const Object& object, std::size_t triangle) {
  if (object.part_materials.empty()) return object.material;
  return object.part_materials[object.mesh.parts.empty() ? 0 : object.mesh.parts[triangle]];
}

/// Indices of the materials of an object's parts, each once, in order.
std::vector<int> materials_of(const Object& object);

/// A one-sided rectangle `corner + a·edge_u + b·edge_v`, a and b in [0,1], that emits along edge_u × edge_v.
/// It is visible to rays. Meshes emit too: by their material's emission.
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

/// A sphere that emits outwards. It is visible to rays.
struct SphereLight {
  glm::vec3 centre{0.0F};
  float radius = 0.1F;
  glm::vec3 radiance{1.0F};  ///< W sr⁻¹ m⁻²
};

/// Parallel light from infinity.
struct DirectionalLight {
  glm::vec3 direction{0.0F, -1.0F, 0.0F};  ///< unit, the way the light travels
  glm::vec3 irradiance{1.0F};              ///< of a surface that faces it, W m⁻²
};

/// A point that shines into a cone. Angles are measured from its axis: the intensity is full up to
/// `inner_degrees` and falls to 0 at `outer_degrees`, between them as KHR_lights_punctual has it.
struct SpotLight {
  glm::vec3 position{0.0F};
  glm::vec3 direction{0.0F, -1.0F, 0.0F};  ///< unit, the axis, the way the light travels
  glm::vec3 intensity{1.0F};               ///< along the axis, W sr⁻¹
  float inner_degrees = 0.0F;              ///< in [0, outer_degrees)
  float outer_degrees = 45.0F;             ///< in (0, 90]
};

/// The part of a spot light's intensity that it sends at an angle to its axis, in [0,1]. `cosine` is that
/// angle's. The square of a ramp over the cosine, from KHR_lights_punctual, "Inner and Outer Cone Angles".
float spot_falloff(const SpotLight& light, float cosine);

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
  std::vector<Texture> textures;
  std::vector<RectangleLight> rectangle_lights;
  std::vector<SphereLight> sphere_lights;
  std::vector<PointLight> point_lights;
  std::vector<DirectionalLight> directional_lights;
  std::vector<SpotLight> spot_lights;
  std::optional<EnvironmentLight> environment;
};

/// Value of a texture, which must be in the scene, for a mesh's coordinates `uv`, v up.
glm::vec3 texture_lookup(const Scene& scene, const TextureReference& reference, glm::vec2 uv);

/// Whether rays pass through some of the surface.
bool has_gaps(const Material& material);

/// One object of all the objects of a scene, in their order: a part each, named as the object, or, if there
/// are more than `most_parts`, a part for each material, named as that. What only some of the meshes have is
/// completed: flat normals, coordinates (0, 0), white. Throws InvalidArgument if the scene has no objects.
Object join_objects(const Scene& scene, const std::string& name, std::size_t most_parts);

/// Adds copies of another scene's textures and materials; returns the index of the first material.
int add_materials(Scene& scene, const Scene& from);

/// Whether any part of an object has a specular lobe, or gaps.
bool is_specular(const Scene& scene, const Object& object);
bool has_gaps(const Scene& scene, const Object& object);

/// The part of a surface that is there for a mesh's coordinates `uv`, v up: 0 or 1 if the material has a
/// cutoff.
float opacity_at(const Scene& scene, const Material& material, glm::vec2 uv);

/// Throws InvalidArgument if anything in the scene is unusable: indices out of range, arrays of unequal
/// length, vertices that are not finite or beyond ±1e12, normals that are not unit vectors, a mesh without
/// area (single triangles may be degenerate), albedo, texels or reflectance outside [0,1], a lobe's roughness
/// or exponent out of range, negative radiance, directions of lights that are not unit vectors, cones out of
/// order. The message names the object, material, texture or light, the field, its value and what was
/// expected.
void validate(const Scene& scene);

/// The same for one mesh.
void validate(const TriangleMesh& mesh);

/// Moves everything that has a place: objects, and lights that are not at infinity.
void translate(Scene& scene, glm::dvec3 by);

/// How often a mesh winds about a point: 1 inside of a closed mesh, 0 outside, else between. The sum of the
/// triangles' signed solid angles over 4π (van Oosterom and Strackee, The solid angle of a plane triangle,
/// IEEE Trans. Biomed. Eng. 30(2), 1983). Exactly 0 outside of the bounding box.
double winding_number(const TriangleMesh& mesh, glm::dvec3 point);

/// Whether a point, such as an eye, lies inside of a body: whether the winding number is above ½, so that
/// bodies need not be closed (the teapot is open under its lid).
bool encloses(const TriangleMesh& mesh, glm::dvec3 point);

/// Axis-aligned bounds of a mesh's vertices. Throws InvalidArgument if there are none.
struct Bounds {
  glm::vec3 min{0.0F};
  glm::vec3 max{0.0F};
};
Bounds bounds(const TriangleMesh& mesh);

}  // namespace mirrorbake
