#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <istream>
#include <limits>
#include <streambuf>
#include <string>
#include <string_view>
#include <system_error>
#include <unordered_map>
#include <utility>
#include <vector>

#include <tiny_obj_loader.h>

#include "file_bytes.hpp"
#include "loaded_mesh.hpp"
#include "mirrorbake/core/error.hpp"
#include "mtl.hpp"
#include "obj_libraries.hpp"
#include "polygon.hpp"

namespace mirrorbake {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// A stream over memory that is not copied.
class MemoryBuffer : public std::streambuf {
 public:
  explicit MemoryBuffer(std::string& bytes) { setg(bytes.data(), bytes.data(), bytes.data() + bytes.size()); }
};

bool is_finite_float(std::string_view token) {
  if (token.starts_with('+')) token.remove_prefix(1);
  double value = 0.0;
  const auto [stop, code] = std::from_chars(token.data(), token.data() + token.size(), value);
  return code == std::errc() && stop == token.data() + token.size() &&
         std::abs(value) <= std::numeric_limits<float>::max();
}

// position, position/uv, position//normal or position/uv/normal, each an integer.
bool is_face_corner(std::string_view token) {
  for (int part = 0; part < 3; ++part) {
    const std::size_t end = std::min(token.find('/'), token.size());
    int index = 0;
    const auto [stop, code] = std::from_chars(token.data(), token.data() + end, index);
    const bool may_be_empty = part == 1 && end == 0 && !token.empty();
    if (!may_be_empty && (code != std::errc() || stop != token.data() + end)) return false;
    if (end == token.size()) return true;
    token.remove_prefix(end + 1);
  }
  return false;
}

// tinyobjloader reads "nan", garbage and numbers out of range as other numbers, without a word. So the tokens of
// every v, vt, vn and f line are checked here.
void check_tokens(const std::string& path, std::string_view text) {
  std::size_t line_number = 0;
  while (!text.empty()) {
    ++line_number;
    const std::size_t end = text.find_first_of("\r\n");
    std::string_view line = text.substr(0, end);
    const bool is_crlf = end != std::string_view::npos && text.substr(end, 2) == "\r\n";
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + (is_crlf ? 2 : 1));

    const auto next_token = [&line]() {
      line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
      const std::string_view token = line.substr(0, line.find_first_of(" \t"));
      line.remove_prefix(token.size());
      return token;
    };
    const std::string_view keyword = next_token();
    const bool is_face = keyword == "f";
    if (!is_face && keyword != "v" && keyword != "vt" && keyword != "vn") continue;
    const int needed = keyword == "vt" ? 1 : 3;
    int found = 0;
    for (std::string_view token = next_token(); !token.empty() && token.front() != '#';
         token = next_token()) {
      ++found;
      if (is_face ? is_face_corner(token) : is_finite_float(token)) continue;
      throw FileError(path,
                      "line " + std::to_string(line_number) + " has '" + std::string(token.substr(0, 40)) +
                          (is_face ? "', expected the indices of a corner" : "', expected a finite float32"));
    }
    if (found < needed) {
      throw FileError(path, "line " + std::to_string(line_number) + " has " + std::to_string(found) +
                                (is_face ? " corners" : " numbers") + ", expected " + std::to_string(needed) +
                                " or more");
    }
  }
}

/// Builds the mesh as tinyobjloader calls back, line by line.
class ObjBuilder {
 public:
  ObjBuilder(const std::string& path, const MeshLimits& limits) : path_(path), limits_(limits) {}

  void add_position(float x, float y, float z) {
    positions_.push_back({x, y, z});
    first_use_.push_back(kNone);
    check_limits(path_, positions_.size(), 0, limits_);
  }
  void add_normal(float x, float y, float z) { normals_.push_back({x, y, z}); }
  void add_uv(float u, float v) { uvs_.push_back({u, v}); }

  void add_face(const tinyobj::index_t* indices, int count) {
    ++face_;
    if (loaded_.groups.empty()) start_group(group_name_, material_);
    corners_.clear();
    vertices_.clear();
    for (int i = 0; i < count; ++i) {
      const std::uint32_t position = resolve(indices[i].vertex_index, positions_.size(), "vertex");
      corners_.push_back(position);
      vertices_.push_back(vertex_for(
          position,
          indices[i].normal_index == 0 ? kNone : resolve(indices[i].normal_index, normals_.size(), "normal"),
          indices[i].texcoord_index == 0
              ? kNone
              : resolve(indices[i].texcoord_index, uvs_.size(), "texture coordinate")));
    }
    triples_.clear();
    triangulate(corners_, positions_, triples_);
    TriangleMesh& mesh = loaded_.mesh;
    for (const glm::uvec3 t : triples_)
      mesh.triangles.push_back({vertices_[t.x], vertices_[t.y], vertices_[t.z]});
    check_limits(path_, mesh.positions.size(), mesh.triangles.size(), limits_);
  }

  void set_name(std::string name) {
    owner_ = number_of(owners_, name);
    start_group(std::move(name), material_);
  }
  void set_material(const std::string& name) {
    const int material = number_of(materials_, name);
    if (static_cast<std::size_t>(material) == material_names_.size()) material_names_.push_back(name);
    start_group(group_name_, material);
  }

  std::vector<std::string>& material_names() { return material_names_; }

  LoadedMesh finish() {
    if (!has_uvs_) loaded_.mesh.uvs.clear();
    return std::move(loaded_);
  }

 private:
  // OBJ counts from 1, and from −1 backwards from the latest.
  std::uint32_t resolve(int index, std::size_t count, const char* what) const {
    const std::int64_t size = static_cast<std::int64_t>(count);
    const std::int64_t resolved = index > 0 ? std::int64_t{index} - 1 : size + index;
    if (index == 0 || resolved < 0 || resolved >= size) {
      throw FileError(path_, "face " + std::to_string(face_) + " has the " + what + " index " +
                                 std::to_string(index) + ", " + std::to_string(count) +
                                 " are defined before it");
    }
    return static_cast<std::uint32_t>(resolved);
  }

  // The mesh's vertex for a triple of indices: those of one position form a list.
  std::uint32_t vertex_for(std::uint32_t position, std::uint32_t normal, std::uint32_t uv) {
    for (std::uint32_t v = first_use_[position]; v != kNone; v = uses_[v].next) {
      if (uses_[v].normal == normal && uses_[v].uv == uv) return v;
    }
    TriangleMesh& mesh = loaded_.mesh;
    const std::uint32_t vertex = static_cast<std::uint32_t>(mesh.positions.size());
    uses_.push_back({normal, uv, first_use_[position]});
    first_use_[position] = vertex;
    mesh.positions.push_back(positions_[position]);
    mesh.normals.push_back(normal == kNone ? glm::vec3(0.0F) : normals_[normal]);
    mesh.uvs.push_back(uv == kNone ? glm::vec2(0.0F) : uvs_[uv]);
    has_uvs_ = has_uvs_ || uv != kNone;
    return vertex;
  }

  static int number_of(std::unordered_map<std::string, int>& numbers, const std::string& name) {
    return numbers.emplace(name, static_cast<int>(numbers.size())).first->second;
  }

  void start_group(std::string name, int material) {
    group_name_ = std::move(name);
    material_ = material;
    const std::size_t first = loaded_.mesh.triangles.size();
    if (!loaded_.groups.empty() && loaded_.groups.back().first_triangle == first) loaded_.groups.pop_back();
    loaded_.groups.push_back({group_name_, owner_, material_, first});
  }

  struct Use {
    std::uint32_t normal, uv, next;
  };

  const std::string& path_;
  const MeshLimits& limits_;
  std::vector<glm::vec3> positions_, normals_;
  std::vector<glm::vec2> uvs_;
  std::vector<std::uint32_t> first_use_;  // of each position
  std::vector<Use> uses_;                 // of each vertex of the mesh
  LoadedMesh loaded_;
  std::string group_name_;
  int owner_ = -1;
  int material_ = -1;
  std::unordered_map<std::string, int> owners_, materials_;  // numbers of names
  std::vector<std::string> material_names_;
  std::size_t face_ = 0;
  bool has_uvs_ = false;
  std::vector<std::uint32_t> corners_, vertices_;  // of the current face
  std::vector<glm::uvec3> triples_;
};

tinyobj::callback_t callbacks() {
  tinyobj::callback_t calls;
  calls.vertex_cb = [](void* b, float x, float y, float z, float) {
    static_cast<ObjBuilder*>(b)->add_position(x, y, z);
  };
  calls.normal_cb = [](void* b, float x, float y, float z) {
    static_cast<ObjBuilder*>(b)->add_normal(x, y, z);
  };
  calls.texcoord_cb = [](void* b, float u, float v, float) { static_cast<ObjBuilder*>(b)->add_uv(u, v); };
  calls.index_cb = [](void* b, tinyobj::index_t* indices, int count) {
    static_cast<ObjBuilder*>(b)->add_face(indices, count);
  };
  calls.usemtl_cb = [](void* b, const char* name, int) { static_cast<ObjBuilder*>(b)->set_material(name); };
  calls.object_cb = [](void* b, const char* name) { static_cast<ObjBuilder*>(b)->set_name(name); };
  return calls;
}

}  // namespace

// tinyobjloader would cut the names of files at spaces.
std::vector<std::string> material_libraries(std::string_view text) {
  std::vector<std::string> libraries;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    const auto [keyword, rest] = mtl::split_keyword(text.substr(0, end));
    if (keyword == "mtllib" && !rest.empty()) libraries.emplace_back(rest);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return libraries;
}

std::vector<std::string> library_files(const std::string& path, const std::string& names) {
  std::error_code code;
  const auto whole = resolve_inside(std::filesystem::path(path).parent_path(), names);
  if (whole && std::filesystem::exists(*whole, code)) return {names};
  std::vector<std::string> files;
  std::string_view left = names;
  while (!left.empty()) {
    const auto [file, rest] = mtl::split_keyword(left);
    files.emplace_back(file);
    left = rest;
  }
  return files;
}

LoadedMesh read_obj(const std::string& path, const MeshLimits& limits, ObjMaterials* materials) {
  std::string text = read_file(path);
  check_tokens(path, text);
  if (materials != nullptr) materials->libraries = material_libraries(text);
  MemoryBuffer buffer(text);
  std::istream stream(&buffer);
  ObjBuilder builder(path, limits);
  std::string warnings;
  std::string errors;
  if (!tinyobj::LoadObjWithCallback(stream, callbacks(), &builder, nullptr, &warnings, &errors)) {
    throw FileError(path, "is not a valid OBJ file: " + errors);
  }
  if (materials != nullptr) materials->names = std::move(builder.material_names());
  LoadedMesh loaded = builder.finish();
  check_positions(path, loaded.mesh.positions);
  complete_normals(loaded.mesh);
  return loaded;
}

}  // namespace mirrorbake
