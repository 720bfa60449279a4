#include "regulariser.hpp"

namespace mirrorbake {

Regulariser::Regulariser(std::span<const TexelTopology> maps, const std::vector<std::uint32_t>& number_of,
                         std::size_t numbers, const SolveOptions& options)
    : options_(options), diagonal_(numbers) {
  if (options.smoothness == 0.0F && options.level_agreement == 0.0F) return;
  links_.resize(numbers);
  std::vector<std::array<std::uint32_t, 4>> children(numbers);
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
          links_[i].parent = number(map.parent(texel));
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
    if (count > 0.0F) parents_.push_back({static_cast<std::uint32_t>(i), count, children[i]});
  }
  parallel_for(numbers, kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Links& links = links_[i];
      float d = 0.0F;
      for (std::uint32_t& neighbour : links.neighbours) {
        if (neighbour == kNoTexel) {
          neighbour = static_cast<std::uint32_t>(i);
        } else {
          d += options_.smoothness;
        }
      }
      d += options_.level_agreement * 0.25F * child_count(i);
      if (links.parent == kNoTexel) {
        links.parent = static_cast<std::uint32_t>(i);
      } else {
        links.share = 1.0F / child_count(links.parent);
        d += options_.level_agreement * 0.25F * links.share;
      }
      diagonal_[i] = d;
    }
  });
}

void Regulariser::prepare(const Vector& x, Vector& scratch) const {
  // The disagreement of every texel with its children, times ω. Most have none: theirs stays 0.
  if (!acts()) return;
  scratch.resize(x.size());
  parallel_for(parents_.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      const Parent& parent = parents_[p];
      Channels sum{};
      for (std::uint32_t child : parent.children) {
        if (child != kNoTexel) sum += x[child];
      }
      scratch[parent.number] = broadcast(0.25F) * (broadcast(parent.count) * x[parent.number] - sum);
    }
  });
}

}  // namespace mirrorbake
