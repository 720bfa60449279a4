#include "cell_sums.hpp"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/projection/cube.hpp"

namespace mirrorbake {
namespace {

// A bit of room above each of the lower 16.
std::uint32_t spread_bits(std::uint32_t v) {
  v = (v | v << 8U) & 0x00ff00ffU;
  v = (v | v << 4U) & 0x0f0f0f0fU;
  v = (v | v << 2U) & 0x33333333U;
  return (v | v << 1U) & 0x55555555U;
}

std::uint32_t gather_bits(std::uint32_t v) {
  v &= 0x55555555U;
  v = (v | v >> 1U) & 0x33333333U;
  v = (v | v >> 2U) & 0x0f0f0f0fU;
  v = (v | v >> 4U) & 0x00ff00ffU;
  return (v | v >> 8U) & 0x0000ffffU;
}

std::size_t cell_of(const glm::dvec3& d, int cells) {
  const MapPoint p = cube_point_from_direction(d);
  const std::size_t n = static_cast<std::size_t>(cells);
  return static_cast<std::size_t>(p.face) * n * n +
         (spread_bits(static_cast<std::uint32_t>(texel_index(-p.y, cells))) << 1U |
          spread_bits(static_cast<std::uint32_t>(texel_index(p.x, cells))));
}

struct CellPlace {
  int face;
  int row;
  int column;
};

CellPlace place_of(std::size_t cell, int cells) {
  const std::size_t per_face = static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells);
  const std::uint32_t z = static_cast<std::uint32_t>(cell % per_face);
  return {static_cast<int>(cell / per_face), static_cast<int>(gather_bits(z >> 1U)),
          static_cast<int>(gather_bits(z))};
}

// Calls visit(cell, direction, lights) for every texel of these rows of all faces.
template <typename Visit>
void visit_texels(const EnvMapView& map, int first_channel, const SourceTexels& texels, std::size_t begin_row,
                  std::size_t end_row, int cells, const Visit& visit) {
  const std::size_t channels = static_cast<std::size_t>(map.layout.channels);
  const std::size_t used = std::min<std::size_t>(3, channels - static_cast<std::size_t>(first_channel));
  for (std::size_t line = begin_row; line < end_row; ++line) {
    const int face = static_cast<int>(line) / texels.height();
    const int row = static_cast<int>(line) % texels.height();
    const float* values = map.values.data() + map.layout.index(0, face, row / texels.parts(), 0) +
                          static_cast<std::size_t>(first_channel);
    for (int column = 0; column < texels.width(); ++column) {
      const double angle = texels.solid_angle(row, column);
      if (!(angle > 0.0)) continue;
      const glm::dvec3 d = texels.direction(face, row, column);
      const float* texel = values + static_cast<std::size_t>(column / texels.parts()) * channels;
      std::array<double, 4> light{0.0, 0.0, 0.0, angle};
      for (std::size_t c = 0; c < used; ++c) light[c] = angle * static_cast<double>(texel[c]);
      visit(cell_of(d, cells), d, light);
    }
  }
}

// Sums of `count` cells; add(sums, begin_row, end_row) adds those of some rows. Bands of rows are summed
// apart and then together, the same for any number of threads; few, where that takes much memory.
template <typename Add>
std::vector<CellSums> in_bands(std::size_t rows, std::size_t count, const Add& add) {
  const std::size_t bands = count <= 100000 ? 8 : count <= 400000 ? 2 : 1;
  const std::size_t per_band = (rows + bands - 1) / bands;
  std::vector<std::vector<CellSums>> grids(bands);
  parallel_for(bands, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t band = begin; band < end; ++band) {
      grids[band].resize(count);
      add(grids[band], std::min(rows, band * per_band), std::min(rows, (band + 1) * per_band));
    }
  });
  std::vector<CellSums> sums = std::move(grids[0]);
  parallel_for(count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t band = 1; band < bands; ++band) {
      for (std::size_t i = begin; i < end; ++i) sums[i].add(grids[band][i]);
    }
  });
  return sums;
}

std::size_t row_count(const EnvMapView& map, const SourceTexels& texels) {
  return static_cast<std::size_t>(face_count(map.layout.projection)) *
         static_cast<std::size_t>(texels.height());
}

glm::dvec3 first_of(const CellSums& sums, std::size_t c) {
  return {sums.first[0][c], sums.first[1][c], sums.first[2][c]};
}

glm::dmat3 second_of(const CellSums& sums, std::size_t c) {
  const auto& s = sums.second;
  const double zz = sums.light[c] - s[0][c] - s[1][c];
  return {s[0][c], s[2][c], s[3][c], s[2][c], s[1][c], s[4][c], s[3][c], s[4][c], zz};
}

// Where most of the light of a cell comes from; the middle of the cell where that has light of both signs.
glm::dvec3 center_of(const CellSums& sums, const glm::dvec3& middle, double reach) {
  for (const glm::dvec3& toward :
       {first_of(sums, 0) + first_of(sums, 1) + first_of(sums, 2), first_of(sums, 3)}) {
    const double length = glm::length(toward);
    if (length > 0.0 && glm::length(toward / length - middle) <= reach) return toward / length;
  }
  return middle;
}

}  // namespace

CellShape cell_shape(std::size_t cell, int cells) {
  const CellPlace p = place_of(cell, cells);
  const double x = column_center(p.column, cells);
  const double y = row_center(p.row, cells);
  const double half = 1.0 / cells;
  const glm::dvec3 middle = glm::normalize(direction_from_cube_point(0, x, y));
  CellShape shape{static_cast<float>(std::sqrt(cube_texel_solid_angle(cells, p.column, p.row)))};
  for (const double sx : {-half, half}) {
    for (const double sy : {-half, half}) {
      const glm::dvec3 corner = glm::normalize(direction_from_cube_point(0, x + sx, y + sy));
      shape.reach = std::max(shape.reach, glm::length(corner - middle));
    }
  }
  return shape;
}

std::vector<CellSums> cell_sums(const EnvMapView& map, int first_channel, const SourceTexels& texels,
                                int cells) {
  const std::size_t count = 6 * static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells);
  return in_bands(row_count(map, texels), count,
                  [&](std::vector<CellSums>& sums, std::size_t begin, std::size_t end) {
                    visit_texels(map, first_channel, texels, begin, end, cells,
                                 [&](std::size_t cell, const glm::dvec3& d,
                                     const std::array<double, 4>& light) { sums[cell].add(d, light); });
                  });
}

std::vector<CellSums> part_sums(const EnvMapView& map, int first_channel, const SourceTexels& texels,
                                int cells, const std::vector<std::uint32_t>& whole, int times) {
  constexpr std::uint32_t kNone = 0xffffffffU;
  const unsigned bits = 2U * static_cast<unsigned>(times);
  std::vector<std::uint32_t> number(6 * static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells),
                                    kNone);
  for (std::size_t i = 0; i < whole.size(); ++i) number[whole[i]] = static_cast<std::uint32_t>(i);
  return in_bands(row_count(map, texels), whole.size() << bits,
                  [&](std::vector<CellSums>& sums, std::size_t begin, std::size_t end) {
                    visit_texels(
                        map, first_channel, texels, begin, end, cells << times,
                        [&](std::size_t part, const glm::dvec3& d, const std::array<double, 4>& light) {
                          const std::size_t of = number[part >> bits];
                          if (of == kNone) return;
                          sums[of << bits | (part & ((std::size_t{1} << bits) - 1))].add(d, light);
                        });
                  });
}

std::vector<CellSums> sums_of_four(const std::vector<CellSums>& parts) {
  std::vector<CellSums> sums(parts.size() / 4);
  parallel_for(sums.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = 4 * begin; i < 4 * end; ++i) sums[i / 4].add(parts[i]);
  });
  return sums;
}

MomentNode node_of(const CellSums& sums, std::size_t cell, int cells, const CellShape& shape) {
  MomentNode node{};
  node.bound = -1.0F;
  if (sums.light[3] == 0.0) return node;
  const CellPlace p = place_of(cell, cells);
  const glm::dvec3 middle = glm::normalize(
      direction_from_cube_point(p.face, column_center(p.column, cells), row_center(p.row, cells)));
  const glm::dvec3 d = center_of(sums, middle, shape.reach);
  const glm::dvec3 aside = std::abs(d.y) < 0.7 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
  const glm::dvec3 u = glm::normalize(glm::cross(aside, d));
  // The rounded directions are those that the loops use.
  const glm::dvec3 center = glm::dvec3(glm::vec3(d));
  const std::array<glm::dvec3, 2> tangents{glm::dvec3(glm::vec3(u)), glm::dvec3(glm::vec3(glm::cross(d, u)))};
  for (int i = 0; i < 3; ++i) {
    node.direction[i] = static_cast<float>(center[i]);
    for (std::size_t t = 0; t < 2; ++t) node.tangent[t][i] = static_cast<float>(tangents[t][i]);
  }
  node.bound = static_cast<float>((shape.reach + glm::length(d - middle)) * 1.000001);
  for (std::size_t c = 0; c < 4; ++c) {
    const double light = sums.light[c];
    const glm::dvec3 first = first_of(sums, c);
    const glm::dmat3 second = second_of(sums, c);
    const auto moment = [&](const glm::dvec3& a, const glm::dvec3& b) {
      const double at_a = glm::dot(a, center);
      const double at_b = glm::dot(b, center);
      return glm::dot(a, second * b) - at_a * glm::dot(b, first) - at_b * glm::dot(a, first) +
             at_a * at_b * light;
    };
    node.light[c] = static_cast<float>(light);
    for (std::size_t t = 0; t < 2; ++t) {
      node.shift[t][c] =
          static_cast<float>(glm::dot(tangents[t], first) - light * glm::dot(tangents[t], center));
      node.spread[t][c] = static_cast<float>(0.5 * moment(tangents[t], tangents[t]));
    }
    node.spread[2][c] = static_cast<float>(0.5 * moment(tangents[0], tangents[1]));
  }
  return node;
}

}  // namespace mirrorbake
