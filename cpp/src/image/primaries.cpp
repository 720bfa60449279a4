#include "mirrorbake/image/primaries.hpp"

#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

namespace mirrorbake::image_files {

Primaries rec709_primaries() { return {{{0.640, 0.330}, {0.300, 0.600}, {0.150, 0.060}, {0.3127, 0.3290}}}; }

glm::dmat3 xyz_from_rgb(const Primaries& primaries) {
  const auto xyz = [](glm::dvec2 c) { return glm::dvec3(c.x, c.y, 1.0 - c.x - c.y); };
  const glm::dmat3 columns(xyz(primaries[0]), xyz(primaries[1]), xyz(primaries[2]));
  const glm::dvec3 white = xyz(primaries[3]) / primaries[3].y;
  const glm::dvec3 amounts = glm::inverse(columns) * white;
  return {columns[0] * amounts.x, columns[1] * amounts.y, columns[2] * amounts.z};
}

glm::dmat3 rec709_from_xyz() { return glm::inverse(xyz_from_rgb(rec709_primaries())); }

}  // namespace mirrorbake::image_files
