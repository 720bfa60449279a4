#include "pyramid_fill.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "mirrorbake/envmap/reads.hpp"

namespace mirrorbake {
namespace {

// An even number, which ends where it began: in the map, not beside it.
constexpr int kRelaxations = 4;

// A row of a face on a level.
struct Line {
  int face, row;
  std::uint32_t first;  // texel
};

// Calls body(line) for all rows of a level, in parallel.
template <typename Body>
void for_lines(const TexelTopology& topology, int level, const Body& body) {
  const auto width = static_cast<std::size_t>(topology.width(level));
  const auto height = static_cast<std::size_t>(topology.height(level));
  const std::size_t lines = height * static_cast<std::size_t>(topology.faces());
  parallel_for(lines, 1 + 1024 / width, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      body(Line{static_cast<int>(i / height), static_cast<int>(i % height),
                static_cast<std::uint32_t>(topology.level_offset(level) + i * width)});
    }
  });
}

// Mean of those of the texels that exist and that `counts`.
template <typename Counts>
Channels mean_of(std::span<const std::uint32_t> chosen, std::span<const Channels> texels,
                 const Counts& counts, int& count) {
  Channels sum{};
  count = 0;
  for (const std::uint32_t texel : chosen) {
    if (texel == kNoTexel || !counts(texel)) continue;
    sum += texels[texel];
    ++count;
  }
  return count > 0 ? sum / broadcast(static_cast<float>(count)) : sum;
}

// What the next coarser level shows at a texel's centre.
Channels from_coarser(const TexelTopology& topology, int level, std::uint32_t texel,
                      std::span<const Channels> texels) {
  TexelReads coarser;
  add_bilinear(topology, level + 1, topology.centre(texel), 1.0F, coarser);
  Channels value{};
  for (const TexelWeight& entry : coarser) value += broadcast(entry.weight) * texels[entry.texel];
  return value;
}

// The same of all open texels of a row.
void line_from_coarser(const TexelTopology& topology, int level, const Line& line,
                       const std::vector<std::uint8_t>& filled, std::span<Channels> texels) {
  const auto width = static_cast<std::uint32_t>(topology.width(level));
  const auto w = static_cast<std::uint32_t>(topology.width(level + 1));
  const auto open = [&](std::uint32_t column) { return filled[line.first + column] == 0; };
  const auto by_direction = [&](std::uint32_t column) {
    if (open(column))
      texels[line.first + column] = from_coarser(topology, level, line.first + column, texels);
  };
  const bool inside = line.row > 0 && line.row + 1 < topology.height(level) && width > 2;
  if (!inside) {
    for (std::uint32_t column = 0; column < width; ++column) by_direction(column);
    return;
  }
  // Inside a face a centre lies a quarter of a coarse texel from the next coarse one's.
  const Channels* above = texels.data() + topology.index({level + 1, line.face, (line.row - 1) / 2, 0});
  const Channels below_share = broadcast(line.row % 2 == 0 ? 0.75F : 0.25F);
  Vector coarse(w);
  for (std::uint32_t i = 0; i < w; ++i) {
    coarse[i] = (broadcast(1.0F) - below_share) * above[i] + below_share * above[w + i];
  }
  by_direction(0);
  for (std::uint32_t i = 0; i + 1 < w; ++i) {
    const std::uint32_t column = 2 * i + 1;
    const Channels left = coarse[i], right = coarse[i + 1];
    if (open(column)) texels[line.first + column] = broadcast(0.75F) * left + broadcast(0.25F) * right;
    if (open(column + 1))
      texels[line.first + column + 1] = broadcast(0.25F) * left + broadcast(0.75F) * right;
  }
  by_direction(width - 1);
}

// A texel on the edge of a face, and what lies beside it, counted from the level's first.
struct EdgeTexel {
  std::uint32_t texel;
  std::array<std::uint32_t, 4> neighbours;
};

std::vector<EdgeTexel> open_edges(const TexelTopology& topology, int level,
                                  const std::vector<std::uint8_t>& filled) {
  std::vector<EdgeTexel> edges;
  const auto w = static_cast<std::uint32_t>(topology.width(level));
  const auto h = static_cast<std::uint32_t>(topology.height(level));
  const auto first = static_cast<std::uint32_t>(topology.level_offset(level));
  std::uint32_t texel = first;
  const auto add = [&](std::uint32_t t) {
    if (filled[t]) return;
    EdgeTexel edge{t - first, topology.neighbours(t)};
    for (std::uint32_t& neighbour : edge.neighbours) neighbour -= neighbour == kNoTexel ? 0 : first;
    edges.push_back(edge);
  };
  for (int face = 0; face < topology.faces(); ++face) {
    for (std::uint32_t row = 0; row < h; ++row, texel += w) {
      const bool inner = row > 0 && row + 1 < h;
      for (std::uint32_t column = 0; column < w; column += inner && w > 1 ? w - 1 : 1) add(texel + column);
    }
  }
  return edges;
}

// Every open texel of a level becomes the mean of its neighbours, as often as that; `beside` is for a level's
// texels.
void relax(const TexelTopology& topology, int level, const std::vector<std::uint8_t>& filled,
           std::span<Channels> texels, Vector& beside) {
  const std::size_t first = topology.level_offset(level);
  const std::vector<EdgeTexel> edges = open_edges(topology, level, filled);
  beside.resize(topology.level_offset(level + 1) - first);
  const std::ptrdiff_t w = topology.width(level);
  const int h = topology.height(level);
  Channels *from = texels.data() + first, *to = beside.data();
  for (int sweep = 0; sweep < kRelaxations; ++sweep, std::swap(from, to)) {
    for_lines(topology, level, [&](const Line& line) {
      const Channels* at = from + (line.first - first);
      Channels* relaxed = to + (line.first - first);
      const std::uint8_t* known = filled.data() + line.first;
      if (line.row == 0 || line.row + 1 == h) {
        std::copy_n(at, w, relaxed);
        return;
      }
      relaxed[0] = at[0];
      for (std::ptrdiff_t i = 1; i + 1 < w; ++i) {
        const Channels mean = broadcast(0.25F) * (((at[i - w] + at[i + w]) + at[i - 1]) + at[i + 1]);
        relaxed[i] = known[i] ? at[i] : mean;
      }
      relaxed[w - 1] = at[w - 1];
    });
    for (const EdgeTexel& edge : edges) {
      int around = 0;
      to[edge.texel] = mean_of(
          edge.neighbours, {from, beside.size()}, [](std::uint32_t) { return true; }, around);
    }
  }
}

}  // namespace

void fill_unknown(const TexelTopology& topology, std::span<const std::uint8_t> known, FillTowards towards,
                  std::span<Channels> texels) {
  std::vector<std::uint8_t> filled(known.begin(), known.end());
  const auto is_filled = [&](std::uint32_t texel) { return filled[texel] != 0; };
  for (int level = 1; level < topology.levels(); ++level) {
    for_lines(topology, level, [&](const Line& line) {
      for (std::uint32_t i = line.first; i < line.first + static_cast<std::uint32_t>(topology.width(level));
           ++i) {
        if (filled[i]) continue;
        int count = 0;
        const Channels mean = mean_of(topology.children(i), texels, is_filled, count);
        if (count == 0) continue;
        texels[i] = towards == FillTowards::zero ? broadcast(0.25F * static_cast<float>(count)) * mean : mean;
        filled[i] = 1;
      }
    });
  }

  // On the coarsest level a face that is still unknown takes the mean of those that are not.
  const int coarsest = topology.levels() - 1;
  std::vector<std::uint32_t> last;
  for (std::size_t i = topology.level_offset(coarsest); i < topology.texels(); ++i) {
    last.push_back(static_cast<std::uint32_t>(i));
  }
  int count = 0;
  const Channels mean = mean_of(last, texels, is_filled, count);
  for (const std::uint32_t i : last) {
    if (!filled[i]) texels[i] = towards == FillTowards::zero ? Channels{} : mean;
    filled[i] = 1;
  }

  Vector beside;
  for (int level = coarsest - 1; level >= 0; --level) {
    for_lines(topology, level,
              [&](const Line& line) { line_from_coarser(topology, level, line, filled, texels); });
    relax(topology, level, filled, texels, beside);
  }
}

}  // namespace mirrorbake
