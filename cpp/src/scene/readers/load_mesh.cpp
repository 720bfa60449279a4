#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>

#include "loaded_mesh.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/load.hpp"

namespace mirrorbake {

std::string lower_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

TriangleMesh load_mesh(const std::string& path, const MeshLimits& limits) {
  const std::string extension = lower_extension(path);
  LoadedMesh loaded;
  if (extension == ".obj") {
    loaded = read_obj(path, limits);
  } else if (extension == ".gltf" || extension == ".glb") {
    loaded = read_gltf(path, limits);
  } else {
    throw FileError(path, "has the extension '" + extension + "', expected .obj, .gltf or .glb");
  }
  drop_degenerate(path, loaded);
  return std::move(loaded.mesh);
}

}  // namespace mirrorbake
