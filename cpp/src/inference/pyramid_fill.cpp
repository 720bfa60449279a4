#include "pyramid_fill.hpp"

#include <array>
#include <vector>

#include "mirrorbake/envmap/reads.hpp"

namespace mirrorbake {
namespace {

constexpr int kRelaxations = 4;

// Calls body(i) for all i below a count, in parallel.
template <typename Body>
void for_each(std::size_t count, const Body& body) {
  parallel_for(count, 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
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
Channels from_coarser(const TexelTopology& topology, std::uint32_t texel, int level,
                      std::span<const Channels> texels) {
  const TexelPlace p = topology.place(texel);
  const int w = topology.width(level + 1);
  const int h = topology.height(level + 1);
  const int row = (p.row - 1) / 2;
  const int column = (p.column - 1) / 2;
  if (p.row > 0 && p.column > 0 && row + 1 < h && column + 1 < w) {
    // Inside a face a centre lies a quarter of a coarse texel from the next coarse one's.
    const float below = p.row % 2 == 0 ? 0.75F : 0.25F;
    const float right = p.column % 2 == 0 ? 0.75F : 0.25F;
    const Channels* corner = texels.data() + topology.index({level + 1, p.face, row, column});
    return broadcast((1.0F - below) * (1.0F - right)) * corner[0] +
           broadcast((1.0F - below) * right) * corner[1] + broadcast(below * (1.0F - right)) * corner[w] +
           broadcast(below * right) * corner[w + 1];
  }
  TexelReads coarser;
  add_bilinear(topology, level + 1, topology.centre(texel), 1.0F, coarser);
  Channels value{};
  for (const TexelWeight& entry : coarser) value += broadcast(entry.weight) * texels[entry.texel];
  return value;
}

}  // namespace

void fill_unknown(const TexelTopology& topology, std::span<const std::uint8_t> known, FillTowards towards,
                  std::span<Channels> texels) {
  std::vector<std::uint8_t> filled(known.begin(), known.end());
  const auto is_filled = [&](std::uint32_t texel) { return filled[texel] != 0; };
  for (int level = 1; level < topology.levels(); ++level) {
    const std::size_t first = topology.level_offset(level);
    for_each(topology.level_offset(level + 1) - first, [&](std::size_t of_level) {
      const auto i = static_cast<std::uint32_t>(first + of_level);
      if (filled[i]) return;
      int count = 0;
      const Channels mean = mean_of(topology.children(i), texels, is_filled, count);
      if (count == 0) return;
      texels[i] = towards == FillTowards::zero ? broadcast(0.25F * static_cast<float>(count)) * mean : mean;
      filled[i] = 1;
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

  std::vector<std::uint32_t> open;
  std::vector<std::array<std::uint32_t, 4>> neighbours;
  std::vector<Channels> relaxed;
  for (int level = coarsest - 1; level >= 0; --level) {
    open.clear();
    for (std::size_t i = topology.level_offset(level); i < topology.level_offset(level + 1); ++i) {
      if (!filled[i]) open.push_back(static_cast<std::uint32_t>(i));
    }
    neighbours.resize(open.size());
    relaxed.resize(open.size());
    for_each(open.size(), [&](std::size_t i) {
      texels[open[i]] = from_coarser(topology, open[i], level, texels);
      neighbours[i] = topology.neighbours(open[i]);
    });
    for (int sweep = 0; sweep < kRelaxations; ++sweep) {
      for_each(open.size(), [&](std::size_t i) {
        int around = 0;
        relaxed[i] = mean_of(
            neighbours[i], texels, [](std::uint32_t) { return true; }, around);
      });
      for_each(open.size(), [&](std::size_t i) { texels[open[i]] = relaxed[i]; });
    }
  }
}

}  // namespace mirrorbake
