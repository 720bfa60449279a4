#pragma once

#include <cmath>
#include <vector>

#include <glm/geometric.hpp>

#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/envmap/envmap.hpp"

namespace mirrorbake::testing {

/// A sky with detail and, in one corner, a sun of 1e5 times its radiance, 0.8 texels in radius.
inline EnvMap sunny_panorama(int height) {
  EnvMap map = make_envmap({{ProjectionKind::latlong}, 2 * height, height, 1, 3});
  const glm::dvec3 sun = glm::normalize(glm::dvec3(0.3, 0.6, 0.5));
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < 2 * height; ++column) {
      const glm::dvec3 d = direction_from_point(map.layout.projection, 0, column_center(column, 2 * height),
                                                row_center(row, height));
      float* texel = map.values.data() + map.layout.index(0, 0, row, column);
      const double noise = static_cast<double>(unit_float(static_cast<std::uint32_t>(
          hash64(static_cast<std::uint64_t>(row) * 4096U + static_cast<std::uint64_t>(column)))));
      for (int c = 0; c < 3; ++c) {
        texel[c] = static_cast<float>(0.3 + 0.2 * std::sin(5.0 * d[c] + 3.0 * d.y) + 0.3 * noise);
        if (glm::dot(d, sun) > std::cos(2.5 / height)) texel[c] = 1e5F;
      }
    }
  }
  return map;
}

}  // namespace mirrorbake::testing
