#pragma once

#include <cstdint>
#include <vector>

#include "banded_rows.hpp"
#include "mirrorbake/inference/map_solver.hpp"
#include "regulariser.hpp"
#include "texel_vector.hpp"

/// The least-squares system of MapSolver, and how it is minimised within bounds.
namespace mirrorbake {

struct MapSolver::State {
  SolveOptions options;
  std::vector<TexelTopology> maps;
  std::size_t texels_per_node = 0;
  int nodes = 1;
  BandedRows rows;
  std::vector<std::uint8_t> seen;     // of each texel of all nodes
  std::vector<std::uint32_t> texels;  // of each unknown, counted through all nodes
  Regulariser regulariser;

  std::size_t unknowns() const { return texels.size(); }
};

/// Of what unknowns are differences from: 0 and `largest`.
struct Bounds {
  std::span<const Channels> base;  // of every unknown
  Channels largest;

  Channels lower(std::size_t i) const { return -base[i]; }
  Channels upper(std::size_t i) const { return largest - base[i]; }
};

/// One solve: the operator with the rows' weights, and what it needs to work in.
class LeastSquares {
 public:
  /// `row_weights`: of the rows of all views.
  LeastSquares(const MapSolver::State& state, Vector row_weights);

  /// What each unknown's rows want of it on average.
  Vector back_project(const Vector& target);

  /// Minimises Σ w |A x − target|² + scale · (regulariser + magnitude |x|²) within the bounds, starting from
  /// x, until the gradient has shrunk to `tolerance`.
  SolveReport minimise(const Vector& target, float magnitude, const Bounds& bounds, double tolerance,
                       Vector& x);

  /// Σ w |A x − target|² of the x that was found.
  double data_squares() const { return data_squares_; }

 private:
  /// What conjugate gradients carry along. s: half the negative gradient; inverse: of the diagonal, 0 for
  /// what is held on a bound; regular: the regulariser times the step, empty without one.
  struct Iterate {
    Vector s, step, inverse, regular;
    ChannelSums gamma{};
  };

  /// Finds s at x. Returns the sums of squares with the regulariser.
  ChannelSums evaluate(const Vector& target, float magnitude, const Vector& x, Iterate& it);
  /// Finds the preconditioner, 0 for what the gradient holds on a bound, and the first step.
  void begin_round(float magnitude, const Bounds* bounds, const Vector& x, Iterate& it);
  void step_once(float magnitude, Vector& x, Iterate& it);
  ChannelSums project(const Vector& target, float magnitude, const Bounds& bounds, const Vector& before,
                      const ChannelSums& squares, Vector& x, Iterate& it);
  ChannelSums find_row_scale();
  /// Entry i of scale · (G + magnitude) x, after `regulariser.prepare`.
  Channels regularised(std::size_t i, float magnitude, const Vector& x) const {
    const Channels near = broadcast(magnitude) * x[i];
    return scale_ * (state_.regulariser.acts() ? near + state_.regulariser.at(i, x, scratch_) : near);
  }
  /// 1 / diagonal, 0 where that is 0.
  Channels preconditioner(std::size_t i, float magnitude) const {
    const Channels diagonal = diagonal_[i] + broadcast(state_.regulariser.diagonal(i) + magnitude) * scale_;
    Channels inverse{};
    for (std::size_t k = 0; k < 4; ++k) inverse[k] = diagonal[k] > 0.0F ? 1.0F / diagonal[k] : 0.0F;
    return inverse;
  }

  const MapSolver::State& state_;
  Vector weights_, shares_, diagonal_, scratch_;
  ChannelSums row_scale_{};
  Channels scale_{};
  double data_squares_ = 0;  // Σ w |A x − target|² where the system was evaluated last
};

}  // namespace mirrorbake
