#include "regulariser.hpp"

#include <algorithm>

namespace mirrorbake {

Regulariser::Regulariser(std::span<const TexelTopology> maps, const std::vector<std::uint32_t>& number_of,
                         std::size_t numbers, const SolveOptions& options)
    : options_(options), row_sums_(numbers) {
  if (options.smoothness == 0.0F && options.level_agreement == 0.0F) return;
  links_.resize(numbers);
  std::vector<std::array<std::uint32_t, 4>> children(numbers, {kNoTexel, kNoTexel, kNoTexel, kNoTexel});
  for (std::size_t first = 0; first < number_of.size();) {
    for (const TexelTopology& map : maps) {
      const auto number = [&](std::uint32_t texel) {
        return texel == kNoTexel ? kNoTexel : number_of[first + texel];
      };
      parallel_for(map.texels(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
          const auto texel = static_cast<std::uint32_t>(t);
          const std::uint32_t i = number(texel);
          if (i == kNoTexel) continue;
          const auto neighbours = map.neighbours(texel);
          const auto below = map.children(texel);
          for (std::size_t k = 0; k < 4; ++k) {
            links_[i].neighbours[k] = number(neighbours[k]);
            children[i][k] = number(below[k]);
          }
        }
      });
      first += map.texels();
    }
  }
  const auto child_count = [&](std::size_t i) {
    int count = 0;
    for (std::uint32_t child : children[i]) count += child != kNoTexel;
    return static_cast<float>(count);
  };
  for (std::size_t i = 0; i < numbers; ++i) {
    const float count = child_count(i);
    if (count == 0.0F) continue;
    for (const std::uint32_t child : children[i]) {
      if (child != kNoTexel) {
        links_[child].parent = static_cast<std::uint32_t>(parents_.size());
        links_[child].share = 1.0F / count;
      }
    }
    parents_.push_back({static_cast<std::uint32_t>(i), count, children[i]});
  }
  parallel_for(numbers, kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      float sum = 0.0F;
      for (std::uint32_t& neighbour : links_[i].neighbours) {
        if (neighbour == kNoTexel) {
          neighbour = static_cast<std::uint32_t>(i);
        } else {
          sum += 2.0F * options_.smoothness;
        }
      }
      const float of_child = links_[i].share > 0.0F ? 1.0F : 0.0F;
      row_sums_[i] = sum + options_.level_agreement * 0.5F * (child_count(i) + of_child);
    }
  });
}

void Regulariser::prepare(const TexelVector& x, Vector& scratch) const {
  // The disagreement of every parent with its children, times ω.
  if (!acts()) return;
  scratch.resize(std::max<std::size_t>(parents_.size(), 1));
  parallel_for(parents_.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      const Parent& parent = parents_[p];
      Channels sum{};
      for (std::uint32_t child : parent.children) {
        if (child != kNoTexel) sum += x[child];
      }
      scratch[p] = broadcast(0.25F) * (broadcast(parent.count) * x[parent.number] - sum);
    }
  });
}

ChannelSums Regulariser::add(std::size_t begin, std::size_t end, Channels factor, Channels near,
                             const TexelVector& x, const Vector& scratch, Channels* y) const {
  // Products that are added up in float before they go into doubles.
  constexpr std::size_t kInFloat = 128;
  const Channels smooth = factor * broadcast(options_.smoothness);
  const Channels agree = factor * broadcast(options_.level_agreement);
  ChannelSums sums{};
  for (std::size_t first = begin; first < end; first += kInFloat) {
    const std::size_t last = std::min(first + kInFloat, end);
    Channels part{};
    for (std::size_t i = first; i < last; ++i) {
      const Channels at = x.with_next(i);
      Channels g = near * at;
      if (acts()) {
        const Links& links = links_[i];
        const auto& [above, below, left, right] = links.neighbours;
        const Channels difference = ((at - x.with_next(above)) + (at - x.with_next(below))) +
                                    ((at - x.with_next(left)) + (at - x.with_next(right)));
        g += smooth * difference - agree * (broadcast(links.share) * scratch[links.parent]);
      }
      y[i - begin] += g;
      part += at * g;
    }
    for (std::size_t k = 0; k < 4; ++k) sums[k] += static_cast<double>(part[k]);
  }
  auto parent = std::ranges::lower_bound(parents_, begin, {}, &Parent::number);
  while (parent != parents_.end() && parent->number < end) {
    Channels part{};
    for (std::size_t count = 0; count < kInFloat && parent != parents_.end() && parent->number < end;
         ++count) {
      const Channels g = agree * scratch[static_cast<std::size_t>(parent - parents_.begin())];
      y[parent->number - begin] += g;
      part += x[parent->number] * g;
      ++parent;
    }
    for (std::size_t k = 0; k < 4; ++k) sums[k] += static_cast<double>(part[k]);
  }
  return sums;
}

}  // namespace mirrorbake
