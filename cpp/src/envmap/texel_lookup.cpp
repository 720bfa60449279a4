#include "mirrorbake/envmap/texel_lookup.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace mirrorbake {

std::size_t texel_at(const EnvMapLayout& layout, int level, int face, int row, int column) {
  const int width = layout.level_width(level);
  const int height = layout.level_height(level);
  if (row >= 0 && row < height && column >= 0 && column < width)
    return layout.index(level, face, row, column);
  const double x = column_center(column, width);
  const double y = row_center(row, height);
  const Projection& projection = layout.projection;
  const bool continues =
      projection.kind != ProjectionKind::sphere_map && projection.kind != ProjectionKind::fisheye;
  if (continues) {
    const MapPoint point = point_from_direction(projection, direction_from_point(projection, face, x, y));
    return layout.index(level, point.face, texel_index(-point.y, height), texel_index(point.x, width));
  }
  return layout.index(level, face, std::clamp(row, 0, height - 1), std::clamp(column, 0, width - 1));
}

void interpolate(const EnvMapView& map, int level, int face, double column, double row,
                 std::span<double> result) {
  const EnvMapLayout& layout = map.layout;
  const double x = column - 0.5;
  const double y = row - 0.5;
  const int left = static_cast<int>(std::floor(x));
  const int top = static_cast<int>(std::floor(y));
  const double fx = x - left;
  const double fy = y - top;
  std::array<double, 4> weights = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  const int width = layout.level_width(level);
  const int height = layout.level_height(level);
  std::array<std::size_t, 4> texels{};
  if (left >= 0 && top >= 0 && left + 1 < width && top + 1 < height) {
    const std::size_t next = static_cast<std::size_t>(layout.channels);
    texels[0] = layout.index(level, face, top, left);
    texels[1] = texels[0] + next;
    texels[2] = texels[0] + next * static_cast<std::size_t>(width);
    texels[3] = texels[2] + next;
  } else {
    std::size_t missing = 4;
    for (std::size_t i = 0; i < 4; ++i) {
      const int r = top + static_cast<int>(i / 2);
      const int c = left + static_cast<int>(i % 2);
      const bool at_corner = (r < 0 || r >= height) && (c < 0 || c >= width);
      if (at_corner && layout.projection.kind == ProjectionKind::cube) {
        missing = i;
      } else {
        texels[i] = texel_at(layout, level, face, r, c);
      }
    }
    if (missing < 4) {
      const double third = weights[missing] / 3.0;
      weights[missing] = 0.0;
      for (std::size_t i = 0; i < 4; ++i) {
        if (i != missing) weights[i] += third;
      }
      texels[missing] = texels[(missing + 1) % 4];
    }
  }
  for (std::size_t c = 0; c < result.size(); ++c) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 4; ++i) sum += weights[i] * static_cast<double>(map.values[texels[i] + c]);
    result[c] = sum;
  }
}

}  // namespace mirrorbake
