#include "moment_grid.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>

#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/projection/cube.hpp"

namespace mirrorbake {
namespace {

// Sums in double: the spread of a node is a millionth of what it is the difference of.
struct CellSums {
  std::array<double, 4> light{};
  std::array<std::array<double, 4>, 3> moment{};
  glm::dvec3 center{0.0};  ///< weighted by |light| of all channels
  glm::dvec3 middle{0.0};  ///< weighted by solid angle

  void add(const CellSums& other) {
    for (std::size_t c = 0; c < 4; ++c) {
      light[c] += other.light[c];
      for (std::size_t axis = 0; axis < 3; ++axis) moment[axis][c] += other.moment[axis][c];
    }
    center += other.center;
    middle += other.middle;
  }
};

// Grids that are summed apart and then together: few, where a grid is large.
int band_count(int cells) { return cells <= 128 ? 8 : cells <= 256 ? 2 : 1; }

// A bit of room above each of the lower 16.
std::uint32_t spread_bits(std::uint32_t v) {
  v = (v | v << 8U) & 0x00ff00ffU;
  v = (v | v << 4U) & 0x0f0f0f0fU;
  v = (v | v << 2U) & 0x33333333U;
  return (v | v << 1U) & 0x55555555U;
}

std::size_t cell_index(int face, int row, int column, int cells) {
  const std::size_t n = static_cast<std::size_t>(cells);
  return static_cast<std::size_t>(face) * n * n + (spread_bits(static_cast<std::uint32_t>(row)) << 1U |
                                                   spread_bits(static_cast<std::uint32_t>(column)));
}

std::size_t cell_of(const glm::dvec3& d, int cells) {
  const MapPoint p = cube_point_from_direction(d);
  return cell_index(p.face, texel_index(-p.y, cells), texel_index(p.x, cells), cells);
}

void deposit(const EnvMapView& map, int first_channel, const SourceTexels& texels, std::size_t begin_row,
             std::size_t end_row, int cells, std::vector<CellSums>& grid) {
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
      CellSums& cell = grid[cell_of(d, cells)];
      double size = 0.0;
      std::array<double, 4> light{0.0, 0.0, 0.0, angle};
      for (std::size_t c = 0; c < used; ++c) {
        light[c] = angle * static_cast<double>(texel[c]);
        size += std::abs(light[c]);
      }
      for (std::size_t c = 0; c < 4; ++c) {
        cell.light[c] += light[c];
        cell.moment[0][c] += light[c] * d.x;
        cell.moment[1][c] += light[c] * d.y;
        cell.moment[2][c] += light[c] * d.z;
      }
      cell.center += size * d;
      cell.middle += angle * d;
    }
  }
}

// Chord from the middle of a cell to its farthest corner; faces are alike.
double cell_reach(double x, double y, double half) {
  const glm::dvec3 middle = glm::normalize(direction_from_cube_point(0, x, y));
  double reach = 0.0;
  for (const double sx : {-half, half}) {
    for (const double sy : {-half, half}) {
      reach =
          std::max(reach, glm::length(glm::normalize(direction_from_cube_point(0, x + sx, y + sy)) - middle));
    }
  }
  return reach;
}

// About the middle of the cell, whose corners are within `reach`.
MomentNode node_of(const CellSums& sums, const glm::dvec3& middle, double reach) {
  MomentNode node{};
  node.bound = -1.0F;
  if (sums.light[3] == 0.0) return node;
  const glm::dvec3 toward = glm::length(sums.center) > 0.0 ? sums.center : sums.middle;
  const glm::dvec3 d = glm::length(toward) > 1e-12 * sums.light[3] ? glm::normalize(toward) : middle;
  // The float direction is the one that the loops use.
  const glm::dvec3 l0 = glm::dvec3(glm::vec3(d));
  for (int i = 0; i < 3; ++i) node.direction[i] = static_cast<float>(d[i]);
  node.bound = static_cast<float>((reach + glm::length(d - middle)) * 1.000001);
  for (std::size_t c = 0; c < 4; ++c) {
    const glm::dvec3 moment(sums.moment[0][c], sums.moment[1][c], sums.moment[2][c]);
    const glm::dvec3 shift = moment - l0 * sums.light[c];
    node.light[c] = static_cast<float>(sums.light[c]);
    for (int axis = 0; axis < 3; ++axis) node.shift[axis][c] = static_cast<float>(shift[axis]);
    // |l − l₀|² = 2 − 2 l·l₀ for unit vectors.
    node.spread[c] = static_cast<float>(-2.0 * glm::dot(shift, l0));
  }
  return node;
}

}  // namespace

int MomentGrid::cells_for(double node_width) {
  const double wanted = 2.0 / node_width;
  int cells = 8;
  // A bit coarser rather than four times as many.
  while (cells < kLargest && cells * 1.2 < wanted) cells *= 2;
  return cells;
}

MomentGrid::MomentGrid(const EnvMapView& map, int first_channel, const SourceTexels& texels, int cells)
    : cells_(cells), levels_(std::countr_zero(static_cast<unsigned>(cells)) + 1) {
  const std::size_t rows =
      static_cast<std::size_t>(face_count(map.layout.projection)) * static_cast<std::size_t>(texels.height());
  const std::size_t bands = static_cast<std::size_t>(band_count(cells));
  const std::size_t per_band = (rows + bands - 1) / bands;
  const std::size_t count = 6 * static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells);
  std::vector<std::vector<CellSums>> grids(bands);
  parallel_for(bands, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t band = begin; band < end; ++band) {
      grids[band].resize(count);
      deposit(map, first_channel, texels, std::min(rows, band * per_band),
              std::min(rows, (band + 1) * per_band), cells, grids[band]);
    }
  });
  std::vector<CellSums> sums = std::move(grids[0]);
  parallel_for(count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t band = 1; band < bands; ++band) {
      for (std::size_t i = begin; i < end; ++i) sums[i].add(grids[band][i]);
    }
  });
  grids.clear();

  std::size_t total = 0;
  for (int level = 0; level < levels_; ++level) {
    offsets_.push_back(total);
    const std::size_t n = static_cast<std::size_t>(cells >> level);
    total += 6 * n * n;
  }
  nodes_.resize(total);
  std::vector<std::vector<float>> widths(static_cast<std::size_t>(levels_));
  for (int level = 0; level < levels_; ++level) {
    const int n = cells >> level;
    const std::size_t side = static_cast<std::size_t>(n);
    std::vector<float>& width = widths[static_cast<std::size_t>(level)];
    width.resize(side * side);
    std::vector<double> reach(side * side);
    MomentNode* nodes = nodes_.data() + offsets_[static_cast<std::size_t>(level)];
    parallel_for(side, 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t line = begin; line < end; ++line) {
        const int row = static_cast<int>(line);
        for (int column = 0; column < n; ++column) {
          const std::size_t i = cell_index(0, row, column, n);
          width[i] = static_cast<float>(std::sqrt(cube_texel_solid_angle(n, column, row)));
          reach[i] = cell_reach(column_center(column, n), row_center(row, n), 1.0 / n);
        }
      }
    });
    parallel_for(6 * side, 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t line = begin; line < end; ++line) {
        const int face = static_cast<int>(line / side);
        const int row = static_cast<int>(line % side);
        for (int column = 0; column < n; ++column) {
          const std::size_t i = cell_index(face, row, column, n);
          const glm::dvec3 middle =
              glm::normalize(direction_from_cube_point(face, column_center(column, n), row_center(row, n)));
          nodes[i] = node_of(sums[i], middle, reach[i % reach.size()]);
        }
      }
    });
    if (level + 1 == levels_) break;
    std::vector<CellSums> coarser(sums.size() / 4);
    parallel_for(coarser.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = 4 * begin; i < 4 * end; ++i) coarser[i / 4].add(sums[i]);
    });
    sums = std::move(coarser);
  }
  fill_quads(widths);
}

void MomentGrid::fill_quads(const std::vector<std::vector<float>>& widths) {
  quads_.resize(offsets_.back() / 4);
  for (std::size_t level = 0; level + 1 < offsets_.size(); ++level) {
    const std::vector<float>& width = widths[level];
    parallel_for(6 * width.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const MomentNode& node = nodes_[offsets_[level] + i];
        Quad& quad = quads_[(offsets_[level] + i) / 4];
        for (std::size_t axis = 0; axis < 3; ++axis) quad.direction[axis][i % 4] = node.direction[axis];
        quad.bound[i % 4] = node.bound;
        quad.width[i % 4] = width[i % width.size()];
      }
    });
  }
}

void MomentGrid::find(const LobePlan& plan, int cells, const float* center, float radius,
                      std::vector<std::uint32_t>& list) const {
  constexpr float kHorizon = 1.41421356F;
  const int finest = std::countr_zero(static_cast<unsigned>(cells_ / cells));
  const float cut = static_cast<float>(plan.cut);
  struct Visit {
    int level;
    std::uint32_t index;  ///< in the level
  };
  std::array<Visit, 64> stack{};
  std::size_t depth = 0;
  for (std::uint32_t face = 0; face < 6; ++face) stack[depth++] = {levels_ - 1, face};
  while (depth > 0) {
    const Visit parent = stack[--depth];
    const int level = parent.level - 1;
    const std::size_t first = offsets_[static_cast<std::size_t>(level)] + 4 * std::size_t{parent.index};
    const Quad& quad = quads_[first / 4];
    std::array<float, 4> distance{};
    for (std::size_t k = 0; k < 4; ++k) {
      const float x = center[0] - quad.direction[0][k];
      const float y = center[1] - quad.direction[1][k];
      const float z = center[2] - quad.direction[2][k];
      distance[k] = std::sqrt(x * x + y * y + z * z);
    }
    for (std::uint32_t k = 0; k < 4; ++k) {
      const float reach = radius + quad.bound[k];
      const float nearest = distance[k] - reach;
      if (nearest > cut || quad.bound[k] < 0.0F) continue;
      bool enough = level <= finest;
      if (!enough) {
        float allowed = plan.allowed_at(nearest);
        if (plan.has_horizon && nearest < kHorizon && distance[k] + reach > kHorizon) {
          allowed = std::min(allowed, 0.05F);
        }
        enough = quad.width[k] <= 1.2F * allowed;
      }
      if (enough) {
        list.push_back(static_cast<std::uint32_t>(first) + k);
      } else {
        stack[depth++] = {level, 4 * parent.index + k};
      }
    }
  }
}

}  // namespace mirrorbake
