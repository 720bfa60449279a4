#include "regulariser.hpp"

#include "mirrorbake/envmap/cube_sampling.hpp"

namespace mirrorbake {
namespace {

struct TexelPosition {
  int level, face, row, column;
};

TexelPosition position_of(const CubePyramidLayout& layout, std::size_t texel) {
  int level = 0;
  while (texel >= layout.level_texels(level)) texel -= layout.level_texels(level++);
  const std::size_t n = static_cast<std::size_t>(layout.level_size(level));
  return {level, static_cast<int>(texel / (n * n)), static_cast<int>(texel / n % n),
          static_cast<int>(texel % n)};
}

}  // namespace

Regulariser::Regulariser(const CubePyramidLayout& layout, const std::vector<std::uint32_t>& texels,
                         const std::vector<std::uint32_t>& number_of, Weights weights)
    : weights_(weights), links_(texels.size()), diagonal_(texels.size()) {
  parallel_for(texels.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto [level, face, row, column] = position_of(layout, texels[i]);
      Links& links = links_[i];
      links.neighbours = {number_of[cube_texel_across_edges(layout, level, face, row - 1, column)],
                          number_of[cube_texel_across_edges(layout, level, face, row + 1, column)],
                          number_of[cube_texel_across_edges(layout, level, face, row, column - 1)],
                          number_of[cube_texel_across_edges(layout, level, face, row, column + 1)]};
      links.parent =
          level + 1 < layout.levels ? number_of[layout.index(level + 1, face, row / 2, column / 2)] : kNone;
      links.children.fill(kNone);
      for (int child = 0; level > 0 && child < 4; ++child) {
        links.children[static_cast<std::size_t>(child)] =
            number_of[layout.index(level - 1, face, 2 * row + child / 2, 2 * column + child % 2)];
      }
    }
  });
  const auto child_count = [this](std::size_t i) {
    int count = 0;
    for (std::uint32_t child : links_[i].children) count += child != kNone;
    return static_cast<float>(count);
  };
  parallel_for(texels.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      float d = 0.0F;
      for (std::uint32_t neighbour : links_[i].neighbours)
        d += neighbour != kNone ? weights_.smoothness : 0.0F;
      d += weights_.level_agreement * 0.25F * child_count(i);
      if (links_[i].parent != kNone) d += weights_.level_agreement * 0.25F / child_count(links_[i].parent);
      diagonal_[i] = d;
    }
  });
}

ChannelSums Regulariser::apply(const std::vector<Channels>& x, float magnitude,
                               std::vector<Channels>& scratch, std::vector<Channels>& y) const {
  // First the disagreement of every texel with its children, times ω.
  scratch.resize(x.size());
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Channels sum{};
      float count = 0.0F;
      for (std::uint32_t child : links_[i].children) {
        if (child == kNone) continue;
        sum += x[child];
        count += 1.0F;
      }
      scratch[i] = broadcast(0.25F) * (broadcast(count) * x[i] - sum);
    }
  });
  return parallel_channel_sums(x.size(), [&](std::size_t begin, std::size_t end) {
    ChannelSums sums{};
    for (std::size_t i = begin; i < end; ++i) {
      const Links& links = links_[i];
      Channels difference{};
      for (std::uint32_t neighbour : links.neighbours) {
        if (neighbour != kNone) difference += x[i] - x[neighbour];
      }
      Channels disagreement = scratch[i];
      if (links.parent != kNone) {
        float count = 0.0F;
        for (std::uint32_t sibling : links_[links.parent].children) count += sibling != kNone ? 1.0F : 0.0F;
        disagreement -= scratch[links.parent] / broadcast(count);
      }
      y[i] = broadcast(weights_.smoothness) * difference +
             broadcast(weights_.level_agreement) * disagreement + broadcast(magnitude) * x[i];
      add_product(sums, x[i], y[i]);
    }
    return sums;
  });
}

}  // namespace mirrorbake
