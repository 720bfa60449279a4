#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "loaded_mesh.hpp"

namespace mirrorbake {

/// The indices of a corner as the file has them: from 1, or from −1 backwards; 0 where there is none.
struct ObjCorner {
  int position = 0;
  int uv = 0;
  int normal = 0;
};

/// Builds the mesh of an OBJ file, line by line.
class ObjBuilder {
 public:
  ObjBuilder(const std::string& path, const MeshLimits& limits) : path_(path), limits_(limits) {}

  void add_position(glm::vec3 position);
  /// Of the last position; sRGB, in [0,1].
  void set_color(glm::vec3 color);
  void add_normal(glm::vec3 normal) { normals_.push_back(normal); }
  void add_uv(glm::vec2 uv) { uvs_.push_back(uv); }
  void add_face(std::span<const ObjCorner> corners);

  /// Groups of faces that share normals where the file gives none: 0 is flat. Until it is called, all share
  /// one.
  void set_smoothing(std::uint32_t group) { smoothing_ = group; }
  void set_name(const std::string& name);
  void set_material(const std::string& name);

  std::vector<std::string>& material_names() { return material_names_; }
  LoadedMesh finish();

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  // Smoothing keys of flat faces, a face each, are above those of groups.
  static constexpr std::uint64_t kFlat = std::uint64_t{1} << 32;

  // What tells the vertices at one position apart, as a list.
  struct Use {
    std::uint32_t normal, uv;
    std::uint64_t smoothing;
    std::uint32_t next;
  };

  std::uint32_t resolve(int index, std::size_t count, const char* what) const;
  std::uint32_t vertex_for(std::uint32_t position, std::uint32_t normal, std::uint32_t uv);
  void start_group(std::string name, int material);

  const std::string& path_;
  const MeshLimits& limits_;
  std::vector<glm::vec3> positions_, normals_, colors_;
  std::vector<glm::vec2> uvs_;
  std::vector<std::uint32_t> first_use_;  // of each position
  std::vector<Use> uses_;                 // of each vertex of the mesh
  LoadedMesh loaded_;
  std::string group_name_;
  int owner_ = -1;
  int material_ = -1;
  std::unordered_map<std::string, int> owners_, materials_;  // numbers of names
  std::vector<std::string> material_names_;
  std::uint32_t smoothing_ = 1;
  std::size_t face_ = 0;
  bool has_uvs_ = false;
  std::vector<std::uint32_t> corners_, vertices_;  // of the current face
  std::vector<glm::uvec3> triples_;
};

}  // namespace mirrorbake
