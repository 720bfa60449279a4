#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <string>

#include "loaded_mesh.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/scene/load.hpp"

namespace mirrorbake {

std::string lower_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

void check_origin(glm::dvec3 origin) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(origin[axis]) <= 1e12) continue;
    throw InvalidArgument("origin", text_of(glm::vec3(origin)), "finite coordinates up to 1e12");
  }
}

TriangleMesh load_mesh(const std::string& path, const MeshLimits& limits, glm::dvec3 origin) {
  check_origin(origin);
  const std::string extension = lower_extension(path);
  LoadedMesh loaded;
  if (extension == ".obj") {
    loaded = read_obj(path, limits, nullptr, origin);
  } else if (extension == ".gltf" || extension == ".glb") {
    loaded = read_gltf(path, limits, origin);
  } else {
    throw FileError(path, "has the extension '" + extension + "', expected .obj, .gltf or .glb");
  }
  drop_degenerate(path, loaded);
  return std::move(loaded.mesh);
}

}  // namespace mirrorbake
