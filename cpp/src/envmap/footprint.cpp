#include "mirrorbake/envmap/footprint.hpp"

#include <cmath>
#include <cstddef>
#include <string>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {

Footprint footprint_from_corners(const std::array<glm::vec3, 4>& corners) {
  std::array<glm::dvec3, 4> d;
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < 4; ++i) {
    d[i] = glm::normalize(glm::dvec3(corners[i]));
    sum += d[i];
  }
  const double length = glm::length(sum);
  if (!(length > 1e-12) || !std::isfinite(length)) return {};
  return {glm::vec3(sum / length), glm::vec3(0.5 * (d[1] - d[0] + d[2] - d[3])),
          glm::vec3(0.5 * (d[3] - d[0] + d[2] - d[1]))};
}

glm::vec3 reflected_differential(glm::vec3 direction, glm::vec3 normal, glm::vec3 dd, glm::vec3 dn) {
  return dd - 2.0F * (glm::dot(direction, normal) * dn +
                      (glm::dot(dd, normal) + glm::dot(direction, dn)) * normal);
}

void quad_differentials(int width, int height, std::span<const glm::vec3> directions,
                        std::span<glm::vec3> ddx, std::span<glm::vec3> ddy) {
  if (width < 1 || height < 1) {
    throw InvalidArgument("width, height", std::to_string(width) + ", " + std::to_string(height),
                          "at least 1");
  }
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (directions.size() != count || ddx.size() != count || ddy.size() != count) {
    throw InvalidArgument("directions, ddx, ddy", "of another length",
                          std::to_string(count) + " entries each");
  }
  const auto at = [&](int row, int column) -> glm::vec3 {
    return directions[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                      static_cast<std::size_t>(column)];
  };
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const int left = column % 2 == 0 && column + 1 < width ? column : column - 1;
      const int top = row % 2 == 0 && row + 1 < height ? row : row - 1;
      const std::size_t i =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
      ddx[i] = left >= 0 ? at(row, left + 1) - at(row, left) : glm::vec3(0.0F);
      ddy[i] = top >= 0 ? at(top + 1, column) - at(top, column) : glm::vec3(0.0F);
    }
  }
}

}  // namespace mirrorbake
