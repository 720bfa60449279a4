#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake {
namespace {

/// A mesh with a vertex of its own for every corner, and the facets' normals.
TriangleMesh faceted(const TriangleMesh& mesh) {
  TriangleMesh flat;
  flat.parts = mesh.parts;
  for (const glm::uvec3 t : mesh.triangles) {
    const glm::dvec3 a(mesh.positions[t.x]);
    const glm::dvec3 n = glm::cross(glm::dvec3(mesh.positions[t.y]) - a, glm::dvec3(mesh.positions[t.z]) - a);
    const double length = glm::length(n);
    const glm::vec3 normal = length > 0.0 ? glm::vec3(n / length) : glm::vec3(0.0F, 1.0F, 0.0F);
    const auto first = static_cast<std::uint32_t>(flat.positions.size());
    for (int k = 0; k < 3; ++k) {
      flat.positions.push_back(mesh.positions[t[k]]);
      flat.normals.push_back(normal);
      if (!mesh.uvs.empty()) flat.uvs.push_back(mesh.uvs[t[k]]);
      if (!mesh.colors.empty()) flat.colors.push_back(mesh.colors[t[k]]);
    }
    flat.triangles.push_back({first, first + 1, first + 2});
  }
  return flat;
}

template <typename Element>
void append(std::vector<Element>& all, const std::vector<Element>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

}  // namespace

Object join_objects(const Scene& scene, const std::string& name, std::size_t most_parts) {
  if (scene.objects.empty()) throw InvalidArgument("scene", "no objects", "at least one");
  const auto any = [&](const auto& test) {
    return std::any_of(scene.objects.begin(), scene.objects.end(),
                       [&](const Object& object) { return test(object.mesh); });
  };
  const bool has_normals = any([](const TriangleMesh& mesh) { return !mesh.normals.empty(); });
  const bool has_uvs = any([](const TriangleMesh& mesh) { return !mesh.uvs.empty(); });
  const bool has_colors = any([](const TriangleMesh& mesh) { return !mesh.colors.empty(); });
  const bool has_tangents = any([](const TriangleMesh& mesh) { return !mesh.tangents.empty(); });

  Object joined;
  joined.name = name;
  // Parts of the objects, by the objects' own parts or by materials.
  std::size_t part_count = 0;
  for (const Object& object : scene.objects) part_count += std::max<std::size_t>(1, object.part_names.size());
  const bool by_material =
      part_count > std::min<std::size_t>(most_parts, std::numeric_limits<std::uint16_t>::max());
  std::vector<int> part_of_material(scene.materials.size(), -1);
  const auto new_part = [&](const std::string& part, int material) {
    joined.part_names.push_back(part);
    joined.part_materials.push_back(material);
    return joined.part_names.size() - 1;
  };
  for (const Object& object : scene.objects) {
    const TriangleMesh mesh = has_normals && object.mesh.normals.empty() ? faceted(object.mesh) : object.mesh;
    const std::size_t first_part = joined.part_names.size();
    if (!by_material) {
      const std::size_t own = std::max<std::size_t>(1, object.part_names.size());
      for (std::size_t i = 0; i < own; ++i) {
        const std::string part = own == 1 ? object.name : object.name + "/" + object.part_names[i];
        new_part(part, object.part_materials.empty() ? object.material : object.part_materials[i]);
      }
    }
    const auto first_vertex = static_cast<std::uint32_t>(joined.mesh.positions.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      joined.mesh.triangles.push_back(mesh.triangles[i] + first_vertex);
      std::size_t part = first_part + (mesh.parts.empty() ? 0 : mesh.parts[i]);
      if (by_material) {
        int& known = part_of_material[static_cast<std::size_t>(material_of(object, i))];
        if (known < 0) {
          const Material& material = scene.materials[static_cast<std::size_t>(material_of(object, i))];
          known = static_cast<int>(new_part(material.name, material_of(object, i)));
        }
        part = static_cast<std::size_t>(known);
      }
      joined.mesh.parts.push_back(static_cast<std::uint16_t>(part));
    }
    append(joined.mesh.positions, mesh.positions);
    append(joined.mesh.normals, mesh.normals);
    append(joined.mesh.uvs, mesh.uvs);
    append(joined.mesh.colors, mesh.colors);
    append(joined.mesh.tangents, mesh.tangents);
    if (has_uvs) joined.mesh.uvs.resize(joined.mesh.positions.size(), glm::vec2(0.0F));
    if (has_colors) joined.mesh.colors.resize(joined.mesh.positions.size(), glm::vec3(1.0F));
    if (has_tangents) joined.mesh.tangents.resize(joined.mesh.positions.size(), glm::vec4(0.0F));
  }
  joined.material = joined.part_materials.front();
  return joined;
}

int add_materials(Scene& scene, const Scene& from) {
  const auto textures = static_cast<int>(scene.textures.size());
  const auto first = static_cast<int>(scene.materials.size());
  append(scene.textures, from.textures);
  for (Material material : from.materials) {
    for (TextureReference* reference :
         {&material.albedo_texture, &material.specular_texture, &material.roughness_texture,
          &material.emission_texture, &material.opacity_texture, &material.normal_texture}) {
      if (reference->texture >= 0) reference->texture += textures;
    }
    scene.materials.push_back(std::move(material));
  }
  return first;
}

}  // namespace mirrorbake
