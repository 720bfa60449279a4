#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mirrorbake/envmap/cube_pyramid.hpp"
#include "texel_vector.hpp"

namespace mirrorbake {

/// The quadratic form λ_s Σ (x_i − x_j)² + λ_a Σ ω_q (x_q − mean of its children)² over numbered texels: i and j neighbours
/// on one level, q a texel with children, ω_q the fraction of its four children that are numbered. Terms that would involve texels without a number are left out.
class Regulariser {
 public:
  struct Weights {
    float smoothness, level_agreement;
  };
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// `texels`: the numbered texels in the order of their numbers; `number_of`: the reverse, kNone for the others.
  Regulariser(const CubePyramidLayout& layout, const std::vector<std::uint32_t>& texels,
              const std::vector<std::uint32_t>& number_of, Weights weights);

  /// y = (G + magnitude · 1) x, where the form is xᵀ G x. Returns xᵀ y per channel. `scratch` is memory to work in.
  ChannelSums apply(const std::vector<Channels>& x, float magnitude, std::vector<Channels>& scratch,
                    std::vector<Channels>& y) const;

  /// Diagonal entry of G.
  float diagonal(std::size_t number) const { return diagonal_[number]; }

 private:
  struct Links {
    std::array<std::uint32_t, 4> neighbours;
    std::array<std::uint32_t, 4> children;
    std::uint32_t parent;
  };
  Weights weights_;
  std::vector<Links> links_;
  std::vector<float> diagonal_;
};

}  // namespace mirrorbake
