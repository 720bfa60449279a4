#pragma once

#include <cmath>
#include <glm/vec3.hpp>

namespace mirrorbake::detail {

template <typename Real>
bool is_finite(const glm::vec<3, Real>& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace mirrorbake::detail
