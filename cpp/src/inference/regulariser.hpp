#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mirrorbake/envmap/texel_topology.hpp"
#include "mirrorbake/inference/map_solver.hpp"
#include "texel_vector.hpp"

namespace mirrorbake {

/// The quadratic form λ_s Σ (x_i − x_j)² + λ_a Σ ω_q (x_q − mean of its children)² over numbered texels: i
/// and j neighbours on one level, q a texel with children, ω_q a quarter of its numbered children. Terms that
/// would involve texels without a number are left out. Numbers may be left out, too.
class Regulariser {
 public:
  /// `number_of`: the number of every texel of all maps, in their order, that of all nodes one after the
  /// other; kNoTexel for those without. Of the options it takes the weights of its terms.
  Regulariser(std::span<const TexelTopology> maps, const std::vector<std::uint32_t>& number_of,
              std::size_t numbers, const SolveOptions& options);

  /// False if the form is 0.
  bool acts() const { return !links_.empty(); }

  /// Makes `scratch` ready for `add` of the same x.
  void prepare(const TexelVector& x, Vector& scratch) const;

  /// y_i += factor (G x)_i + near x_i for the numbers from `begin` to `end`, the first of which y begins
  /// with. Returns what that adds to xᵀy.
  ChannelSums add(std::size_t begin, std::size_t end, Channels factor, Channels near, const TexelVector& x,
                  const Vector& scratch, Channels* y) const;

  /// Σ |entries| of a row of G.
  float row_sum(std::size_t number) const { return row_sums_[number]; }

 private:
  /// A neighbour that is missing is the texel itself, which differs from itself by nothing.
  struct Links {
    std::array<std::uint32_t, 4> neighbours;
    std::uint32_t parent = 0;  // in parents_
    float share = 0.0F;        // in the mean of the parent's children, those that have a number
  };
  /// A texel that has children, and how many of them have a number.
  struct Parent {
    std::uint32_t number;
    float count;
    std::array<std::uint32_t, 4> children;
  };
  SolveOptions options_;
  std::vector<Links> links_;
  std::vector<Parent> parents_;  // by their numbers
  std::vector<float> row_sums_;
};

}  // namespace mirrorbake
