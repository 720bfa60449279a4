#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include "gltf_compression.hpp"
#include "gltf_document.hpp"
#include "gltf_mesh.hpp"
#include "gltf_nodes.hpp"
#include "readers.hpp"

namespace mirrorbake {
namespace {

using gltf::fail;

// Triangles of a strip or fan alternate or share their first vertex; glTF 2.0 §3.7.2.1.
std::vector<glm::uvec3> triangles_of(const std::string& path, int mode,
                                     const std::vector<std::uint32_t>& indices) {
  std::vector<glm::uvec3> triangles;
  if (mode == TINYGLTF_MODE_TRIANGLES) {
    if (indices.size() % 3 != 0) {
      fail(path, "a list of triangles has " + std::to_string(indices.size()) +
                     " indices, expected a multiple of 3");
    }
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) {
      triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
    }
    return triangles;
  }
  for (std::size_t i = 0; i + 2 < indices.size(); ++i) {
    if (mode == TINYGLTF_MODE_TRIANGLE_FAN) {
      triangles.push_back({indices[0], indices[i + 1], indices[i + 2]});
    } else {
      triangles.push_back(i % 2 == 0 ? glm::uvec3(indices[i], indices[i + 1], indices[i + 2])
                                     : glm::uvec3(indices[i + 1], indices[i], indices[i + 2]));
    }
  }
  return triangles;
}

// A primitive as the file has it, in the node's space. What it does not have is empty.
struct Vertices {
  std::vector<glm::vec3> positions, normals, colors;
  std::vector<glm::vec4> tangents;
  std::vector<glm::vec2> uvs;
  std::vector<glm::uvec3> triangles;
};

// Every triangle with three vertices of its own.
Vertices unshared(const Vertices& shared) {
  Vertices result;
  for (const glm::uvec3 t : shared.triangles) {
    const std::uint32_t first = static_cast<std::uint32_t>(result.positions.size());
    result.triangles.push_back({first, first + 1, first + 2});
    for (int k = 0; k < 3; ++k) {
      result.positions.push_back(shared.positions[t[k]]);
      if (!shared.uvs.empty()) result.uvs.push_back(shared.uvs[t[k]]);
      if (!shared.colors.empty()) result.colors.push_back(shared.colors[t[k]]);
    }
  }
  return result;
}

class GltfBuilder {
 public:
  GltfBuilder(const std::string& path, const tinygltf::Model& model, const MeshLimits& limits,
              const gltf::UvSetOfMaterial& uv_set)
      : path_(path), model_(model), limits_(limits), uv_set_(uv_set) {}

  void add_node(int index, const tinygltf::Node& node, const glm::dmat4& world_from_node) {
    if (node.mesh < 0) return;
    const tinygltf::Mesh& mesh = gltf::element(path_, model_.meshes, node.mesh, "mesh");
    const std::string& name = node.name.empty() ? mesh.name : node.name;
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
      const bool has_triangles = primitive.mode == TINYGLTF_MODE_TRIANGLES ||
                                 primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP ||
                                 primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN;
      if (has_triangles) add_primitive(primitive, index, name, world_from_node);
    }
  }

  LoadedMesh finish() {
    TriangleMesh& mesh = loaded_.mesh;
    if (!has_uvs_) mesh.uvs.clear();
    if (!has_colors_) mesh.colors.clear();
    if (!has_tangents_) mesh.tangents.clear();
    complete_normals(mesh);
    return std::move(loaded_);
  }

 private:
  static int attribute(const tinygltf::Primitive& primitive, const std::string& name) {
    const auto it = primitive.attributes.find(name);
    return it == primitive.attributes.end() ? -1 : it->second;
  }

  void add_primitive(const tinygltf::Primitive& primitive, int node, const std::string& name,
                     const glm::dmat4& world_from_node) {
    if (attribute(primitive, "POSITION") < 0) fail(path_, "mesh of node '" + name + "' has no positions");
    const auto draco = primitive.extensions.find(gltf::kDraco);
    Vertices vertices =
        draco != primitive.extensions.end() ? decompressed(primitive, draco->second) : read(primitive);
    // glTF 2.0 §3.7.2.1: without normals, facets are flat.
    const bool is_flat = vertices.normals.empty();
    TriangleMesh& mesh = loaded_.mesh;
    check_limits(
        path_, mesh.positions.size() + (is_flat ? 3 * vertices.triangles.size() : vertices.positions.size()),
        mesh.triangles.size() + vertices.triangles.size(), limits_);
    if (is_flat) vertices = unshared(vertices);
    append(vertices, world_from_node);
    loaded_.groups.push_back(
        {name, node, primitive.material, mesh.triangles.size() - vertices.triangles.size()});
  }

  void append(const Vertices& vertices, const glm::dmat4& world_from_node) {
    TriangleMesh& mesh = loaded_.mesh;
    const std::uint32_t first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const glm::vec3 p : vertices.positions) {
      mesh.positions.push_back(glm::vec3(world_from_node * glm::dvec4(p, 1.0)));
    }
    check_positions(path_, mesh.positions, first);
    const glm::dmat3 m(world_from_node);
    const bool is_mirrored = glm::determinant(m) < 0.0;
    for (const glm::uvec3 t : vertices.triangles) {
      mesh.triangles.push_back((is_mirrored ? glm::uvec3(t.x, t.z, t.y) : t) + first);
    }
    // Normals follow the cofactors, which, unlike the inverse, exist for flat transforms too.
    const double sign = is_mirrored ? -1.0 : 1.0;
    const glm::dmat3 cofactors(sign * glm::cross(m[1], m[2]), sign * glm::cross(m[2], m[0]),
                               sign * glm::cross(m[0], m[1]));
    // Of flat facets, which have three vertices of their own, they are the facets' own.
    for (const glm::vec3 n : vertices.normals) {
      const glm::dvec3 turned = cofactors * glm::dvec3(n);
      const double length = glm::length(turned);
      mesh.normals.push_back(length > 0.0 ? glm::vec3(turned / length) : glm::vec3(0.0F));
    }
    for (std::size_t i = mesh.normals.size(); i < mesh.positions.size(); i += 3) {
      const glm::dvec3 corner(mesh.positions[i]);
      const glm::dvec3 across =
          glm::cross(glm::dvec3(mesh.positions[i + 1]) - corner, glm::dvec3(mesh.positions[i + 2]) - corner);
      const double length = glm::length(across);
      const glm::vec3 facet(length > 0.0 ? (is_mirrored ? -across : across) / length : glm::dvec3(0.0));
      mesh.normals.insert(mesh.normals.end(), 3, facet);
    }
    mesh.uvs.insert(mesh.uvs.end(), vertices.uvs.begin(), vertices.uvs.end());
    mesh.uvs.resize(mesh.positions.size(), glm::vec2(0.0F));
    mesh.colors.insert(mesh.colors.end(), vertices.colors.begin(), vertices.colors.end());
    mesh.colors.resize(mesh.positions.size(), glm::vec3(1.0F));
    for (const glm::vec4 t : vertices.tangents) mesh.tangents.push_back(turned_tangent(t, m, is_mirrored));
    mesh.tangents.resize(mesh.positions.size(), glm::vec4(0.0F));
    has_tangents_ = has_tangents_ || !vertices.tangents.empty();
    has_uvs_ = has_uvs_ || !vertices.uvs.empty();
    has_colors_ = has_colors_ || !vertices.colors.empty();
  }

  // A tangent runs along the surface, and so does its image. What a mirror does to the cross product with the
  // normal, which follows the cofactors, the sign undoes.
  static glm::vec4 turned_tangent(glm::vec4 tangent, const glm::dmat3& world_from_node, bool is_mirrored) {
    const glm::dvec3 turned = world_from_node * glm::dvec3(tangent);
    const double length = glm::length(turned);
    if (!(length > 0.0) || !std::isfinite(length)) return glm::vec4(0.0F);
    return {glm::vec3(turned / length), is_mirrored ? -tangent.w : tangent.w};
  }

  // The numbers of an attribute, one row for each vertex; nothing if there is none. `type` 0 stands for VEC3
  // or VEC4.
  gltf::Numbers numbers(const tinygltf::Primitive& primitive, const std::string& name, int type,
                        const char* what, std::size_t vertex_count) const {
    const int accessor = attribute(primitive, name);
    if (accessor < 0) return {};
    const tinygltf::Accessor& source =
        gltf::element(path_, model_.accessors, accessor, std::string(what) + " accessor");
    if (source.count != vertex_count) {
      fail(path_, std::string("number of ") + what + "s is " + std::to_string(source.count) +
                      ", expected one for each of " + std::to_string(vertex_count) + " vertices");
    }
    const bool is_any = type == 0;
    if (is_any) type = source.type == TINYGLTF_TYPE_VEC4 ? TINYGLTF_TYPE_VEC4 : TINYGLTF_TYPE_VEC3;
    return gltf::read_numbers(path_, model_, accessor, type, what);
  }

  Vertices read(const tinygltf::Primitive& primitive) const {
    // The limits come before anything is read.
    const std::size_t count =
        gltf::element_count(path_, model_, attribute(primitive, "POSITION"), "position");
    check_limits(path_, loaded_.mesh.positions.size() + count, loaded_.mesh.triangles.size(), limits_);
    Vertices result;
    set_rows(numbers(primitive, "POSITION", TINYGLTF_TYPE_VEC3, "position", count), result.positions);
    result.triangles = read_triangles(primitive, count);
    set_normals(numbers(primitive, "NORMAL", TINYGLTF_TYPE_VEC3, "normal", count), result);
    set_tangents(numbers(primitive, "TANGENT", TINYGLTF_TYPE_VEC4, "tangent", count), result);
    set_uvs(numbers(primitive, uv_name(primitive), TINYGLTF_TYPE_VEC2, "texture coordinate", count), result);
    set_colors(numbers(primitive, "COLOR_0", 0, "colour", count), result);
    return result;
  }

  Vertices decompressed(const tinygltf::Primitive& primitive, const tinygltf::Value& extension) const {
    const std::size_t count =
        gltf::element_count(path_, model_, attribute(primitive, "POSITION"), "position");
    check_limits(path_, loaded_.mesh.positions.size() + count, loaded_.mesh.triangles.size(), limits_);
    const gltf::DracoMesh mesh(path_, model_, extension, limits_);
    const auto numbers = [&](const std::string& name, int components) {
      const int accessor = attribute(primitive, name);
      if (accessor < 0) return gltf::Numbers{};
      return mesh.numbers(name, components,
                          gltf::element(path_, model_.accessors, accessor, name + " accessor"));
    };
    Vertices result;
    set_rows(numbers("POSITION", 3), result.positions);
    if (result.positions.empty()) fail(path_, "a Draco mesh has no positions");
    result.triangles = mesh.triangles();
    set_normals(numbers("NORMAL", 3), result);
    set_tangents(numbers("TANGENT", 4), result);
    set_uvs(numbers(uv_name(primitive), 2), result);
    set_colors(numbers("COLOR_0", 0), result);
    return result;
  }

  std::string uv_name(const tinygltf::Primitive& primitive) const {
    return "TEXCOORD_" + std::to_string(uv_set_(primitive.material));
  }

  static void set_rows(const gltf::Numbers& numbers, std::vector<glm::vec3>& rows) {
    rows.resize(numbers.count);
    for (std::size_t i = 0; i < numbers.count; ++i) {
      const float* v = numbers.values.data() + i * static_cast<std::size_t>(numbers.components);
      rows[i] = {v[0], v[1], v[2]};
    }
  }

  void set_normals(const gltf::Numbers& numbers, Vertices& vertices) const {
    set_rows(numbers, vertices.normals);
    for (std::size_t i = 0; i < vertices.normals.size(); ++i) {
      const glm::vec3 n = vertices.normals[i];
      if (!std::isfinite(n.x) || !std::isfinite(n.y) || !std::isfinite(n.z)) {
        fail(path_, "normal " + std::to_string(i) + " is not finite");
      }
    }
  }

  // Exporters write zeros where coordinates have no direction, and quantised ones round the sign.
  void set_tangents(const gltf::Numbers& numbers, Vertices& vertices) const {
    for (std::size_t i = 0; i < numbers.count; ++i) {
      const float* v = numbers.values.data() + 4 * i;
      if (!std::isfinite(v[0]) || !std::isfinite(v[1]) || !std::isfinite(v[2]) || !std::isfinite(v[3])) {
        fail(path_, "tangent " + std::to_string(i) + " is not finite");
      }
      const glm::vec3 along(v[0], v[1], v[2]);
      const float length = glm::length(along);
      vertices.tangents.push_back(length > 1e-6F ? glm::vec4(along / length, v[3] < 0.0F ? -1.0F : 1.0F)
                                                 : glm::vec4(0.0F));
    }
  }

  void set_uvs(const gltf::Numbers& numbers, Vertices& vertices) const {
    for (std::size_t i = 0; i < numbers.count; ++i) {
      // glTF counts v downwards
      const glm::vec2 uv(numbers.values[2 * i], 1.0F - numbers.values[2 * i + 1]);
      if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) {
        fail(path_, "texture coordinate " + std::to_string(i) + " is not finite");
      }
      vertices.uvs.push_back(uv);
    }
  }

  void set_colors(const gltf::Numbers& numbers, Vertices& vertices) const {
    set_rows(numbers, vertices.colors);
    for (glm::vec3& color : vertices.colors) {
      for (int c = 0; c < 3; ++c) {
        if (!std::isfinite(color[c])) fail(path_, "a vertex colour is not finite");
        color[c] = std::clamp(color[c], 0.0F, 1.0F);
      }
    }
  }

  std::vector<glm::uvec3> read_triangles(const tinygltf::Primitive& primitive,
                                         std::size_t vertex_count) const {
    std::vector<std::uint32_t> indices;
    if (primitive.indices >= 0) {
      const std::size_t count = gltf::element_count(path_, model_, primitive.indices, "index");
      check_limits(path_, 0, loaded_.mesh.triangles.size() + count / 3, limits_);
      indices = gltf::read_indices(path_, model_, primitive.indices, "index");
      for (const std::uint32_t index : indices) {
        if (index >= vertex_count) {
          fail(path_, "vertex index is " + std::to_string(index) + ", the mesh has " +
                          std::to_string(vertex_count) + " vertices");
        }
      }
    } else {
      indices.resize(vertex_count);
      for (std::size_t i = 0; i < vertex_count; ++i) indices[i] = static_cast<std::uint32_t>(i);
    }
    return triangles_of(path_, primitive.mode, indices);
  }

  const std::string& path_;
  const tinygltf::Model& model_;
  const MeshLimits& limits_;
  const gltf::UvSetOfMaterial& uv_set_;
  LoadedMesh loaded_;
  bool has_uvs_ = false;
  bool has_colors_ = false;
  bool has_tangents_ = false;
};

}  // namespace

LoadedMesh gltf::read_meshes(const std::string& path, const tinygltf::Model& model, const MeshLimits& limits,
                             glm::dvec3 origin, const UvSetOfMaterial& uv_set) {
  GltfBuilder builder(path, model, limits, uv_set);
  gltf::visit_nodes(path, model, origin,
                    [&](int index, const tinygltf::Node& node, const glm::dmat4& world_from_node) {
                      builder.add_node(index, node, world_from_node);
                    });
  return builder.finish();
}

LoadedMesh read_gltf(const std::string& path, const MeshLimits& limits, glm::dvec3 origin) {
  return gltf::read_meshes(path, gltf::read_document(path), limits, origin, [](int) { return 0; });
}

}  // namespace mirrorbake
