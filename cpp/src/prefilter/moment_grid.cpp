#include "moment_grid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "cell_sums.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

// How many times bright cells of the finest level are cut into four.
int times_cut(int cells) { return cells <= 64 ? 2 : cells == 128 ? 1 : 0; }

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
  std::size_t total = 0;
  for (int level = 0; level < levels_; ++level) {
    offsets_.push_back(total);
    const std::size_t n = static_cast<std::size_t>(cells >> level);
    total += 6 * n * n;
  }
  total += 2;  // to the next quad after six faces
  nodes_.resize(total);
  quads_.resize(total / 4);
  std::vector<CellSums> sums = cell_sums(map, first_channel, texels, cells);
  for (int level = 0; level < levels_; ++level) {
    const int n = cells >> level;
    const std::size_t per_face = static_cast<std::size_t>(n) * static_cast<std::size_t>(n);
    std::vector<CellShape> shapes(per_face);
    parallel_for(per_face, 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) shapes[i] = cell_shape(i, n);
    });
    const std::size_t offset = offsets_[static_cast<std::size_t>(level)];
    parallel_for(sums.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const CellShape& shape = shapes[i % per_face];
        put(offset + i, node_of(sums[i], i, n, shape), shape.width);
        quads_[(offset + i) / 4].child[i % 4] =
            level == 0 ? kNoChild
                       : static_cast<std::uint32_t>(offsets_[static_cast<std::size_t>(level) - 1] / 4 + i);
      }
    });
    if (level + 1 < levels_) sums = sums_of_four(sums);
  }
  find_bright();
  cut_bright(map, first_channel, texels);
}

void MomentGrid::put(std::size_t at, const MomentNode& node, float width) {
  nodes_[at] = node;
  Quad& quad = quads_[at / 4];
  for (std::size_t axis = 0; axis < 3; ++axis) quad.direction[axis][at % 4] = node.direction[axis];
  quad.bound[at % 4] = node.bound;
  quad.width[at % 4] = width;
  quad.child[at % 4] = kNoChild;
}

// Sixteen times the radiance of the middle one of 384 equal cells, so that a half of them at most is bright,
// and, where all but lamps is black, an eighth of the mean.
void MomentGrid::find_bright() {
  const std::size_t first = offsets_[static_cast<std::size_t>(levels_ - 4)];
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> radiance;
    double light = 0.0;
    double angle = 0.0;
    for (std::size_t i = first; i < first + 384; ++i) {
      const MomentNode& node = nodes_[i];
      if (node.bound < 0.0F) continue;
      const double of_cell = std::abs(static_cast<double>(node.light[c]));
      const double its_angle = static_cast<double>(node.light[3]);
      radiance.push_back(of_cell / its_angle);
      light += of_cell;
      angle += its_angle;
    }
    if (radiance.empty()) continue;
    const auto middle = radiance.begin() + static_cast<std::ptrdiff_t>(radiance.size() / 2);
    std::nth_element(radiance.begin(), middle, radiance.end());
    bright_[c] = static_cast<float>(std::max(16.0 * *middle, light / angle / 8.0));
  }
  parallel_for(nodes_.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) quads_[i / 4].bright[i % 4] = is_bright(i);
  });
}

// A light that is a point beside its cell is met by the moments of the cell as it is.
bool MomentGrid::is_bright(std::size_t at) const {
  constexpr float kPoint = 0.1F;
  const MomentNode& node = nodes_[at];
  const float width = kPoint * quads_[at / 4].width[at % 4];
  for (std::size_t c = 0; c < 3; ++c) {
    const float light = std::abs(node.light[c]);
    if (light > bright_[c] * node.light[3] &&
        2.0F * std::abs(node.spread[0][c] + node.spread[1][c]) > width * width * light) {
      return true;
    }
  }
  return false;
}

void MomentGrid::cut_bright(const EnvMapView& map, int first_channel, const SourceTexels& texels) {
  const int times = times_cut(cells_);
  std::vector<std::uint32_t> whole;
  for (std::size_t i = 0; times > 0 && i < offsets_[1]; ++i) {
    if (quads_[i / 4].bright[i % 4]) whole.push_back(static_cast<std::uint32_t>(i));
  }
  if (whole.empty()) return;
  std::vector<CellSums> sums = part_sums(map, first_channel, texels, cells_, whole, times);
  std::size_t children = 0;  // first node of those that are cut once more
  for (int cut = times; cut > 0; --cut) {
    const unsigned bits = 2U * static_cast<unsigned>(cut);
    const std::size_t offset = nodes_.size();
    nodes_.resize(offset + sums.size());
    quads_.resize(nodes_.size() / 4);
    parallel_for(sums.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t cell =
            (std::size_t{whole[i >> bits]} << bits) | (i & ((std::size_t{1} << bits) - 1));
        const std::size_t n = static_cast<std::size_t>(cells_) << static_cast<unsigned>(cut);
        const CellShape shape = cell_shape(cell % (n * n), static_cast<int>(n));
        put(offset + i, node_of(sums[i], cell, static_cast<int>(n), shape), shape.width);
        Quad& quad = quads_[(offset + i) / 4];
        if (cut < times) quad.child[i % 4] = static_cast<std::uint32_t>(children / 4 + i);
        quad.bright[i % 4] = is_bright(offset + i);
      }
    });
    children = offset;
    sums = sums_of_four(sums);
  }
  for (std::size_t i = 0; i < whole.size(); ++i) {
    quads_[whole[i] / 4].child[whole[i] % 4] = static_cast<std::uint32_t>(children / 4 + i);
  }
}

void MomentGrid::find(const LobePlan& plan, int cells, const float* center, float radius,
                      std::vector<std::uint32_t>& list) const {
  constexpr float kHorizon = 1.41421356F;
  const int finest = std::countr_zero(static_cast<unsigned>(cells_ / cells));
  const int finest_bright = finest - times_cut(cells);
  const float cut = static_cast<float>(plan.cut);
  struct Visit {
    int level;  ///< of the nodes of the quad; below 0 of parts
    std::uint32_t quad;
  };
  std::array<Visit, 64> stack{};
  std::size_t depth = 0;
  for (std::uint32_t face = 0; face < 6; ++face) {
    const std::size_t root = offsets_.back() + face;
    stack[depth++] = {levels_ - 2, quads_[root / 4].child[root % 4]};
  }
  while (depth > 0) {
    const Visit visit = stack[--depth];
    const Quad& quad = quads_[visit.quad];
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
      const bool bright = quad.bright[k];
      bool enough = visit.level <= (bright ? finest_bright : finest);
      if (!enough) {
        float allowed = bright ? plan.allowed_bright_at(nearest) : plan.allowed_at(nearest);
        if (nearest < kHorizon && distance[k] + reach > kHorizon) {
          allowed = std::min(allowed, bright ? plan.bright_at_horizon : plan.at_horizon);
        }
        enough = quad.width[k] <= 1.2F * allowed;
      }
      if (enough) {
        list.push_back(4 * visit.quad + k);
      } else {
        stack[depth++] = {visit.level - 1, quad.child[k]};
      }
    }
  }
}

}  // namespace mirrorbake
