#include "mirrorbake/scene/scene.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

// Embree calls coordinates above 1.844e18 invalid, and squared distances must stay finite in float32.
constexpr float kMaxCoordinate = 1e12F;
// How far from 1 the length of a vertex normal may be: normals stored as 8-bit integers pass.
constexpr float kNormalTolerance = 1e-2F;

bool is_finite(float v) { return std::isfinite(v); }
bool is_finite(glm::vec2 v) { return std::isfinite(v.x) && std::isfinite(v.y); }
bool is_finite(glm::vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// A comparison with NaN is false, so each of these rejects it.
bool in_unit_interval(glm::vec3 v) {
  return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x <= 1 && v.y <= 1 && v.z <= 1;
}
bool is_unit(glm::vec3 v) { return std::abs(glm::length(v) - 1.0F) <= kNormalTolerance; }
bool is_finite_positive(glm::vec3 v) { return is_finite(v) && v.x > 0 && v.y > 0 && v.z > 0; }
bool is_finite_nonnegative(glm::vec3 v) { return is_finite(v) && v.x >= 0 && v.y >= 0 && v.z >= 0; }

std::string label(std::string_view kind, std::size_t index, std::string_view name) {
  std::string result = std::string(kind) + " " + std::to_string(index);
  if (!name.empty()) result += " '" + std::string(name) + "'";
  return result;
}

void check_pixel_count(const std::string& where, const Image& image) {
  if (image.width < 1 || image.height < 1) {
    throw InvalidArgument(where,
                          std::to_string(image.width) + " × " + std::to_string(image.height) + " pixels",
                          "at least one pixel");
  }
  const std::size_t count =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * image.channels.size();
  if (image.pixels.size() != count) {
    throw InvalidArgument(where + " number of values", std::to_string(image.pixels.size()),
                          std::to_string(count));
  }
}

void check_channel_count(const std::string& where, const Image& image, std::initializer_list<int> expected) {
  std::vector<std::string> counts;
  for (const int count : expected) {
    if (image.channel_count() == count) return;
    counts.push_back(std::to_string(count));
  }
  throw InvalidArgument(where + " channel count", std::to_string(image.channel_count()), listed(counts));
}

void check_texels(const std::string& where, const Image& image, float maximum, std::string_view expected) {
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const float v = image.pixels[i];
    if (v >= 0.0F && v <= maximum) continue;
    const std::size_t channels = image.channels.size();
    const std::size_t pixel = i / channels;
    const std::size_t width = static_cast<std::size_t>(image.width);
    throw InvalidArgument(where + " pixel (" + std::to_string(pixel % width) + ", " +
                              std::to_string(pixel / width) + ") channel " + std::to_string(i % 3),
                          text_of(v), expected);
  }
}

void check_reference(const Scene& scene, const std::string& where, const TextureReference& reference) {
  if (reference.texture < -1 || reference.texture >= static_cast<int>(scene.textures.size())) {
    throw InvalidArgument(where, std::to_string(reference.texture),
                          "-1 or an index below " + std::to_string(scene.textures.size()));
  }
  if (!is_finite(reference.offset) || !is_finite(reference.scale) || !is_finite(reference.rotation)) {
    throw InvalidArgument(where + " transform",
                          "offset " + text_of(reference.offset) + ", scale " + text_of(reference.scale) +
                              ", rotation " + text_of(reference.rotation),
                          "finite values");
  }
}

void check_opacity(const Scene& scene, const std::string& where, const Material& material) {
  if (!(material.opacity >= 0.0F && material.opacity <= 1.0F)) {
    throw InvalidArgument(where + " opacity", text_of(material.opacity), "a value in [0, 1]");
  }
  if (material.opacity_cutoff && !(*material.opacity_cutoff >= 0.0F && is_finite(*material.opacity_cutoff))) {
    throw InvalidArgument(where + " opacity_cutoff", text_of(*material.opacity_cutoff),
                          "a finite value of at least 0");
  }
  check_reference(scene, where + " opacity_texture", material.opacity_texture);
  const int texture = material.opacity_texture.texture;
  if (texture >= 0 && scene.textures[static_cast<std::size_t>(texture)].file != nullptr) {
    throw InvalidArgument(where + " opacity_texture", "a file", "a texture in memory");
  }
}

void check_material(const Scene& scene, std::size_t index) {
  const Material& material = scene.materials[index];
  const std::string where = label("material", index, material.name);
  if (!in_unit_interval(material.albedo)) {
    throw InvalidArgument(where + " albedo", text_of(material.albedo), "values in [0, 1]");
  }
  check_reference(scene, where + " albedo_texture", material.albedo_texture);
  if (!is_finite_nonnegative(material.emission)) {
    throw InvalidArgument(where + " emission", text_of(material.emission), "finite values of at least 0");
  }
  check_reference(scene, where + " emission_texture", material.emission_texture);
  check_opacity(scene, where, material);
  check_reference(scene, where + " normal_texture", material.normal_texture);
  if (!is_finite(material.normal_scale)) {
    throw InvalidArgument(where + " normal_scale", text_of(material.normal_scale), "a finite number");
  }
  if (!material.specular) return;
  check_reference(scene, where + " specular_texture", material.specular_texture);
  check_reference(scene, where + " roughness_texture", material.roughness_texture);
  if (material.lobe == SpecularLobe::ggx && !(material.roughness > 0.0F && material.roughness <= 1.0F)) {
    throw InvalidArgument(where + " roughness", text_of(material.roughness), "a value in (0, 1]");
  }
  if (material.lobe == SpecularLobe::phong && !(material.exponent >= 1.0F && material.exponent <= 1e6F)) {
    throw InvalidArgument(where + " exponent", text_of(material.exponent), "a value in [1, 1e6]");
  }
  const Fresnel& fresnel = material.fresnel;
  switch (fresnel.model) {
    case FresnelModel::constant:
    case FresnelModel::schlick:
      if (!in_unit_interval(fresnel.r0)) {
        throw InvalidArgument(where + " fresnel r0", text_of(fresnel.r0), "values in [0, 1]");
      }
      break;
    case FresnelModel::conductor:
      if (!is_finite_nonnegative(fresnel.k)) {
        throw InvalidArgument(where + " fresnel k", text_of(fresnel.k), "finite values of at least 0");
      }
      [[fallthrough]];
    case FresnelModel::dielectric:
      if (!is_finite_positive(fresnel.eta)) {
        throw InvalidArgument(where + " fresnel eta", text_of(fresnel.eta), "finite values above 0");
      }
      break;
  }
}

double triangle_area(const TriangleMesh& mesh, glm::uvec3 triangle) {
  const glm::dvec3 a(mesh.positions[triangle.x]);
  const glm::dvec3 b(mesh.positions[triangle.y]);
  const glm::dvec3 c(mesh.positions[triangle.z]);
  return 0.5 * glm::length(glm::cross(b - a, c - a));
}

void check_mesh(const std::string& where, const TriangleMesh& mesh, std::size_t part_count) {
  const std::size_t vertex_count = mesh.positions.size();
  if (vertex_count > std::numeric_limits<std::uint32_t>::max()) {
    throw InvalidArgument(where + " vertex count", std::to_string(vertex_count), "fewer than 2^32");
  }
  for (std::size_t i = 0; i < vertex_count; ++i) {
    const glm::vec3 p = mesh.positions[i];
    if (!is_finite(p) || std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > kMaxCoordinate) {
      throw InvalidArgument(where + " vertex " + std::to_string(i), text_of(p),
                            "finite coordinates up to 1e12");
    }
  }
  if (!mesh.colors.empty() && mesh.colors.size() != vertex_count) {
    throw InvalidArgument(where + " colour count", std::to_string(mesh.colors.size()),
                          "0 or the vertex count " + std::to_string(vertex_count));
  }
  for (std::size_t i = 0; i < mesh.colors.size(); ++i) {
    if (!in_unit_interval(mesh.colors[i])) {
      throw InvalidArgument(where + " colour " + std::to_string(i), text_of(mesh.colors[i]),
                            "values in [0, 1]");
    }
  }
  if (!mesh.normals.empty() && mesh.normals.size() != vertex_count) {
    throw InvalidArgument(where + " normal count", std::to_string(mesh.normals.size()),
                          "0 or the vertex count " + std::to_string(vertex_count));
  }
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    if (!is_unit(mesh.normals[i])) {
      throw InvalidArgument(where + " normal " + std::to_string(i), text_of(mesh.normals[i]),
                            "a unit vector");
    }
  }
  if (!mesh.tangents.empty() && mesh.tangents.size() != vertex_count) {
    throw InvalidArgument(where + " tangent count", std::to_string(mesh.tangents.size()),
                          "0 or the vertex count " + std::to_string(vertex_count));
  }
  for (std::size_t i = 0; i < mesh.tangents.size(); ++i) {
    const glm::vec4 t = mesh.tangents[i];
    if (t != glm::vec4(0.0F) && !(is_unit(glm::vec3(t)) && std::abs(t.w) == 1.0F)) {
      throw InvalidArgument(where + " tangent " + std::to_string(i),
                            text_of(glm::vec3(t)) + " with the sign " + text_of(t.w),
                            "a unit vector with the sign 1 or -1, or zeros");
    }
  }
  if (!mesh.uvs.empty() && mesh.uvs.size() != vertex_count) {
    throw InvalidArgument(where + " uv count", std::to_string(mesh.uvs.size()),
                          "0 or the vertex count " + std::to_string(vertex_count));
  }
  for (std::size_t i = 0; i < mesh.uvs.size(); ++i) {
    if (!is_finite(mesh.uvs[i])) {
      throw InvalidArgument(where + " uv " + std::to_string(i), text_of(mesh.uvs[i]), "finite values");
    }
  }
  double area = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3 t = mesh.triangles[i];
    const std::uint32_t largest = std::max({t.x, t.y, t.z});
    if (largest >= vertex_count) {
      throw InvalidArgument(where + " triangle " + std::to_string(i) + " vertex index",
                            std::to_string(largest),
                            "less than the vertex count " + std::to_string(vertex_count));
    }
    area += triangle_area(mesh, t);
  }
  if (!(area > 0.0))
    throw InvalidArgument(where + " area", text_of(area), "at least one triangle with an area");
  if (!mesh.parts.empty() && mesh.parts.size() != mesh.triangles.size()) {
    throw InvalidArgument(where + " part index count", std::to_string(mesh.parts.size()),
                          "0 or the triangle count " + std::to_string(mesh.triangles.size()));
  }
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    if (mesh.parts[i] >= part_count) {
      throw InvalidArgument(where + " part of triangle " + std::to_string(i), std::to_string(mesh.parts[i]),
                            "less than the number of parts " + std::to_string(part_count));
    }
  }
}

void check_object(const Scene& scene, std::size_t index) {
  const Object& object = scene.objects[index];
  const std::string where = label("object", index, object.name);
  if (object.material < 0 || object.material >= static_cast<int>(scene.materials.size())) {
    throw InvalidArgument(where + " material", std::to_string(object.material),
                          "an index below " + std::to_string(scene.materials.size()));
  }
  const std::size_t parts = std::max<std::size_t>(1, object.part_names.size());
  if (!object.part_materials.empty() && object.part_materials.size() != parts) {
    throw InvalidArgument(where + " part material count", std::to_string(object.part_materials.size()),
                          "0 or the number of parts " + std::to_string(parts));
  }
  for (std::size_t i = 0; i < object.part_materials.size(); ++i) {
    if (object.part_materials[i] >= 0 && object.part_materials[i] < static_cast<int>(scene.materials.size()))
      continue;
    throw InvalidArgument(where + " material of part " + std::to_string(i),
                          std::to_string(object.part_materials[i]),
                          "an index below " + std::to_string(scene.materials.size()));
  }
  check_mesh(where, object.mesh, parts);
}

void check_position(const std::string& where, glm::vec3 position) {
  if (!is_finite(position)) throw InvalidArgument(where, text_of(position), "finite coordinates");
}

void check_radiance(const std::string& where, glm::vec3 radiance) {
  if (!is_finite_nonnegative(radiance)) {
    throw InvalidArgument(where, text_of(radiance), "finite values of at least 0");
  }
}

void check_direction(const std::string& where, glm::vec3 direction) {
  if (!is_unit(direction)) throw InvalidArgument(where, text_of(direction), "a unit vector");
}

void check_light(const std::string& where, const RectangleLight& light) {
  check_position(where + " corner", light.corner);
  check_position(where + " edge_u", light.edge_u);
  check_position(where + " edge_v", light.edge_v);
  const double area = glm::length(glm::cross(glm::dvec3(light.edge_u), glm::dvec3(light.edge_v)));
  if (!(area > 0.0)) throw InvalidArgument(where + " area", text_of(area), "edges that span an area");
  check_radiance(where + " radiance", light.radiance);
}

void check_light(const std::string& where, const SphereLight& light) {
  check_position(where + " centre", light.centre);
  if (!(light.radius > 0.0F && light.radius <= kMaxCoordinate)) {
    throw InvalidArgument(where + " radius", text_of(light.radius), "a length in (0, 1e12]");
  }
  check_radiance(where + " radiance", light.radiance);
}

void check_light(const std::string& where, const PointLight& light) {
  check_position(where + " position", light.position);
  check_radiance(where + " intensity", light.intensity);
}

void check_light(const std::string& where, const DirectionalLight& light) {
  check_direction(where + " direction", light.direction);
  check_radiance(where + " irradiance", light.irradiance);
}

void check_light(const std::string& where, const SpotLight& light) {
  check_position(where + " position", light.position);
  check_direction(where + " direction", light.direction);
  check_radiance(where + " intensity", light.intensity);
  if (!(light.outer_degrees > 0.0F && light.outer_degrees <= 90.0F)) {
    throw InvalidArgument(where + " outer_degrees", text_of(light.outer_degrees), "an angle in (0, 90]");
  }
  if (!(light.inner_degrees >= 0.0F && light.inner_degrees < light.outer_degrees)) {
    throw InvalidArgument(where + " inner_degrees", text_of(light.inner_degrees),
                          "an angle from 0 to below outer_degrees, " + text_of(light.outer_degrees));
  }
}

void check_light(const std::string& where, const EnvironmentLight& light) {
  check_pixel_count(where + " panorama", light.panorama);
  check_channel_count(where + " panorama", light.panorama, {3});
  check_texels(where + " panorama", light.panorama, std::numeric_limits<float>::max(),
               "a finite value of at least 0");
  if (!(light.scale >= 0.0F) || !is_finite(light.scale)) {
    throw InvalidArgument(where + " scale", text_of(light.scale), "a finite value of at least 0");
  }
  if (!is_finite(light.rotation_degrees)) {
    throw InvalidArgument(where + " rotation_degrees", text_of(light.rotation_degrees), "a finite angle");
  }
}

}  // namespace

float spot_falloff(const SpotLight& light, float cosine) {
  const float inner = std::cos(glm::radians(light.inner_degrees));
  const float outer = std::cos(glm::radians(light.outer_degrees));
  const float ramp = std::clamp((cosine - outer) / std::max(0.001F, inner - outer), 0.0F, 1.0F);
  return ramp * ramp;
}

void validate(const Scene& scene) {
  for (std::size_t i = 0; i < scene.textures.size(); ++i) {
    const std::string where = label("texture", i, "");
    if (scene.textures[i].file) continue;  // checked when it was opened
    check_channel_count(where, scene.textures[i].image, {1, 3});
    check_pixel_count(where, scene.textures[i].image);
    check_texels(where, scene.textures[i].image, 1.0F, "a value in [0, 1]");
  }
  for (std::size_t i = 0; i < scene.materials.size(); ++i) check_material(scene, i);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) check_object(scene, i);
  const auto check_lights = [](std::string_view kind, const auto& lights) {
    for (std::size_t i = 0; i < lights.size(); ++i) check_light(label(kind, i, ""), lights[i]);
  };
  check_lights("rectangle light", scene.rectangle_lights);
  check_lights("sphere light", scene.sphere_lights);
  check_lights("point light", scene.point_lights);
  check_lights("directional light", scene.directional_lights);
  check_lights("spot light", scene.spot_lights);
  if (scene.environment) check_light("environment", *scene.environment);
}

void validate(const TriangleMesh& mesh) {
  check_mesh("mesh", mesh, std::size_t{std::numeric_limits<std::uint16_t>::max()} + 1);
}

void translate(Scene& scene, glm::dvec3 by) {
  const auto move = [by](glm::vec3& p) { p = glm::vec3(glm::dvec3(p) + by); };
  for (Object& object : scene.objects) {
    for (glm::vec3& p : object.mesh.positions) move(p);
  }
  for (RectangleLight& light : scene.rectangle_lights) move(light.corner);
  for (SphereLight& light : scene.sphere_lights) move(light.centre);
  for (PointLight& light : scene.point_lights) move(light.position);
  for (SpotLight& light : scene.spot_lights) move(light.position);
}

Bounds bounds(const TriangleMesh& mesh) {
  if (mesh.positions.empty()) throw InvalidArgument("mesh vertex count", "0", "at least one vertex");
  Bounds box{mesh.positions.front(), mesh.positions.front()};
  for (const glm::vec3 p : mesh.positions) {
    box.min = glm::min(box.min, p);
    box.max = glm::max(box.max, p);
  }
  return box;
}

}  // namespace mirrorbake
