#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include "gltf_document.hpp"
#include "gltf_mesh.hpp"
#include "gltf_nodes.hpp"
#include "loaded_mesh.hpp"

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

class GltfBuilder {
 public:
  GltfBuilder(const std::string& path, const tinygltf::Model& model, const MeshLimits& limits,
              const gltf::UvSetOfMaterial& uv_set)
      : path_(path), model_(model), limits_(limits), uv_set_(uv_set) {}

  void add_node(int index, const tinygltf::Node& node, const glm::dmat4& world_from_node) {
    if (node.mesh < 0) return;
    const tinygltf::Mesh& mesh = gltf::element(path_, model_.meshes, node.mesh, "mesh");
    const std::size_t first_vertex = loaded_.mesh.positions.size();
    const std::size_t first_triangle = loaded_.mesh.triangles.size();
    const std::string& name = node.name.empty() ? mesh.name : node.name;
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
      const bool has_triangles = primitive.mode == TINYGLTF_MODE_TRIANGLES ||
                                 primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP ||
                                 primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN;
      if (has_triangles) add_primitive(primitive, index, name, world_from_node);
    }
    complete_normals(loaded_.mesh, first_vertex, first_triangle);
  }

  LoadedMesh finish() {
    if (!has_uvs_) loaded_.mesh.uvs.clear();
    return std::move(loaded_);
  }

 private:
  static int attribute(const tinygltf::Primitive& primitive, const std::string& name) {
    const auto it = primitive.attributes.find(name);
    return it == primitive.attributes.end() ? -1 : it->second;
  }

  void add_primitive(const tinygltf::Primitive& primitive, int node, const std::string& name,
                     const glm::dmat4& world_from_node) {
    TriangleMesh& mesh = loaded_.mesh;
    const int position_accessor = attribute(primitive, "POSITION");
    if (position_accessor < 0) fail(path_, "mesh of node '" + name + "' has no positions");
    // The limits come before anything is read.
    const std::size_t vertex_count = gltf::element_count(path_, model_, position_accessor, "position");
    check_limits(path_, mesh.positions.size() + vertex_count, mesh.triangles.size(), limits_);
    const gltf::Numbers positions =
        gltf::read_numbers(path_, model_, position_accessor, TINYGLTF_TYPE_VEC3, "position");

    const std::vector<glm::uvec3> triangles = read_triangles(primitive, vertex_count);
    check_limits(path_, mesh.positions.size() + vertex_count, mesh.triangles.size() + triangles.size(),
                 limits_);

    const std::uint32_t first = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::size_t i = 0; i < vertex_count; ++i) {
      const float* p = positions.values.data() + 3 * i;
      mesh.positions.push_back(glm::vec3(world_from_node * glm::dvec4(p[0], p[1], p[2], 1.0)));
    }
    check_positions(path_, mesh.positions, first);
    add_normals(primitive, vertex_count, world_from_node);
    add_uvs(primitive, vertex_count);

    loaded_.groups.push_back({name, node, primitive.material, mesh.triangles.size()});
    const bool is_mirrored = glm::determinant(glm::dmat3(world_from_node)) < 0.0;
    for (const glm::uvec3 t : triangles) {
      mesh.triangles.push_back((is_mirrored ? glm::uvec3(t.x, t.z, t.y) : t) + first);
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

  void check_count(const gltf::Numbers& numbers, std::size_t vertex_count, const char* what) const {
    if (numbers.count == vertex_count) return;
    fail(path_, std::string("number of ") + what + " is " + std::to_string(numbers.count) +
                    ", expected one for each of " + std::to_string(vertex_count) + " vertices");
  }

  void add_normals(const tinygltf::Primitive& primitive, std::size_t vertex_count,
                   const glm::dmat4& world_from_node) {
    TriangleMesh& mesh = loaded_.mesh;
    const int accessor = attribute(primitive, "NORMAL");
    mesh.normals.resize(mesh.positions.size(), glm::vec3(0.0F));
    if (accessor < 0) return;
    const gltf::Numbers normals = gltf::read_numbers(path_, model_, accessor, TINYGLTF_TYPE_VEC3, "normal");
    check_count(normals, vertex_count, "normals");
    // Normals follow the cofactors, which, unlike the inverse, exist for flat transforms too.
    const glm::dmat3 m(world_from_node);
    const double sign = glm::determinant(m) < 0.0 ? -1.0 : 1.0;
    const glm::dmat3 cofactors(sign * glm::cross(m[1], m[2]), sign * glm::cross(m[2], m[0]),
                               sign * glm::cross(m[0], m[1]));
    const std::size_t first = mesh.positions.size() - vertex_count;
    for (std::size_t i = 0; i < vertex_count; ++i) {
      const float* n = normals.values.data() + 3 * i;
      if (!std::isfinite(n[0]) || !std::isfinite(n[1]) || !std::isfinite(n[2])) {
        fail(path_, "normal " + std::to_string(i) + " is not finite");
      }
      const glm::dvec3 turned = cofactors * glm::dvec3(n[0], n[1], n[2]);
      const double length = glm::length(turned);
      mesh.normals[first + i] = length > 0.0 ? glm::vec3(turned / length) : glm::vec3(0.0F);
    }
  }

  void add_uvs(const tinygltf::Primitive& primitive, std::size_t vertex_count) {
    TriangleMesh& mesh = loaded_.mesh;
    const int accessor = attribute(primitive, "TEXCOORD_" + std::to_string(uv_set_(primitive.material)));
    mesh.uvs.resize(mesh.positions.size(), glm::vec2(0.0F));
    if (accessor < 0) return;
    const gltf::Numbers uvs =
        gltf::read_numbers(path_, model_, accessor, TINYGLTF_TYPE_VEC2, "texture coordinate");
    check_count(uvs, vertex_count, "texture coordinates");
    has_uvs_ = true;
    const std::size_t first = mesh.positions.size() - vertex_count;
    for (std::size_t i = 0; i < vertex_count; ++i) {
      const glm::vec2 uv(uvs.values[2 * i], 1.0F - uvs.values[2 * i + 1]);  // glTF counts v downwards
      if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) {
        fail(path_, "texture coordinate " + std::to_string(i) + " is not finite");
      }
      mesh.uvs[first + i] = uv;
    }
  }

  const std::string& path_;
  const tinygltf::Model& model_;
  const MeshLimits& limits_;
  const gltf::UvSetOfMaterial& uv_set_;
  LoadedMesh loaded_;
  bool has_uvs_ = false;
};

}  // namespace

LoadedMesh gltf::read_meshes(const std::string& path, const tinygltf::Model& model, const MeshLimits& limits,
                             const UvSetOfMaterial& uv_set) {
  GltfBuilder builder(path, model, limits, uv_set);
  gltf::visit_nodes(path, model,
                    [&](int index, const tinygltf::Node& node, const glm::dmat4& world_from_node) {
                      builder.add_node(index, node, world_from_node);
                    });
  return builder.finish();
}

LoadedMesh read_gltf(const std::string& path, const MeshLimits& limits) {
  return gltf::read_meshes(path, gltf::read_document(path), limits, [](int) { return 0; });
}

}  // namespace mirrorbake
