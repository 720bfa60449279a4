#include "least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kRowGrain = 2048;

// Steps of the first round, and by how much each is longer than the one before. Measured on traced views:
// with rounds of 100 steps a solve takes three times as many.
constexpr double kFirstRound = 10;
constexpr double kRoundGrowth = 1.3;

// A round is over when its gradient is that much smaller than a solve's may be.
constexpr double kRoundAccuracy = 0.5;

// Conjugate gradients in float come to rest at rounding: a solve ends when the gradient has not become
// smaller for as many steps.
constexpr int kPatience = 200;

constexpr int kMaxHalvings = 6;

Channels to_channels(const ChannelSums& sums) {
  Channels c{};
  for (std::size_t k = 0; k < 4; ++k) c[k] = static_cast<float>(sums[k]);
  return c;
}

void clamp_to(const Bounds& bounds, Vector& x) {
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t k = 0; k < 4; ++k)
        x[i][k] = std::clamp(x[i][k], bounds.lower[i][k], bounds.upper[i][k]);
    }
  });
}

// 0 for what lies on a bound from which half the negative gradient s does not lead inside, else 1.
void find_free(const Bounds& bounds, const Vector& x, const Vector& s, Vector& free) {
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        const bool held = (x[i][k] <= bounds.lower[i][k] && s[i][k] <= 0.0F) ||
                          (x[i][k] >= bounds.upper[i][k] && s[i][k] >= 0.0F);
        free[i][k] = held ? 0.0F : 1.0F;
      }
    }
  });
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
    // Once a row, not once an entry.
    weighted_.resize(t[v].size());
    parallel_for(t[v].size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) weighted_[r] = weights_[v][r] * t[v][r];
    });
    parallel_for(view.texels.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end; ++j) {
        Channels sum{};
        for (std::uint64_t e = view.column_offsets[j]; e < view.column_offsets[j + 1]; ++e) {
          sum += broadcast(view.entries[e]) * weighted_[view.rows[e]];
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
      ChannelDoubles part{};
      for (std::size_t r = begin; r < end; ++r) add_product(part, weights_[v][r] * t[v][r], t[v][r]);
      return to_sums(part);
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

ChannelSums LeastSquares::regularise(const Vector& x, float magnitude, Vector& y) {
  return state_.regulariser.apply(x, magnitude, scale_, scratch_, y);
}

void LeastSquares::gradient(const std::vector<Vector>& t, const Vector& g, Vector& s) {
  parallel_for(s.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) s[i] = -g[i];
  });
  add_transposed(t, s);
}

void LeastSquares::find_preconditioner(float magnitude, const Vector& free, Vector& inverse) const {
  parallel_for(free.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Channels diagonal = diagonal_[i] + broadcast(state_.regulariser.diagonal(i) + magnitude) * scale_;
      for (std::size_t k = 0; k < 4; ++k)
        inverse[i][k] = diagonal[k] > 0.0F ? free[i][k] / diagonal[k] : 0.0F;
    }
  });
}

ChannelSums LeastSquares::preconditioned_squares(const Vector& inverse, const Vector& s) {
  return parallel_channel_sums(s.size(), [&](std::size_t begin, std::size_t end) {
    ChannelDoubles sums{};
    for (std::size_t i = begin; i < end; ++i) add_product(sums, s[i], inverse[i] * s[i]);
    return to_sums(sums);
  });
}

// A sequence of rounds, each of them CGLS (Björck, Numerical Methods for Least Squares Problems, 1996, §7.4)
// on the texels that are free: the residual t = b − A x is carried along instead of AᵀA's, so that rounding
// grows with the condition number of A, not its square; G x of the regulariser is carried along likewise. All
// channels step together, each with its own step lengths.
//
// A texel is held in a round if it lies on a bound and the gradient pulls it outwards. What a round drives
// out of bounds is put on its bound afterwards, a projected search along the round's step that is shortened
// until the sum of squares does not rise (Moré and Toraldo, On the Solution of Large Quadratic Programming
// Problems with Bound Constraints, SIAM J. Optimization 1, 1991). First rounds are short: what they would do
// between wrong bounds to the last digit is lost. Clamping the unbounded solution instead would be far from
// the best map: where the data leave a combination of texels undetermined, large positive and negative ones
// cancel.
SolveReport LeastSquares::minimise(const std::vector<Vector>& target, float magnitude, const Bounds& bounds,
                                   Vector& x) {
  const std::size_t n = state_.unknowns();
  Iterate it{rows_of(state_.views),
             rows_of(state_.views),
             Vector(n),
             Vector(n),
             Vector(n),
             Vector(n),
             Vector(n),
             Vector(n)};
  std::fill(it.free.begin(), it.free.end(), broadcast(1.0F));
  gradient(target, it.gx, it.s);
  find_preconditioner(magnitude, it.free, it.inverse);
  it.gamma = preconditioned_squares(it.inverse, it.s);
  const ChannelSums start = it.gamma;
  const auto relative_gradient = [&] {
    double worst = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (start[k] > 0) worst = std::max(worst, it.gamma[k] / start[k]);
    }
    return std::sqrt(worst);
  };
  const double tolerance = static_cast<double>(state_.options.tolerance);

  SolveReport report;
  report.unknowns = n;
  report.row_scale = row_scale_;
  clamp_to(bounds, x);
  ChannelSums squares = evaluate(target, magnitude, x, it);
  double length = kFirstRound;
  double best = std::numeric_limits<double>::infinity();
  int best_at = 0;
  Vector before;
  while (true) {
    gradient(it.residual, it.gx, it.s);
    find_free(bounds, x, it.s, it.free);
    find_preconditioner(magnitude, it.free, it.inverse);
    it.gamma = preconditioned_squares(it.inverse, it.s);
    report.relative_gradient = relative_gradient();
    if (!std::isfinite(report.relative_gradient)) throw NumericalError("conjugate gradients diverged");
    report.converged = report.relative_gradient <= tolerance;
    if (report.relative_gradient < best) {
      best = report.relative_gradient;
      best_at = report.iterations;
    }
    if (report.converged || report.iterations >= state_.options.max_iterations ||
        report.iterations - best_at >= kPatience) {
      break;
    }
    ++report.rounds;
    before = x;
    parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t j = begin; j < end; ++j) it.step[j] = it.inverse[j] * it.s[j];
    });
    for (int i = 0; i < static_cast<int>(length) && report.iterations < state_.options.max_iterations; ++i) {
      step_once(magnitude, x, it);
      ++report.iterations;
      // What follows can only be lost to rounding, or to the bounds.
      if (relative_gradient() <= kRoundAccuracy * tolerance) break;
    }
    length *= kRoundGrowth;
    squares = project(target, magnitude, bounds, before, squares, x, it);
  }
  return report;
}

// One step of conjugate gradients.
void LeastSquares::step_once(float magnitude, Vector& x, Iterate& it) {
  const std::size_t n = x.size();
  multiply(it.step, it.step_rows);
  const ChannelSums data_curvature = weighted_squares(it.step_rows);
  const ChannelSums curvature = regularise(it.step, magnitude, it.step_gx);
  ChannelSums length{};
  for (std::size_t k = 0; k < 4; ++k) {
    const double total = data_curvature[k] + curvature[k];
    length[k] = total > 0 ? it.gamma[k] / total : 0;
  }
  const Channels a = to_channels(length);
  parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = begin; j < end; ++j) {
      x[j] += a * it.step[j];
      it.gx[j] += a * it.step_gx[j];
      it.s[j] = -it.gx[j];
    }
  });
  for (std::size_t v = 0; v < it.residual.size(); ++v) {
    parallel_for(it.residual[v].size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) it.residual[v][r] -= a * it.step_rows[v][r];
    });
  }
  add_transposed(it.residual, it.s);
  const ChannelSums next = preconditioned_squares(it.inverse, it.s);
  ChannelSums ratio{};
  for (std::size_t k = 0; k < 4; ++k) ratio[k] = it.gamma[k] > 0 ? next[k] / it.gamma[k] : 0;
  it.gamma = next;
  const Channels b = to_channels(ratio);
  parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = begin; j < end; ++j) it.step[j] = it.inverse[j] * it.s[j] + b * it.step[j];
  });
}

ChannelSums LeastSquares::evaluate(const std::vector<Vector>& target, float magnitude, const Vector& x,
                                   Iterate& it) {
  multiply(x, it.residual);
  for (std::size_t v = 0; v < target.size(); ++v) {
    parallel_for(target[v].size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) it.residual[v][r] = target[v][r] - it.residual[v][r];
    });
  }
  const ChannelSums regular = regularise(x, magnitude, it.gx);
  ChannelSums squares = weighted_squares(it.residual);
  for (std::size_t k = 0; k < 4; ++k) squares[k] += regular[k];
  return squares;
}

// Puts what a round made of `before` within the bounds, every channel as far along the round's step as does
// not raise its sum of squares. Returns the sums.
ChannelSums LeastSquares::project(const std::vector<Vector>& target, float magnitude, const Bounds& bounds,
                                  const Vector& before, const ChannelSums& squares, Vector& x, Iterate& it) {
  const Vector unbounded = x;
  Channels share = broadcast(1.0F);
  for (int tries = 0;; ++tries) {
    clamp_to(bounds, x);
    const ChannelSums now = evaluate(target, magnitude, x, it);
    bool shorter = false;
    for (std::size_t k = 0; k < 4; ++k) {
      // Sums of floats are the same to about this share.
      if (now[k] <= squares[k] * (1.0 + 1e-6) || share[k] == 0.0F) continue;
      share[k] = tries < kMaxHalvings ? 0.5F * share[k] : 0.0F;
      shorter = true;
    }
    if (!shorter) return now;
    parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) x[i] = before[i] + share * (unbounded[i] - before[i]);
    });
  }
}

}  // namespace mirrorbake
