#pragma once

#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "mirrorbake/envmap/cube_pyramid.hpp"
#include "mirrorbake/inference/rendering_matrix.hpp"

/// Inference of an environment map: regularised least squares on the rendering matrix ([PEM] §4; spec I2, I3).
namespace mirrorbake {

/// Weights of the regulariser are relative to a row of weight 1, which is a fully covered pixel of dark radiance.
struct SolveOptions {
  float smoothness = 1e-3F;  ///< λ of squared differences between neighbouring texels of one level, ≥ 0
  float level_agreement = 1e-3F;  ///< λ of a texel's squared difference from the mean of its children, ≥ 0
  float prior_weight = 1e-3F;     ///< λ of the squared difference from the prior, where one is given, ≥ 0
  float tolerance = 1e-3F;        ///< stop when the preconditioned gradient has shrunk to this fraction, > 0
  int max_iterations = 200;       ///< 0…100000
};

struct SolveReport {
  int iterations = 0;            ///< of conjugate gradients, all rounds together
  int rounds = 0;                ///< of the active set that keeps the map within its bounds
  double relative_gradient = 0;  ///< what `tolerance` is compared with
  std::size_t unknowns = 0;      ///< texels that some row sees; the others are filled in smoothly
  double rms_error = 0;          ///< weighted root mean square of A x − b over rows and channels
};

struct MapSolution {
  std::vector<float> texels;  ///< pyramid texels × channels
  SolveReport report;
};

/// Row weights for a target that will be looked at on a display: coverage (samples of the row over samples per pixel)
/// over (1 + luminance)², since a display compresses what is bright, and least squares would spend the map on lights.
std::vector<float> display_row_weights(const RenderingMatrix& matrix, int samples_per_pixel,
                                       std::span<const float> target, int channels);

/// Solves min_x Σ_r w_r |A_r x − b_r|² + regulariser for maps of one rendering matrix. The constructor does what all
/// solves share: it numbers the texels that are seen, transposes the matrix and builds the regulariser's stencil.
///
/// The unknowns are the seen texels of all levels, solved for with conjugate gradients on the least-squares problem
/// (CGLS, preconditioned with the diagonal), all channels at once. Unseen texels are filled from seen ones across
/// levels (pull-push); with a prior, they fall back to it with growing distance.
class MapSolver {
 public:
  /// Throws InvalidArgument if the layout is not the matrix's, its size is not a power of two, or an option or weight is
  /// out of range.
  MapSolver(const RenderingMatrix& matrix, std::span<const float> row_weights,
            const CubePyramidLayout& layout, const SolveOptions& options);
  ~MapSolver();
  MapSolver(MapSolver&&) noexcept;
  MapSolver& operator=(MapSolver&&) noexcept;

  /// `target`: rows × channels. `prior` and `initial`: empty, or texels × channels; with a prior the regulariser acts
  /// on the difference from it (spec I2b); without an initial map, back-projection starts. 1 to 4 channels; the fourth is
  /// coverage. The map is the best one with radiance ≥ 0 and coverage in [0, 1]. Throws InvalidArgument for wrong lengths and for
  /// values that are not finite, with their count.
  MapSolution solve(std::span<const float> target, int channels, std::span<const float> prior = {},
                    std::span<const float> initial = {}) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mirrorbake
