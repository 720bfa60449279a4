#include "obj_builder.hpp"

#include <utility>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/color.hpp"
#include "polygon.hpp"

namespace mirrorbake {
namespace {

int number_of(std::unordered_map<std::string, int>& numbers, const std::string& name) {
  return numbers.emplace(name, static_cast<int>(numbers.size())).first->second;
}

}  // namespace

void ObjBuilder::add_position(glm::vec3 position) {
  positions_.push_back(position);
  first_use_.push_back(kNone);
  check_limits(path_, positions_.size(), 0, limits_);
}

void ObjBuilder::set_color(glm::vec3 color) {
  colors_.resize(positions_.size(), glm::vec3(1.0F));
  colors_.back() = {srgb_decode(color.x), srgb_decode(color.y), srgb_decode(color.z)};
}

void ObjBuilder::add_face(std::span<const ObjCorner> corners) {
  ++face_;
  if (loaded_.groups.empty()) start_group(group_name_, material_);
  corners_.clear();
  vertices_.clear();
  for (const ObjCorner& corner : corners) {
    const std::uint32_t position = resolve(corner.position, positions_.size(), "vertex");
    corners_.push_back(position);
    vertices_.push_back(
        vertex_for(position, corner.normal == 0 ? kNone : resolve(corner.normal, normals_.size(), "normal"),
                   corner.uv == 0 ? kNone : resolve(corner.uv, uvs_.size(), "texture coordinate")));
  }
  triples_.clear();
  triangulate(path_, corners_, positions_, triples_);
  TriangleMesh& mesh = loaded_.mesh;
  for (const glm::uvec3 t : triples_)
    mesh.triangles.push_back({vertices_[t.x], vertices_[t.y], vertices_[t.z]});
  check_limits(path_, mesh.positions.size(), mesh.triangles.size(), limits_);
}

void ObjBuilder::set_name(const std::string& name) {
  owner_ = number_of(owners_, name);
  start_group(name, material_);
}

void ObjBuilder::set_material(const std::string& name) {
  const int material = number_of(materials_, name);
  if (static_cast<std::size_t>(material) == material_names_.size()) material_names_.push_back(name);
  start_group(group_name_, material);
}

LoadedMesh ObjBuilder::finish() {
  if (!has_uvs_) loaded_.mesh.uvs.clear();
  std::vector<std::uint64_t> smoothing;
  smoothing.reserve(uses_.size());
  for (const Use& use : uses_) smoothing.push_back(use.smoothing);
  complete_normals(loaded_.mesh, smoothing);
  return std::move(loaded_);
}

// OBJ counts from 1, and from −1 backwards from the latest.
std::uint32_t ObjBuilder::resolve(int index, std::size_t count, const char* what) const {
  const std::int64_t size = static_cast<std::int64_t>(count);
  const std::int64_t resolved = index > 0 ? std::int64_t{index} - 1 : size + index;
  if (index == 0 || resolved < 0 || resolved >= size) {
    throw FileError(path_, "face " + std::to_string(face_) + " has the " + what + " index " +
                               std::to_string(index) + ", " + std::to_string(count) +
                               " are defined before it");
  }
  return static_cast<std::uint32_t>(resolved);
}

std::uint32_t ObjBuilder::vertex_for(std::uint32_t position, std::uint32_t normal, std::uint32_t uv) {
  const std::uint64_t smoothing = normal != kNone ? 0 : smoothing_ != 0 ? smoothing_ : kFlat + face_;
  for (std::uint32_t v = first_use_[position]; v != kNone; v = uses_[v].next) {
    if (uses_[v].normal == normal && uses_[v].uv == uv && uses_[v].smoothing == smoothing) return v;
    // Faces come one after another: another flat face's vertex at the head ends the search, or a fan of flat
    // faces would take the square of their number.
    if (smoothing >= kFlat && uses_[v].smoothing >= kFlat && uses_[v].smoothing != smoothing) break;
  }
  TriangleMesh& mesh = loaded_.mesh;
  const std::uint32_t vertex = static_cast<std::uint32_t>(mesh.positions.size());
  uses_.push_back({normal, uv, smoothing, first_use_[position]});
  first_use_[position] = vertex;
  mesh.positions.push_back(positions_[position]);
  mesh.normals.push_back(normal == kNone ? glm::vec3(0.0F) : normals_[normal]);
  mesh.uvs.push_back(uv == kNone ? glm::vec2(0.0F) : uvs_[uv]);
  if (!colors_.empty()) {
    mesh.colors.resize(vertex, glm::vec3(1.0F));
    mesh.colors.push_back(position < colors_.size() ? colors_[position] : glm::vec3(1.0F));
  }
  has_uvs_ = has_uvs_ || uv != kNone;
  return vertex;
}

void ObjBuilder::start_group(std::string name, int material) {
  group_name_ = std::move(name);
  material_ = material;
  const std::size_t first = loaded_.mesh.triangles.size();
  if (!loaded_.groups.empty() && loaded_.groups.back().first_triangle == first) loaded_.groups.pop_back();
  loaded_.groups.push_back({group_name_, owner_, material_, first});
}

}  // namespace mirrorbake
