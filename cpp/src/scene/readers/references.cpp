#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "file_bytes.hpp"
#include "gltf_document.hpp"
#include "loaded_mesh.hpp"
#include "mirrorbake/scene/load.hpp"
#include "mtl.hpp"
#include "obj_libraries.hpp"

namespace mirrorbake {
namespace {

namespace fs = std::filesystem;

class References {
 public:
  /// Adds what `reference` in a file of the directory means, if there is such a file and it may be read.
  void add(const fs::path& directory, const std::string& reference) {
    const std::optional<fs::path> file = resolve_inside(directory, reference);
    std::error_code code;
    if (!file || !fs::is_regular_file(*file, code)) return;
    if (std::find(files_.begin(), files_.end(), file->string()) == files_.end()) {
      files_.push_back(file->string());
    }
  }

  std::vector<std::string> take() { return std::move(files_); }

 private:
  std::vector<std::string> files_;
};

void add_uri(References& references, const fs::path& directory, const std::string& uri) {
  if (!uri.empty() && !uri.starts_with("data:")) references.add(directory, gltf::percent_decoded(uri));
}

}  // namespace

std::vector<std::string> referenced_files(const std::string& path, FileContent content) {
  References references;
  const fs::path directory = fs::path(path).parent_path();
  if (lower_extension(path) != ".obj") {
    const tinygltf::Model model = gltf::read_document(path);
    for (const tinygltf::Buffer& buffer : model.buffers) add_uri(references, directory, buffer.uri);
    if (content == FileContent::mesh) return references.take();
    for (const tinygltf::Image& image : model.images) add_uri(references, directory, image.uri);
    return references.take();
  }
  if (content == FileContent::mesh) return {};
  for (const std::string& names : material_libraries(read_file(path))) {
    for (const std::string& name : library_files(path, names)) {
      references.add(directory, name);
      const std::optional<fs::path> library = resolve_inside(directory, name);
      std::error_code code;
      if (!library || !fs::is_regular_file(*library, code)) continue;
      Warnings ignored;
      for (const mtl::Definition& d : mtl::parse(read_file(*library), ignored)) {
        for (const mtl::Map* map : {&d.diffuse_map, &d.specular_map, &d.emission_map, &d.dissolve_map}) {
          if (!map->file.empty()) references.add(library->parent_path(), map->file);
        }
      }
    }
  }
  return references.take();
}

}  // namespace mirrorbake
