#pragma once

#include <cmath>
#include <cstdio>
#include <string>
#include <glm/vec3.hpp>

namespace mirrorbake::detail {

template <typename Real>
bool is_finite(const glm::vec<3, Real>& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// "(1, 2, 3)", for error messages.
template <typename Real>
std::string vec_text(const glm::vec<3, Real>& v) {
  char text[96];
  std::snprintf(text, sizeof text, "(%g, %g, %g)", static_cast<double>(v.x), static_cast<double>(v.y),
                static_cast<double>(v.z));
  return text;
}

}  // namespace mirrorbake::detail
