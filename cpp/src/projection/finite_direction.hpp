#pragma once

#include <cmath>

#include <glm/vec3.hpp>

namespace mirrorbake {

/// Whether a direction has an answer. The squares of float32 components, subnormal or huge, are normal
/// doubles, so that nothing else needs care.
inline bool is_usable(glm::dvec3 d) {
  return std::isfinite(d.x) && std::isfinite(d.y) && std::isfinite(d.z) &&
         (d.x != 0.0 || d.y != 0.0 || d.z != 0.0);
}

}  // namespace mirrorbake
