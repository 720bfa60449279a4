#include "pyramid_fill.hpp"

#include <vector>

#include "mirrorbake/envmap/reads.hpp"

namespace mirrorbake {
namespace {

constexpr int kRelaxations = 4;

// Calls body(texel) for every texel of a level, in parallel.
template <typename Body>
void for_each_texel(const TexelTopology& topology, int level, const Body& body) {
  const std::size_t first = topology.level_offset(level);
  parallel_for(topology.level_offset(level + 1) - first, 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(static_cast<std::uint32_t>(first + i));
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

}  // namespace

void fill_unknown(const TexelTopology& topology, std::span<const std::uint8_t> known, FillTowards towards,
                  std::span<Channels> texels) {
  std::vector<std::uint8_t> filled(known.begin(), known.end());
  const auto is_filled = [&](std::uint32_t texel) { return filled[texel] != 0; };
  for (int level = 1; level < topology.levels(); ++level) {
    for_each_texel(topology, level, [&](std::uint32_t i) {
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

  std::vector<Channels> relaxed;
  for (int level = coarsest - 1; level >= 0; --level) {
    for_each_texel(topology, level, [&](std::uint32_t i) {
      if (filled[i]) return;
      TexelReads coarser;
      add_bilinear(topology, level + 1, topology.centre(i), 1.0F, coarser);
      Channels value{};
      for (const TexelWeight& entry : coarser) value += broadcast(entry.weight) * texels[entry.texel];
      texels[i] = value;
    });
    const std::size_t first = topology.level_offset(level);
    relaxed.resize(topology.level_offset(level + 1) - first);
    for (int sweep = 0; sweep < kRelaxations; ++sweep) {
      for_each_texel(topology, level, [&](std::uint32_t i) {
        int neighbours = 0;
        relaxed[i - first] =
            filled[i] ? texels[i]
                      : mean_of(
                            topology.neighbours(i), texels, [](std::uint32_t) { return true; }, neighbours);
      });
      std::copy(relaxed.begin(), relaxed.end(), texels.begin() + static_cast<std::ptrdiff_t>(first));
    }
  }
}

}  // namespace mirrorbake
