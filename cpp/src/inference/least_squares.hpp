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
  /// `row_weights`: of the rows of all views. `magnitude`: see below. `stride`: of vectors of unknowns.
  LeastSquares(const MapSolver::State& state, Vector row_weights, float magnitude, int stride);

  /// Minimises Σ w |A x − target|² + scale · (regulariser + magnitude |x|²) within the bounds, starting from
  /// x, or where that is empty from what each unknown's rows want of it on average, until the gradient has
  /// shrunk to `tolerance`.
  SolveReport minimise(const Vector& target, const Bounds& bounds, double tolerance, TexelVector& x);

  /// Σ w |A x − target|² of the x that was found.
  double data_squares() const { return data_squares_; }

 private:
  using Band = BandedRows::Band;

  /// What conjugate gradients carry along. s: half the negative gradient; inverse: the preconditioner, 0 for
  /// what is held on a bound.
  struct Iterate {
    TexelVector s, step;
    std::vector<HalfFloat> inverse;
    ChannelSums gamma{};
  };

  TexelVector vector() const { return {state_.rows.unknowns(), stride_}; }
  /// Finds s at x; an empty x is 0. Returns the sums of squares with the regulariser.
  ChannelSums evaluate(const Vector& target, const TexelVector& x, Iterate& it);
  /// Finds the preconditioner, 0 for what the gradient holds on a bound, and the first step.
  void begin_round(const Bounds& bounds, const TexelVector& x, Iterate& it);
  void step_once(TexelVector& x, Iterate& it);
  ChannelSums project(const Vector& target, const Bounds& bounds, const TexelVector& before,
                      const ChannelSums& squares, TexelVector& x, Iterate& it);
  void find_row_sums();
  void find_preconditioner();
  TexelVector back_project(const TexelVector& s) const;
  /// Σ s · inverse s of all unknowns that are free.
  ChannelSums size_of(TexelVector& s) const;
  /// Adds sign · scale · (G + magnitude) x to a band's shares, after `regulariser.prepare`. Adds to `sums`
  /// what that makes of xᵀ G x.
  void regularise(const Band& band, float sign, const TexelVector& x, Channels* made,
                  ChannelSums& sums) const;

  const MapSolver::State& state_;
  float magnitude_;
  int stride_;
  Vector weights_, scratch_;
  TexelVector shares_, row_sums_;  // of AᵀWA
  std::vector<HalfFloat> free_;    // the preconditioner of what lies on no bound
  ChannelSums row_scale_{};
  Channels scale_{};
  double data_squares_ = 0;  // Σ w |A x − target|² where the system was evaluated last
};

}  // namespace mirrorbake
