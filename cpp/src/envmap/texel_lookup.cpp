#include "mirrorbake/envmap/texel_lookup.hpp"

#include <algorithm>

#include "mirrorbake/projection/traits.hpp"

namespace mirrorbake {

FaceTexel continued(const Projection& projection, int width, int height, FaceTexel texel) {
  if (texel.row >= 0 && texel.row < height && texel.column >= 0 && texel.column < width) return texel;
  const Rim rim = traits(projection.kind).rim;
  if (rim == Rim::singular || rim == Rim::boundary) {
    return {texel.face, std::clamp(texel.row, 0, height - 1), std::clamp(texel.column, 0, width - 1)};
  }
  // The direction of the missing texel's centre, seen from the neighbouring face, is shifted along the edge
  // by less than half a texel, so that it still falls into the texel across the edge.
  const MapPoint point = point_from_direction(
      projection, direction_from_point(projection, texel.face, column_center(texel.column, width),
                                       row_center(texel.row, height)));
  return {point.face, texel_index(-point.y, height), texel_index(point.x, width)};
}

std::size_t texel_at(const EnvMapLayout& layout, int level, int face, int row, int column) {
  const FaceTexel texel = continued(layout.projection, layout.level_width(level), layout.level_height(level),
                                    {face, row, column});
  return layout.index(level, texel.face, texel.row, texel.column);
}

void interpolate(const EnvMapView& map, int level, int face, double column, double row,
                 std::span<double> result) {
  const EnvMapLayout& layout = map.layout;
  const int width = layout.level_width(level);
  const int height = layout.level_height(level);
  std::array<const float*, 4> texels{};
  std::array<double, 4> weights{};
  std::size_t count = 0;
  const BilinearCell<double> cell = bilinear_cell(column, row);
  if (cell.inside(width, height)) {
    const std::size_t next = result.size();
    texels[0] = map.values.data() + layout.index(level, face, cell.row, cell.column);
    texels[1] = texels[0] + next;
    texels[2] = texels[0] + next * static_cast<std::size_t>(width);
    texels[3] = texels[2] + next;
    weights = cell.weights();
    count = 4;
  } else {
    const bool cube = layout.projection.kind == ProjectionKind::cube;
    add_face_bilinear(cell, width, height, cube, 1.0, [&](int r, int c, double weight) {
      texels[count] = map.values.data() + texel_at(layout, level, face, r, c);
      weights[count++] = weight;
    });
  }
  for (std::size_t c = 0; c < result.size(); ++c) {
    double sum = 0.0;
    for (std::size_t i = 0; i < count; ++i) sum += weights[i] * static_cast<double>(texels[i][c]);
    result[c] = sum;
  }
}

}  // namespace mirrorbake
