#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "file_bytes.hpp"
#include "loaded_mesh.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "mtl.hpp"
#include "obj_libraries.hpp"
#include "readers.hpp"
#include "scene_builder.hpp"

namespace mirrorbake {
namespace {

namespace fs = std::filesystem;

// Images that other programs read and we do not: the scene is worth loading without them.
bool is_of_another_kind(const std::string& image) {
  static const std::set<std::string> kOthers = {".bmp", ".dds", ".gif", ".ktx", ".ktx2",
                                                ".pcx", ".psd", ".svg", ".tga"};
  std::string suffix = fs::path(image).extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return kOthers.contains(suffix);
}

class ObjScene {
 public:
  ObjScene(const std::string& path, const SceneOptions& options)
      : path_(path), options_(options), textures_(options, warnings_) {}

  LoadedScene read() {
    ObjContent used;
    LoadedMesh mesh = read_obj_content(path_, options_.meshes, options_.origin, used);
    drop_degenerate(path_, mesh);
    warnings_.add("lines are not supported", used.lines);
    warnings_.add("points are not supported", used.points);
    warnings_.add("curves and surfaces are not supported", used.curves);
    warnings_.add("faces of fewer than three corners are left out", used.short_faces);
    for (const std::string& library : used.libraries) read_library(library);

    std::map<int, int> material_of;
    for (const MeshGroup& group : mesh.groups) {
      if (material_of.contains(group.material)) continue;
      material_of[group.material] = static_cast<int>(loaded_.scene.materials.size());
      loaded_.scene.materials.push_back(
          group.material < 0 ? unnamed()
                             : material(used.materials[static_cast<std::size_t>(group.material)]));
    }
    loaded_.scene.objects = split_into_objects(std::move(mesh), loaded_.scene.materials, material_of);
    loaded_.warnings = warnings_.take();
    return std::move(loaded_);
  }

 private:
  struct Defined {
    mtl::Definition definition;
    fs::path library;
  };

  static Material unnamed() {
    Material material;
    material.name = "default";
    return material;
  }

  // The file that a reference means, if it can be read. What is outside of the file's own directory never is.
  std::optional<fs::path> existing(const fs::path& from, const std::string& what,
                                   const std::string& reference) {
    std::error_code code;
    auto target = resolve_inside(from.parent_path(), reference);
    if (!target) {
      warnings_.add("the " + what + " '" + reference + "' is not inside the file's own directory");
      return std::nullopt;
    }
    if (!fs::exists(*target, code)) {
      warnings_.add("the " + what + " '" + reference + "' does not exist");
      return std::nullopt;
    }
    if (is_of_another_kind(reference)) {
      warnings_.add("the " + what + " '" + reference + "' is no EXR, HDR, TIFF, PNG, JPEG or WebP file");
      return std::nullopt;
    }
    return target;
  }

  void read_library(const std::string& names) {
    for (const std::string& file : library_files(path_, names)) {
      const auto found = existing(path_, "material library", file);
      if (!found || !libraries_.insert(*found).second) continue;
      const fs::path& library = *found;
      const std::string text = read_file(library);
      for (mtl::Definition& definition : mtl::parse(text, warnings_)) {
        const std::string name = definition.name;
        definitions_.emplace(name, Defined{std::move(definition), library});
      }
    }
  }

  Material material(const std::string& name) {
    const auto it = definitions_.find(name);
    if (it == definitions_.end()) {
      warnings_.add("the material '" + name + "' is not defined");
      Material material = unnamed();
      material.name = valid_utf8(name);
      return material;
    }
    const mtl::Definition& definition = it->second.definition;
    const fs::path& library = it->second.library;
    Material material = mtl::material_from(library.string(), definition, warnings_);
    add_map(library, definition.diffuse_map, material.albedo_texture);
    if (material.specular && material.fresnel.model != FresnelModel::dielectric) {
      add_map(library, definition.specular_map, material.specular_texture);
    }
    float largest = 1.0F;
    add_map(library, definition.emission_map, material.emission_texture, &largest);
    material.emission *= largest;
    add_opacity(library, definition.dissolve_map, material.opacity_texture);
    return material;
  }

  void add_map(const fs::path& library, const mtl::Map& map, TextureReference& reference,
               float* largest = nullptr) {
    const auto found = map.file.empty() ? std::nullopt : existing(library, "image", map.file);
    if (!found) return;
    const fs::path& file = *found;
    const auto key = std::tuple(file, map.wrap, largest != nullptr);
    const auto it = texture_of_.find(key);
    if (it != texture_of_.end()) {
      reference.texture = it->second.first;
      if (largest != nullptr) *largest = it->second.second;
      return;
    }
    float factor = 1.0F;
    Texture texture = textures_.read_file_texture(file.string(), Transfer::automatic,
                                                  largest != nullptr ? &factor : nullptr);
    texture.wrap_u = texture.wrap_v = map.wrap;
    if (largest != nullptr) *largest = factor;
    reference.texture = static_cast<int>(loaded_.scene.textures.size());
    loaded_.scene.textures.push_back(std::move(texture));
    texture_of_.emplace(key, std::pair(reference.texture, factor));
  }

  void add_opacity(const fs::path& library, const mtl::Map& map, TextureReference& reference) {
    const auto found = map.file.empty() ? std::nullopt : existing(library, "image", map.file);
    if (!found) return;
    const fs::path& file = *found;
    const auto [it, is_new] = opacity_of_.try_emplace(std::pair(file, map.wrap), -1);
    if (is_new) {
      const std::string bytes = read_file(file.string());
      std::optional<Image> image = textures_.read_opacity(
          file.string(), {reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()}, true);
      if (image) {
        it->second = static_cast<int>(loaded_.scene.textures.size());
        loaded_.scene.textures.push_back({std::move(*image), map.wrap, map.wrap});
      }
    }
    reference.texture = it->second;
  }

  const std::string& path_;
  const SceneOptions& options_;
  Warnings warnings_;
  TextureReader textures_;
  LoadedScene loaded_;
  std::set<fs::path> libraries_;
  std::map<std::string, Defined> definitions_;
  std::map<std::tuple<fs::path, TextureWrap, bool>, std::pair<int, float>> texture_of_;
  std::map<std::pair<fs::path, TextureWrap>, int> opacity_of_;  ///< −1: opaque everywhere
};

}  // namespace

LoadedScene read_obj_scene(const std::string& path, const SceneOptions& options) {
  return ObjScene(path, options).read();
}

}  // namespace mirrorbake
