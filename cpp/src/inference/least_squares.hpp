#pragma once

#include <cstdint>
#include <vector>

#include "mirrorbake/inference/map_solver.hpp"
#include "regulariser.hpp"
#include "texel_vector.hpp"

/// The least-squares system of MapSolver, and how it is minimised within bounds.
namespace mirrorbake {

using Vector = std::vector<Channels>;

/// A view's matrix transposed, its columns numbered to the texels that the view sees, so that both products
/// gather.
struct View {
  const RenderingMatrix* matrix;
  std::vector<NodeWeight> nodes;
  std::vector<std::uint32_t> texels;  // of each column that the view sees
  std::vector<std::uint64_t> column_offsets;
  std::vector<std::uint32_t> rows;
  std::vector<float> entries;
  std::vector<std::vector<std::uint32_t>> unknowns;  // of each node, the unknown of each column
};

struct MapSolver::State {
  SolveOptions options;
  std::vector<TexelTopology> maps;
  std::size_t texels_per_node = 0;
  int nodes = 1;
  std::vector<View> views;
  std::vector<std::uint8_t> seen;     // of each texel of all nodes
  std::vector<std::uint32_t> texels;  // of each unknown, counted through all nodes
  Regulariser regulariser;

  std::size_t unknowns() const { return texels.size(); }
};

/// Vectors of every view's rows.
std::vector<Vector> rows_of(const std::vector<View>& views);

/// Of every unknown; the unknowns may be differences from a prior.
struct Bounds {
  Vector lower, upper;
};

/// One solve: the operator with the rows' weights, and what it needs to work in.
class LeastSquares {
 public:
  LeastSquares(const MapSolver::State& state, std::vector<Vector> row_weights);

  /// b_v = A_v Σ_k weight_k x_k for every view.
  void multiply(const Vector& x, std::vector<Vector>& b);

  /// y += Σ_v (weight of the node) A_vᵀ W t_v.
  void add_transposed(const std::vector<Vector>& t, Vector& y);

  /// Σ w |t|² per channel.
  ChannelSums weighted_squares(const std::vector<Vector>& t) const;

  /// Minimises Σ w |A x − target|² + scale · (regulariser + magnitude |x|²) within the bounds, starting from
  /// x.
  SolveReport minimise(const std::vector<Vector>& target, float magnitude, const Bounds& bounds, Vector& x);

 private:
  /// What conjugate gradients carry along.
  struct Iterate {
    std::vector<Vector> residual, step_rows;
    Vector gx, step_gx, s, step, free, inverse;
    ChannelSums gamma{};
  };

  /// Residual and G x at x, and the sums of squares with the regulariser.
  ChannelSums evaluate(const std::vector<Vector>& target, float magnitude, const Vector& x, Iterate& it);
  void step_once(float magnitude, Vector& x, Iterate& it);
  ChannelSums project(const std::vector<Vector>& target, float magnitude, const Bounds& bounds,
                      const Vector& before, const ChannelSums& squares, Vector& x, Iterate& it);
  void add_diagonal(std::size_t view);
  ChannelSums find_row_scale() const;
  /// y = scale · (G + magnitude) x. Returns x·y.
  ChannelSums regularise(const Vector& x, float magnitude, Vector& y);
  /// s = AᵀW t − g, half the negative gradient.
  void gradient(const std::vector<Vector>& t, const Vector& g, Vector& s);
  /// 1 / diagonal where free is 1, else 0.
  void find_preconditioner(float magnitude, const Vector& free, Vector& inverse) const;
  /// s·(inverse s).
  static ChannelSums preconditioned_squares(const Vector& inverse, const Vector& s);

  const MapSolver::State& state_;
  std::vector<Vector> weights_;
  Vector blended_, weighted_, diagonal_, scratch_;
  ChannelSums row_scale_{};
  Channels scale_{};
};

}  // namespace mirrorbake
