#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "loaded_mesh.hpp"
#include "mirrorbake/scene/load.hpp"

/// The kinds of files that meshes and scenes are read from.
namespace mirrorbake {

/// Files that a file refers to.
class References {
 public:
  explicit References(std::filesystem::path directory) : directory_(std::move(directory)) {}

  /// Adds what `reference` means, if there is such a file and it may be read; returns whether it did, or had.
  bool add(const std::string& reference) { return add(directory_, reference); }
  bool add(const std::filesystem::path& directory, const std::string& reference);
  const std::filesystem::path& directory() const { return directory_; }
  std::vector<std::string> take() { return std::move(files_); }

 private:
  std::filesystem::path directory_;
  std::vector<std::string> files_;
};

/// How files of a kind are read; load.hpp says what the functions do.
struct SceneReader {
  std::array<std::string_view, 2> extensions;  ///< in lower case
  LoadedMesh (*mesh)(const std::string& path, const MeshLimits& limits, glm::dvec3 origin);
  LoadedScene (*scene)(const std::string& path, const SceneOptions& options);
  void (*references)(const std::string& path, FileContent content, References& found);
};

/// By the extension. Throws FileError for one that is not known.
const SceneReader& reader_of(const std::string& path);

LoadedMesh read_gltf(const std::string& path, const MeshLimits& limits, glm::dvec3 origin = glm::dvec3(0.0));
LoadedScene read_gltf_scene(const std::string& path, const SceneOptions& options);
void find_gltf_references(const std::string& path, FileContent content, References& found);

LoadedMesh read_obj(const std::string& path, const MeshLimits& limits, glm::dvec3 origin = glm::dvec3(0.0));
LoadedScene read_obj_scene(const std::string& path, const SceneOptions& options);
void find_obj_references(const std::string& path, FileContent content, References& found);

}  // namespace mirrorbake
