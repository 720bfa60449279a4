#include <cmath>
#include <string>
#include <utility>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "readers.hpp"

namespace mirrorbake {

void check_origin(glm::dvec3 origin) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(origin[axis]) <= 1e12) continue;
    throw InvalidArgument("origin", text_of(glm::vec3(origin)), "finite coordinates up to 1e12");
  }
}

TriangleMesh load_mesh(const std::string& path, const MeshLimits& limits, glm::dvec3 origin) {
  check_origin(origin);
  LoadedMesh loaded = reader_of(path).mesh(path, limits, origin);
  drop_degenerate(path, loaded);
  return std::move(loaded.mesh);
}

}  // namespace mirrorbake
