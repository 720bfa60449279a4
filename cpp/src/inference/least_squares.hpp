#pragma once

#include <cstdint>
#include <vector>

#include "banded_rows.hpp"
#include "mirrorbake/inference/map_solver.hpp"
#include "regulariser.hpp"
#include "row_kernels.hpp"
#include "texel_vector.hpp"

/// The least-squares system of MapSolver, and how it is minimised within bounds.
namespace mirrorbake {

struct MapSolver::State {
  SolveOptions options;
  std::vector<TexelTopology> maps;
  std::size_t texels_per_node = 0;
  int nodes = 1;
  BandedRows rows;
  std::vector<std::uint8_t> seen;  // of each texel of all nodes
  Regulariser regulariser;
};

/// Of what unknowns are differences from: 0 and `largest`.
struct Bounds {
  const TexelVector& base;  // of every unknown
  Channels largest;

  Channels lower(std::size_t i) const { return -base[i]; }
  Channels upper(std::size_t i) const { return largest - base[i]; }
};

/// One solve: the operator with the rows' weights, and what it needs to work in.
class LeastSquares {
 public:
  /// `row_weights`: of the rows of all views. `stride`: of vectors of unknowns.
  LeastSquares(const MapSolver::State& state, Vector row_weights, int stride);

  /// What each unknown's rows want of it on average.
  TexelVector back_project(const Vector& target);

  /// Minimises Σ w |A x − target|² + scale · (regulariser + magnitude |x|²) within the bounds, starting from
  /// x, until the gradient has shrunk to `tolerance`.
  SolveReport minimise(const Vector& target, float magnitude, const Bounds& bounds, double tolerance,
                       TexelVector& x);

  /// Σ w |A x − target|² of the x that was found.
  double data_squares() const { return data_squares_; }

 private:
  using Band = BandedRows::Band;

  /// What conjugate gradients carry along. s: half the negative gradient; inverse: of the diagonal, 0 for
  /// what is held on a bound.
  struct Iterate {
    TexelVector s, step;
    std::vector<InverseDiagonal> inverse;
    ChannelSums gamma{};
  };

  TexelVector vector() const { return {state_.rows.unknowns(), stride_}; }
  /// Finds s at x. Returns the sums of squares with the regulariser.
  ChannelSums evaluate(const Vector& target, float magnitude, const TexelVector& x, Iterate& it);
  /// Finds the preconditioner, 0 for what the gradient holds on a bound, and the first step.
  void begin_round(float magnitude, const Bounds* bounds, const TexelVector& x, Iterate& it);
  void step_once(float magnitude, TexelVector& x, Iterate& it);
  ChannelSums project(const Vector& target, float magnitude, const Bounds& bounds, const TexelVector& before,
                      const ChannelSums& squares, TexelVector& x, Iterate& it);
  ChannelSums find_row_scale();
  /// Adds sign · scale · (G + magnitude) x to a band's shares, after `regulariser.prepare`. Adds to `sums`
  /// what that makes of xᵀ G x.
  void regularise(const Band& band, float sign, float magnitude, const TexelVector& x, Channels* made,
                  ChannelSums& sums) const;
  /// 1 / diagonal, 0 where that is 0.
  Channels preconditioner(std::size_t i, float magnitude) const {
    const Channels diagonal = diagonal_[i] + broadcast(state_.regulariser.diagonal(i) + magnitude) * scale_;
    return diagonal > Channels{} ? broadcast(1.0F) / diagonal : Channels{};
  }

  const MapSolver::State& state_;
  int stride_;
  Vector weights_, scratch_;
  TexelVector shares_, diagonal_;
  ChannelSums row_scale_{};
  Channels scale_{};
  double data_squares_ = 0;  // Σ w |A x − target|² where the system was evaluated last
};

}  // namespace mirrorbake
