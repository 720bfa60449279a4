#pragma once

#include <array>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "mirrorbake/envmap/texel_topology.hpp"
#include "mirrorbake/inference/rendering_matrix.hpp"

/// Inference of environment maps: regularised least squares on rendering matrices ([PEM] §4; spec I2, I3,
/// I4).
namespace mirrorbake {

/// The weights λ are relative to the rows: multiplied with Σ w (A 1)² over rows and divided by the number of
/// unknowns, per channel. So they mean the same at any size of image and map, and at any brightness of the
/// reflector.
struct SolveOptions {
  float smoothness = 1e-3F;  ///< λ of squared differences between neighbouring texels of one level, ≥ 0
  float level_agreement = 1e-3F;  ///< λ of a texel's squared difference from the mean of its children, ≥ 0
  float prior_weight = 1e-3F;     ///< λ of the squared difference from the prior, where one is given, ≥ 0
  float tolerance = 1e-3F;   ///< stop when the preconditioned gradient has shrunk to this fraction, in (0, 1)
  int max_iterations = 600;  ///< of all rounds together, 0…100000
};

/// A weight of SolveOptions, which is not below 0.
struct SolveWeight {
  const char* name;
  float SolveOptions::*value;
  const char* help;
};

/// All of them, for who checks or names them.
inline constexpr std::array kSolveWeights{
    SolveWeight{"smoothness", &SolveOptions::smoothness,
                "Weight of squared differences of neighbouring texels, >= 0."},
    SolveWeight{"level_agreement", &SolveOptions::level_agreement,
                "Weight of a texel's squared difference from the mean of its children, >= 0."},
    SolveWeight{"prior_weight", &SolveOptions::prior_weight,
                "Weight of the squared difference from the prior, >= 0."},
};

struct SolveReport {
  int iterations = 0;      ///< of conjugate gradients, all rounds together
  int rounds = 0;          ///< after each of them the map is put within its bounds
  bool converged = false;  ///< the relative gradient met the tolerance
  /// What `tolerance` is compared with: the preconditioned gradient within the bounds, a texel on a bound
  /// counting only if it wants inside (the conditions of Karush, Kuhn and Tucker), relative to that of the
  /// prior or a black map; the largest of the channels.
  double relative_gradient = 0;
  std::size_t unknowns = 0;           ///< texels that some row sees; the others are filled in smoothly
  double rms_error = 0;               ///< weighted root mean square of A x − b over rows and channels
  std::array<double, 4> row_scale{};  ///< what the weights of SolveOptions were multiplied with, per channel
};

/// Share of a node's maps in what a view sees of the maps.
struct NodeWeight {
  int node = 0;
  float weight = 1.0F;

  bool operator==(const NodeWeight&) const = default;
};

/// A view of maps that are blended from those of several nodes: it sees b = A Σₖ weightₖ xₖ. One node of
/// weight 1 is the ordinary case; several views of one node are solved jointly for one map (spec I4).
/// A solver needs `matrix` only while it is constructed.
struct SolverView {
  const RenderingMatrix* matrix = nullptr;
  std::vector<NodeWeight> nodes = {{}};
};

/// What a view should show. Both are rows × channels; a weight of 0 leaves the row out.
struct ViewTarget {
  std::span<const float> target;
  std::span<const float> row_weights;
};

/// What a solution has where no row sees a texel: a smooth continuation, or the prior, 0 without one, for who
/// goes on from there with the same rows.
enum class UnseenTexels { filled, as_before };

struct SolveProblem {
  int channels = 3;  ///< 1…4
  std::span<const ViewTarget> views;
  /// Empty, or nodes × texels × channels: with a prior the regulariser acts on the difference from it (spec
  /// I2b); without an initial map, back-projection starts.
  std::span<const float> prior = {};
  std::span<const float> initial = {};
  /// Of each channel; all are ≥ 0. The default is radiance in the first three and coverage in the fourth.
  std::array<float, 4> upper_bounds = {std::numeric_limits<float>::infinity(),
                                       std::numeric_limits<float>::infinity(),
                                       std::numeric_limits<float>::infinity(), 1.0F};
  UnseenTexels unseen = UnseenTexels::filled;
  /// How many times SolveOptions::tolerance this solve may end at, ≥ 1: of one that only leads to another.
  float slack = 1.0F;
};

struct MapSolution {
  std::vector<float> texels;  ///< nodes × texels × channels
  SolveReport report;
};

/// Solves min_x Σ_v Σ_r w_r |A_v,r Σₖ b_k xₖ − t_v,r|² + regulariser, within the bounds, for the maps xₖ of
/// all nodes together; the maps of a node are stacked, as the matrix's columns are. The constructor does what
/// all solves share: it numbers the texels that are seen and builds the regulariser's stencil.
///
/// The unknowns are the seen texels of all levels, solved for with conjugate gradients, preconditioned with
/// the sums of the matrix' rows, all channels at once. Unseen texels are filled from seen ones across levels
/// (pull-push); with a prior, they fall back to it with growing distance. Same bits on any number of threads.
class MapSolver {
 public:
  /// Throws InvalidArgument if a matrix has other columns than the maps have texels, a node's number or
  /// weight or an option is out of range.
  MapSolver(std::span<const SolverView> views, std::span<const TexelTopology> maps, int nodes,
            const SolveOptions& options);
  ~MapSolver();
  MapSolver(MapSolver&&) noexcept;
  MapSolver& operator=(MapSolver&&) noexcept;

  /// Throws InvalidArgument for wrong lengths, for values that are not finite or beyond 1e15, with their
  /// count, and NumericalError if conjugate gradients leave the numbers.
  MapSolution solve(const SolveProblem& problem) const;

  struct State;  ///< of the implementation

 private:
  std::unique_ptr<State> state_;
};

}  // namespace mirrorbake
