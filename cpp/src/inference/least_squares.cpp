#include "least_squares.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kRowGrain = 2048;

// Rounds of the active set, and the share of all iterations that one may take, so that the bounds are met
// even where the first round does not converge.
constexpr int kMaxRounds = 8;
constexpr int kRoundShare = 3;

// Conjugate gradients in float come to rest at rounding: a round ends when the gradient has not become
// smaller for as many iterations.
constexpr int kPatience = 40;

Channels to_channels(const ChannelSums& sums) {
  Channels c{};
  for (std::size_t k = 0; k < 4; ++k) c[k] = static_cast<float>(sums[k]);
  return c;
}

// Puts what is out of bounds on its bound and holds it there; frees what is held and wants inside, going by
// half the negative gradient s. Returns whether there was anything to hold or free: only then another round
// can change the solution.
bool hold_to(const Bounds& bounds, const Vector& s, Vector& x, Vector& free) {
  std::atomic<bool> changed = false;
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        const bool below = x[i][k] < bounds.lower[i][k];
        const bool above = x[i][k] > bounds.upper[i][k];
        if (below || above) {
          x[i][k] = below ? bounds.lower[i][k] : bounds.upper[i][k];
          free[i][k] = 0.0F;
          changed = true;
        } else if (free[i][k] == 0.0F) {
          const bool inwards = x[i][k] <= bounds.lower[i][k] ? s[i][k] > 0.0F : s[i][k] < 0.0F;
          if (!inwards) continue;
          free[i][k] = 1.0F;
          changed = true;
        }
      }
    }
  });
  return changed;
}

}  // namespace

std::vector<Vector> rows_of(const std::vector<View>& views) {
  std::vector<Vector> rows;
  for (const View& view : views) rows.emplace_back(view.matrix->rows());
  return rows;
}

LeastSquares::LeastSquares(const MapSolver::State& state, std::vector<Vector> row_weights)
    : state_(state),
      weights_(std::move(row_weights)),
      blended_(state.texels_per_node),
      diagonal_(state.unknowns()) {
  for (std::size_t v = 0; v < state.views.size(); ++v) add_diagonal(v);
  row_scale_ = find_row_scale();
  scale_ = to_channels(row_scale_);
}

void LeastSquares::add_diagonal(std::size_t v) {
  const View& view = state_.views[v];
  parallel_for(view.texels.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = begin; j < end; ++j) {
      Channels sum{};
      for (std::uint64_t e = view.column_offsets[j]; e < view.column_offsets[j + 1]; ++e) {
        sum += broadcast(view.entries[e] * view.entries[e]) * weights_[v][view.rows[e]];
      }
      for (std::size_t n = 0; n < view.nodes.size(); ++n) {
        diagonal_[view.unknowns[n][j]] += broadcast(view.nodes[n].weight * view.nodes[n].weight) * sum;
      }
    }
  });
}

void LeastSquares::multiply(const Vector& x, std::vector<Vector>& b) {
  for (std::size_t v = 0; v < state_.views.size(); ++v) {
    const View& view = state_.views[v];
    parallel_for(view.texels.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end; ++j) {
        Channels sum{};
        for (std::size_t n = 0; n < view.nodes.size(); ++n) {
          sum += broadcast(view.nodes[n].weight) * x[view.unknowns[n][j]];
        }
        blended_[view.texels[j]] = sum;
      }
    });
    const RenderingMatrix& matrix = *view.matrix;
    parallel_for(matrix.rows(), kRowGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) {
        Channels sum{};
        for (std::uint64_t e = matrix.row_offsets[r]; e < matrix.row_offsets[r + 1]; ++e) {
          sum += broadcast(matrix.weights[e]) * blended_[matrix.texels[e]];
        }
        b[v][r] = sum;
      }
    });
  }
}

void LeastSquares::add_transposed(const std::vector<Vector>& t, Vector& y) {
  for (std::size_t v = 0; v < state_.views.size(); ++v) {
    const View& view = state_.views[v];
    const Vector& w = weights_[v];
    const Vector& residual = t[v];
    parallel_for(view.texels.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end; ++j) {
        Channels sum{};
        for (std::uint64_t e = view.column_offsets[j]; e < view.column_offsets[j + 1]; ++e) {
          const std::uint32_t row = view.rows[e];
          sum += broadcast(view.entries[e]) * (w[row] * residual[row]);
        }
        for (std::size_t n = 0; n < view.nodes.size(); ++n) {
          y[view.unknowns[n][j]] += broadcast(view.nodes[n].weight) * sum;
        }
      }
    });
  }
}

ChannelSums LeastSquares::weighted_squares(const std::vector<Vector>& t) const {
  ChannelSums sums{};
  for (std::size_t v = 0; v < t.size(); ++v) {
    const ChannelSums of_view = parallel_channel_sums(t[v].size(), [&](std::size_t begin, std::size_t end) {
      ChannelSums part{};
      for (std::size_t r = begin; r < end; ++r) add_product(part, weights_[v][r] * t[v][r], t[v][r]);
      return part;
    });
    for (std::size_t k = 0; k < 4; ++k) sums[k] += of_view[k];
  }
  return sums;
}

// Σ w (A 1)² over the unknowns.
ChannelSums LeastSquares::find_row_scale() const {
  ChannelSums sums{};
  for (std::size_t v = 0; v < state_.views.size(); ++v) {
    const RenderingMatrix& matrix = *state_.views[v].matrix;
    float blend = 0.0F;
    for (const NodeWeight& node : state_.views[v].nodes) blend += node.weight;
    for (std::size_t r = 0; r < matrix.rows(); ++r) {
      float sum = 0.0F;
      for (std::uint64_t e = matrix.row_offsets[r]; e < matrix.row_offsets[r + 1]; ++e) {
        sum += matrix.weights[e];
      }
      sum *= blend;
      for (std::size_t k = 0; k < 4; ++k) {
        sums[k] += static_cast<double>(weights_[v][r][k]) * static_cast<double>(sum * sum);
      }
    }
  }
  for (double& sum : sums) sum /= static_cast<double>(std::max<std::size_t>(state_.unknowns(), 1));
  return sums;
}

void LeastSquares::regularise(const Vector& x, float magnitude, Vector& y) {
  state_.regulariser.apply(x, magnitude, scratch_, y);
  parallel_for(y.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) y[i] *= scale_;
  });
}

ChannelSums LeastSquares::preconditioned_gradient(float magnitude, const Vector& free,
                                                  const std::vector<Vector>& t, const Vector& g, Vector& s,
                                                  Vector& z) {
  for (std::size_t i = 0; i < s.size(); ++i) s[i] = -g[i];
  add_transposed(t, s);
  return parallel_channel_sums(s.size(), [&](std::size_t begin, std::size_t end) {
    ChannelSums sums{};
    for (std::size_t i = begin; i < end; ++i) {
      const Channels diagonal = diagonal_[i] + broadcast(state_.regulariser.diagonal(i) + magnitude) * scale_;
      for (std::size_t k = 0; k < 4; ++k) {
        z[i][k] = diagonal[k] > 0.0F ? free[i][k] * s[i][k] / diagonal[k] : 0.0F;
      }
      add_product(sums, s[i], z[i]);
    }
    return sums;
  });
}

// CGLS (Björck, Numerical Methods for Least Squares Problems, 1996, §7.4): the residual t = b − A x is
// carried along instead of AᵀA's, so that rounding grows with the condition number of A, not its square. G x
// of the regulariser is carried along likewise. All channels step together, each with its own step lengths.
//
// The bounds are an active set around it (op. cit., §5.2): texels that a round of conjugate gradients drives
// out of bounds are put on their bound and held there, held ones that the gradient pulls inside are set free,
// and the next round goes on from there. Clamping the unbounded solution instead would be far from the best
// map: where the data leave a combination of texels undetermined, large positive and negative ones cancel
// each other.
SolveReport LeastSquares::minimise(const std::vector<Vector>& target, float magnitude, const Bounds& bounds,
                                   Vector& x) {
  const std::size_t n = state_.unknowns();
  std::vector<Vector> residual = rows_of(state_.views);
  std::vector<Vector> step_rows = rows_of(state_.views);
  Vector gx(n), step_gx(n), s(n), z(n), step(n);
  Vector free(n, broadcast(1.0F));

  ChannelSums gamma{};
  const ChannelSums start = preconditioned_gradient(magnitude, free, target, Vector(n), s, z);
  const auto relative_gradient = [&] {
    double worst = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (start[k] > 0) worst = std::max(worst, gamma[k] / start[k]);
    }
    return std::sqrt(worst);
  };
  const double tolerance = static_cast<double>(state_.options.tolerance);
  const int round_limit = std::max(1, state_.options.max_iterations / kRoundShare);

  SolveReport report;
  report.unknowns = n;
  report.row_scale = row_scale_;
  bool settled = false;
  while (!settled && report.rounds < kMaxRounds) {
    ++report.rounds;
    multiply(x, residual);
    for (std::size_t v = 0; v < residual.size(); ++v) {
      for (std::size_t r = 0; r < residual[v].size(); ++r) residual[v][r] = target[v][r] - residual[v][r];
    }
    regularise(x, magnitude, gx);
    gamma = preconditioned_gradient(magnitude, free, residual, gx, s, z);
    step = z;
    double best = relative_gradient();
    int since_best = 0;
    for (int i = 0; i < round_limit && report.iterations < state_.options.max_iterations &&
                    relative_gradient() > tolerance && since_best < kPatience;
         ++i) {
      multiply(step, step_rows);
      const ChannelSums data_curvature = weighted_squares(step_rows);
      regularise(step, magnitude, step_gx);
      const ChannelSums curvature = parallel_channel_sums(n, [&](std::size_t begin, std::size_t end) {
        ChannelSums sums{};
        for (std::size_t j = begin; j < end; ++j) add_product(sums, step[j], step_gx[j]);
        return sums;
      });
      ChannelSums length{};
      for (std::size_t k = 0; k < 4; ++k) {
        const double total = data_curvature[k] + curvature[k];
        length[k] = total > 0 ? gamma[k] / total : 0;
      }
      const Channels a = to_channels(length);
      parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j) {
          x[j] += a * step[j];
          gx[j] += a * step_gx[j];
        }
      });
      for (std::size_t v = 0; v < residual.size(); ++v) {
        parallel_for(residual[v].size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
          for (std::size_t r = begin; r < end; ++r) residual[v][r] -= a * step_rows[v][r];
        });
      }
      const ChannelSums next_gamma = preconditioned_gradient(magnitude, free, residual, gx, s, z);
      ChannelSums ratio{};
      for (std::size_t k = 0; k < 4; ++k) ratio[k] = gamma[k] > 0 ? next_gamma[k] / gamma[k] : 0;
      gamma = next_gamma;
      const Channels b = to_channels(ratio);
      parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t j = begin; j < end; ++j) step[j] = z[j] + b * step[j];
      });
      ++report.iterations;
      if (relative_gradient() < best) {
        best = relative_gradient();
        since_best = 0;
      } else {
        ++since_best;
      }
    }
    const bool met = relative_gradient() <= tolerance;
    settled = !hold_to(bounds, s, x, free);
    report.converged = settled && met;
    if (report.iterations >= state_.options.max_iterations) break;
  }
  report.relative_gradient = relative_gradient();
  if (!std::isfinite(report.relative_gradient)) throw NumericalError("conjugate gradients diverged");
  return report;
}

}  // namespace mirrorbake
