#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "lobe_kernels.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "source_texels.hpp"

/// The light in cells of a cube by its moments. Cells are numbered face by face and in each along a Z, so
/// that the parts of cell i are 4 i … 4 i + 3 of a cube of twice as many.
namespace mirrorbake {

/// Of up to three channels, and of the solid angle as the fourth. In double: the second moments about the
/// middle are a millionth of what they are the difference of.
struct CellSums {
  std::array<double, 4> light{};
  std::array<std::array<double, 4>, 3> first{};   ///< by x, y, z
  std::array<std::array<double, 4>, 5> second{};  ///< by xx, yy, xy, xz, yz; zz is what is missing to `light`

  void add(const glm::dvec3& d, const std::array<double, 4>& lights) {
    const std::array<double, 5> products{d.x * d.x, d.y * d.y, d.x * d.y, d.x * d.z, d.y * d.z};
    for (std::size_t c = 0; c < 4; ++c) light[c] += lights[c];
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t c = 0; c < 4; ++c) first[k][c] += d[static_cast<int>(k)] * lights[c];
    }
    for (std::size_t k = 0; k < 5; ++k) {
      for (std::size_t c = 0; c < 4; ++c) second[k][c] += products[k] * lights[c];
    }
  }
  void add(const CellSums& other) {
    for (std::size_t c = 0; c < 4; ++c) {
      light[c] += other.light[c];
      for (std::size_t k = 0; k < 3; ++k) first[k][c] += other.first[k][c];
      for (std::size_t k = 0; k < 5; ++k) second[k][c] += other.second[k][c];
    }
  }
};

/// How large a cell is, in radians.
struct CellShape {
  float width = 0.0F;  ///< √ of its solid angle
  double reach = 0.0;  ///< chord from its middle to its farthest corner
};

CellShape cell_shape(std::size_t cell, int cells);

/// Of every cell, channels first_channel, +1 and +2 of the finest level as far as they exist.
std::vector<CellSums> cell_sums(const EnvMapView& map, int first_channel, const SourceTexels& texels,
                                int cells);

/// Of the parts of `whole`, numbers of cells in rising order, each of them cut `times` times into four.
std::vector<CellSums> part_sums(const EnvMapView& map, int first_channel, const SourceTexels& texels,
                                int cells, const std::vector<std::uint32_t>& whole, int times);

/// Sums of every four.
std::vector<CellSums> sums_of_four(const std::vector<CellSums>& parts);

/// About where most of the light comes from; `bound` is below 0 of a cell that has no texel.
MomentNode node_of(const CellSums& sums, std::size_t cell, int cells, const CellShape& shape);

}  // namespace mirrorbake
