#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec4.hpp>

#include "../tangents.hpp"
#include "gltf_document.hpp"
#include "gltf_materials.hpp"
#include "gltf_mesh.hpp"
#include "gltf_nodes.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "readers.hpp"
#include "scene_builder.hpp"

namespace mirrorbake {
namespace {

using gltf::element;
using gltf::fail;

float degrees(double radians) { return static_cast<float>(radians * 180.0 / std::numbers::pi); }

// Direction of a node's axis in the world.
glm::dvec3 direction(const std::string& path, const glm::dmat4& world_from_node, glm::dvec3 axis, int node) {
  const glm::dvec3 d = glm::dmat3(world_from_node) * axis;
  const double length = glm::length(d);
  if (!(length > 0.0) || !std::isfinite(length)) {
    fail(path, "node " + std::to_string(node) + " has a camera or light, but its transform has no direction");
  }
  return d / length;
}

class GltfScene {
 public:
  GltfScene(const std::string& path, const SceneOptions& options)
      : path_(path),
        options_(options),
        model_(gltf::read_document(path)),
        materials_(path_, model_, options_, warnings_, loaded_.scene) {}

  LoadedScene read() {
    for (const std::string& extension : model_.extensionsUsed) {
      if (!gltf::is_known_extension(extension)) {
        warnings_.add("the extension " + extension.substr(0, 80) + " is not supported");
      }
    }
    if (!model_.animations.empty()) warnings_.add("animations are not supported");
    std::map<int, int> uv_sets;
    LoadedMesh mesh = gltf::read_meshes(path_, model_, options_.meshes, options_.origin, [&](int material) {
      const auto it = uv_sets.find(material);
      return it != uv_sets.end() ? it->second : uv_sets[material] = materials_.uv_set(material);
    });
    drop_degenerate(path_, mesh);

    std::map<int, int> material_of;
    for (const MeshGroup& group : mesh.groups) {
      if (!material_of.contains(group.material)) material_of[group.material] = materials_.add(group.material);
    }
    loaded_.scene.objects = split_into_objects(std::move(mesh), loaded_.scene.materials, material_of);
    for (Object& object : loaded_.scene.objects) {
      const Material& material = loaded_.scene.materials[static_cast<std::size_t>(object.material)];
      if (material.normal_texture.texture >= 0) {
        derive_tangents(object.mesh);
      } else {
        object.mesh.tangents.clear();  // nothing reads them
      }
    }
    gltf::visit_nodes(path_, model_, options_.origin,
                      [&](int index, const tinygltf::Node& node, const glm::dmat4& world_from_node) {
                        add_node(index, node, world_from_node);
                      });
    loaded_.warnings = warnings_.take();
    return std::move(loaded_);
  }

 private:
  void add_node(int index, const tinygltf::Node& node, const glm::dmat4& world_from_node) {
    if (node.skin >= 0) warnings_.add("skins are not supported: the mesh stays in its bind pose");
    if (node.mesh >= 0) warn_of_what_is_lost(model_.meshes[static_cast<std::size_t>(node.mesh)]);
    if (node.camera >= 0) add_camera(index, node, world_from_node);
    const auto it = node.extensions.find("KHR_lights_punctual");
    if (it == node.extensions.end() || !it->second.Has("light")) return;
    const double number = gltf::number_property(path_, it->second, "light", -1.0, "KHR_lights_punctual");
    const bool is_index = number >= 0.0 && number < static_cast<double>(model_.lights.size());
    add_light(index, element(path_, model_.lights, is_index ? static_cast<int>(number) : -1, "light"),
              world_from_node);
  }

  void warn_of_what_is_lost(const tinygltf::Mesh& mesh) {
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
      if (!primitive.targets.empty()) warnings_.add("morph targets are not supported");
      if (primitive.mode >= TINYGLTF_MODE_POINTS && primitive.mode <= TINYGLTF_MODE_LINE_STRIP) {
        warnings_.add("points and lines are not supported");
      }
    }
  }

  void add_camera(int index, const tinygltf::Node& node, const glm::dmat4& world_from_node) {
    const tinygltf::Camera& source = element(path_, model_.cameras, node.camera, "camera");
    if (source.type != "perspective") {
      warnings_.add("cameras other than perspective ones are not supported");
      return;
    }
    const double fov = source.perspective.yfov;
    if (!(fov > 0.0 && fov < std::numbers::pi)) {
      fail(path_, "camera " + std::to_string(node.camera) + " yfov is " + text_of(fov) +
                      ", expected an angle in (0, π)");
    }
    SceneCamera camera;
    camera.name = !node.name.empty() ? node.name : source.name;
    camera.eye = position(index, world_from_node);
    const glm::dvec3 forward = direction(path_, world_from_node, {0, 0, -1}, index);
    const glm::dvec3 up = direction(path_, world_from_node, {0, 1, 0}, index);
    const glm::dvec3 upright = up - glm::dot(up, forward) * forward;  // a scale may have sheared it
    if (!(glm::length(upright) > 1e-6)) fail(path_, "node " + std::to_string(index) + " has a flat camera");
    camera.direction = glm::vec3(forward);
    camera.up = glm::vec3(glm::normalize(upright));
    camera.vertical_fov_degrees = degrees(fov);
    loaded_.cameras.push_back(std::move(camera));
  }

  glm::vec3 position(int index, const glm::dmat4& world_from_node) const {
    const glm::vec3 p(world_from_node[3]);
    if (!(glm::length(p) <= 1e12F)) {
      fail(path_, "node " + std::to_string(index) + " has a camera or light beyond 1e12");
    }
    return p;
  }

  // KHR_lights_punctual: candela, and lux for directional lights; they shine along the node's −Z axis.
  void add_light(int index, const tinygltf::Light& light, const glm::dmat4& world_from_node) {
    const std::string where = "light of node " + std::to_string(index) + " ";
    const std::vector<double> white(3, 1.0);
    const std::vector<double>& color = light.color.empty() ? white : light.color;
    if (color.size() != 3) fail(path_, where + "color is not three numbers");
    const double factor = light.intensity / static_cast<double>(options_.luminous_efficacy);
    const glm::vec3 intensity = radiance(path_, where + "intensity",
                                         glm::vec3(color[0] * factor, color[1] * factor, color[2] * factor));
    Scene& scene = loaded_.scene;
    if (light.type == "point") {
      scene.point_lights.push_back({position(index, world_from_node), intensity});
    } else if (light.type == "directional") {
      scene.directional_lights.push_back(
          {glm::vec3(direction(path_, world_from_node, {0, 0, -1}, index)), intensity});
    } else if (light.type == "spot") {
      const double inner = light.spot.innerConeAngle;
      const double outer = light.spot.outerConeAngle;
      if (!(inner >= 0.0 && std::isfinite(inner) && outer > 0.0 && std::isfinite(outer))) {
        fail(path_, where + "cone angles are " + text_of(inner) + " and " + text_of(outer) +
                        ", expected 0 ≤ inner < outer ≤ π/2");
      }
      // Exporters round both, and write a sharp edge as equal angles.
      if (inner > outer || outer > 0.5 * std::numbers::pi + 1e-6) {
        warnings_.add("cone angles of spot lights that are out of order are cut to 0 ≤ inner ≤ outer ≤ π/2");
      }
      const float outer_degrees = std::min(degrees(outer), 90.0F);
      scene.spot_lights.push_back(
          {position(index, world_from_node), glm::vec3(direction(path_, world_from_node, {0, 0, -1}, index)),
           intensity, std::min(degrees(inner), std::nextafter(outer_degrees, 0.0F)), outer_degrees});
    } else {
      fail(path_, where + "type is '" + light.type.substr(0, 40) + "', expected point, spot or directional");
    }
  }

  const std::string& path_;
  const SceneOptions& options_;
  tinygltf::Model model_;
  Warnings warnings_;
  LoadedScene loaded_;
  gltf::MaterialReader materials_;
};

}  // namespace

LoadedScene read_gltf_scene(const std::string& path, const SceneOptions& options) {
  return GltfScene(path, options).read();
}

}  // namespace mirrorbake
