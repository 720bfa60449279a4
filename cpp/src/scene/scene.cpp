#include "mirrorbake/scene/scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace {

// Embree calls coordinates above 1.844e18 invalid, and squared distances must stay finite in float32.
constexpr float kMaxCoordinate = 1e12F;
// How far from 1 the length of a vertex normal may be: normals stored as 8-bit integers pass.
constexpr float kNormalTolerance = 1e-2F;

std::string text(float v) { return std::to_string(v); }
std::string text(glm::vec3 v) { return "(" + text(v.x) + ", " + text(v.y) + ", " + text(v.z) + ")"; }

bool is_finite(float v) { return std::isfinite(v); }
bool is_finite(glm::vec2 v) { return std::isfinite(v.x) && std::isfinite(v.y); }
bool is_finite(glm::vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// A comparison with NaN is false, so each of these rejects it.
bool in_unit_interval(glm::vec3 v) {
  return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x <= 1 && v.y <= 1 && v.z <= 1;
}
bool is_finite_positive(glm::vec3 v) { return is_finite(v) && v.x > 0 && v.y > 0 && v.z > 0; }
bool is_finite_nonnegative(glm::vec3 v) { return is_finite(v) && v.x >= 0 && v.y >= 0 && v.z >= 0; }

std::string label(std::string_view kind, std::size_t index, std::string_view name) {
  std::string result = std::string(kind) + " " + std::to_string(index);
  if (!name.empty()) result += " '" + std::string(name) + "'";
  return result;
}

void check_image(const std::string& where, const Image& image) {
  if (image.width < 1 || image.height < 1) {
    throw InvalidArgument(where,
                          std::to_string(image.width) + " × " + std::to_string(image.height) + " pixels",
                          "at least one pixel");
  }
  if (image.channel_count() != 3) {
    throw InvalidArgument(where + " channel count", std::to_string(image.channel_count()), "3");
  }
  const std::size_t count =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 3;
  if (image.pixels.size() != count) {
    throw InvalidArgument(where + " number of values", std::to_string(image.pixels.size()),
                          std::to_string(count));
  }
}

void check_texels(const std::string& where, const Image& image, float maximum, std::string_view expected) {
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const float v = image.pixels[i];
    if (v >= 0.0F && v <= maximum) continue;
    const std::size_t pixel = i / 3;
    const std::size_t width = static_cast<std::size_t>(image.width);
    throw InvalidArgument(where + " pixel (" + std::to_string(pixel % width) + ", " +
                              std::to_string(pixel / width) + ") channel " + std::to_string(i % 3),
                          text(v), expected);
  }
}

void check_material(const Scene& scene, std::size_t index) {
  const Material& material = scene.materials[index];
  const std::string where = label("material", index, material.name);
  if (!in_unit_interval(material.albedo)) {
    throw InvalidArgument(where + " albedo", text(material.albedo), "values in [0, 1]");
  }
  if (material.albedo_texture < -1 || material.albedo_texture >= static_cast<int>(scene.textures.size())) {
    throw InvalidArgument(where + " albedo_texture", std::to_string(material.albedo_texture),
                          "-1 or an index below " + std::to_string(scene.textures.size()));
  }
  if (!is_finite_nonnegative(material.emission)) {
    throw InvalidArgument(where + " emission", text(material.emission), "finite values of at least 0");
  }
  if (!material.specular) return;
  const Fresnel& fresnel = material.fresnel;
  switch (fresnel.model) {
    case FresnelModel::constant:
    case FresnelModel::schlick:
      if (!in_unit_interval(fresnel.r0)) {
        throw InvalidArgument(where + " fresnel r0", text(fresnel.r0), "values in [0, 1]");
      }
      break;
    case FresnelModel::conductor:
      if (!is_finite_nonnegative(fresnel.k)) {
        throw InvalidArgument(where + " fresnel k", text(fresnel.k), "finite values of at least 0");
      }
      [[fallthrough]];
    case FresnelModel::dielectric:
      if (!is_finite_positive(fresnel.eta)) {
        throw InvalidArgument(where + " fresnel eta", text(fresnel.eta), "finite values above 0");
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
      throw InvalidArgument(where + " vertex " + std::to_string(i), text(p), "finite coordinates up to 1e12");
    }
  }
  if (!mesh.normals.empty() && mesh.normals.size() != vertex_count) {
    throw InvalidArgument(where + " normal count", std::to_string(mesh.normals.size()),
                          "0 or the vertex count " + std::to_string(vertex_count));
  }
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    if (!(std::abs(glm::length(mesh.normals[i]) - 1.0F) <= kNormalTolerance)) {
      throw InvalidArgument(where + " normal " + std::to_string(i), text(mesh.normals[i]), "a unit vector");
    }
  }
  if (!mesh.uvs.empty() && mesh.uvs.size() != vertex_count) {
    throw InvalidArgument(where + " uv count", std::to_string(mesh.uvs.size()),
                          "0 or the vertex count " + std::to_string(vertex_count));
  }
  for (std::size_t i = 0; i < mesh.uvs.size(); ++i) {
    if (!is_finite(mesh.uvs[i])) {
      throw InvalidArgument(where + " uv " + std::to_string(i),
                            "(" + text(mesh.uvs[i].x) + ", " + text(mesh.uvs[i].y) + ")", "finite values");
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
    throw InvalidArgument(where + " area", std::to_string(area), "at least one triangle with an area");
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
  check_mesh(where, object.mesh, std::max<std::size_t>(1, object.part_names.size()));
}

void check_light(const std::string& where, const RectangleLight& light) {
  if (!is_finite(light.corner))
    throw InvalidArgument(where + " corner", text(light.corner), "finite coordinates");
  if (!is_finite(light.edge_u))
    throw InvalidArgument(where + " edge_u", text(light.edge_u), "finite coordinates");
  if (!is_finite(light.edge_v))
    throw InvalidArgument(where + " edge_v", text(light.edge_v), "finite coordinates");
  const double area = glm::length(glm::cross(glm::dvec3(light.edge_u), glm::dvec3(light.edge_v)));
  if (!(area > 0.0)) throw InvalidArgument(where + " area", std::to_string(area), "edges that span an area");
  if (!is_finite_nonnegative(light.radiance)) {
    throw InvalidArgument(where + " radiance", text(light.radiance), "finite values of at least 0");
  }
}

void check_light(const std::string& where, const PointLight& light) {
  if (!is_finite(light.position))
    throw InvalidArgument(where + " position", text(light.position), "finite coordinates");
  if (!is_finite_nonnegative(light.intensity)) {
    throw InvalidArgument(where + " intensity", text(light.intensity), "finite values of at least 0");
  }
}

void check_light(const std::string& where, const EnvironmentLight& light) {
  check_image(where + " panorama", light.panorama);
  check_texels(where + " panorama", light.panorama, std::numeric_limits<float>::max(),
               "a finite value of at least 0");
  if (!(light.scale >= 0.0F) || !is_finite(light.scale)) {
    throw InvalidArgument(where + " scale", text(light.scale), "a finite value of at least 0");
  }
  if (!is_finite(light.rotation_degrees)) {
    throw InvalidArgument(where + " rotation_degrees", text(light.rotation_degrees), "a finite angle");
  }
}

}  // namespace

void validate(const Scene& scene) {
  for (std::size_t i = 0; i < scene.textures.size(); ++i) {
    const std::string where = label("texture", i, "");
    check_image(where, scene.textures[i]);
    check_texels(where, scene.textures[i], 1.0F, "a value in [0, 1]");
  }
  for (std::size_t i = 0; i < scene.materials.size(); ++i) check_material(scene, i);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) check_object(scene, i);
  for (std::size_t i = 0; i < scene.rectangle_lights.size(); ++i) {
    check_light(label("rectangle light", i, ""), scene.rectangle_lights[i]);
  }
  for (std::size_t i = 0; i < scene.point_lights.size(); ++i) {
    check_light(label("point light", i, ""), scene.point_lights[i]);
  }
  if (scene.environment) check_light("environment", *scene.environment);
}

void validate(const TriangleMesh& mesh) {
  check_mesh("mesh", mesh, std::size_t{std::numeric_limits<std::uint16_t>::max()} + 1);
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
