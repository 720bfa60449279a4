#include "least_squares.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

// Steps of the first round, and by how much each is longer than the one before. Measured on traced views:
// with rounds of 100 steps a solve takes three times as many.
constexpr double kFirstRound = 10;
constexpr double kRoundGrowth = 1.3;

// A round is over when its gradient is that much smaller than a solve's may be.
constexpr double kRoundAccuracy = 0.5;

// Conjugate gradients in float come to rest at rounding: a solve ends when the gradient has not become
// smaller for as many steps.
constexpr int kPatience = 200;

// The longest that a gradient is carried along.
constexpr int kLongestRound = 60;

constexpr int kMaxHalvings = 6;

Channels to_channels(const ChannelSums& sums) {
  Channels c{};
  for (std::size_t k = 0; k < 4; ++k) c[k] = static_cast<float>(sums[k]);
  return c;
}

void clamp_to(const Bounds& bounds, Vector& x) {
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Channels lower = bounds.lower(i), upper = bounds.upper(i);
      for (std::size_t k = 0; k < 4; ++k) x[i][k] = std::clamp(x[i][k], lower[k], upper[k]);
    }
  });
}

// Whether a channel of a texel lies on a bound from which half the negative gradient s does not lead inside.
bool held(float x, float s, float lower, float upper) {
  return (x <= lower && s <= 0.0F) || (x >= upper && s >= 0.0F);
}

// Whether a round may go on: nothing has left its bounds, and nothing that is held on one wants inside.
bool keeps(const Bounds& bounds, const Vector& x, const Vector& s, const Vector& inverse) {
  std::atomic<bool> kept{true};
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end && kept.load(std::memory_order_relaxed); ++i) {
      const Channels lower = bounds.lower(i), upper = bounds.upper(i);
      for (std::size_t k = 0; k < 4; ++k) {
        const bool left = x[i][k] < lower[k] || x[i][k] > upper[k];
        const bool returns =
            inverse[i][k] == 0.0F && s[i][k] != 0.0F && !held(x[i][k], s[i][k], lower[k], upper[k]);
        if (left || returns) kept = false;
      }
    }
  });
  return kept;
}

}  // namespace

LeastSquares::LeastSquares(const MapSolver::State& state, Vector row_weights)
    : state_(state),
      weights_(std::move(row_weights)),
      shares_(state.rows.shares()),
      diagonal_(state.unknowns()) {
  state.rows.diagonal(weights_, shares_);
  parallel_for(diagonal_.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) diagonal_[i] = state.rows.sum_of_squares(shares_, i);
  });
  row_scale_ = find_row_scale();
  scale_ = to_channels(row_scale_);
}

Vector LeastSquares::back_project(const Vector& target) {
  const std::size_t n = state_.unknowns();
  Vector x(n);
  state_.rows.transposed(weights_, target, shares_);
  parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) x[i] = state_.rows.sum(shares_, i);
  });
  state_.rows.transposed(weights_, Vector(target.size(), broadcast(1.0F)), shares_);
  parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Channels total = state_.rows.sum(shares_, i);
      for (std::size_t k = 0; k < 4; ++k) x[i][k] = total[k] > 0.0F ? x[i][k] / total[k] : 0.0F;
    }
  });
  return x;
}

// Σ w (A 1)² over the unknowns.
ChannelSums LeastSquares::find_row_scale() {
  const std::size_t n = state_.unknowns();
  ChannelSums sums =
      state_.rows.residual(weights_, Vector(weights_.size()), Vector(n, broadcast(1.0F)), shares_);
  for (double& sum : sums) sum /= static_cast<double>(std::max<std::size_t>(n, 1));
  return sums;
}

// A sequence of rounds, each of them conjugate gradients on the texels that are free. The gradient is carried
// along with AᵀWA p of every step p, which one pass over A gives, and found anew from b − A x after every
// round, so that what rounding adds in a round is not carried further. All channels step together, each with
// its own step lengths.
//
// A texel is held in a round if it lies on a bound and the gradient pulls it outwards. What a round drives
// out of bounds is put on its bound afterwards, a projected search along the round's step that is shortened
// until the sum of squares does not rise (Moré and Toraldo, On the Solution of Large Quadratic Programming
// Problems with Bound Constraints, SIAM J. Optimization 1, 1991). First rounds are short: what they would do
// between wrong bounds to the last digit is lost; a round that has left no bounds goes on. Clamping the
// unbounded solution instead would be far from the best map: where the data leave a combination of texels
// undetermined, large positive and negative ones cancel.
SolveReport LeastSquares::minimise(const Vector& target, float magnitude, const Bounds& bounds,
                                   double tolerance, Vector& x) {
  const std::size_t n = state_.unknowns();
  Iterate it{Vector(n), Vector(n), Vector(n), {}};
  evaluate(target, magnitude, it.step, it);
  begin_round(magnitude, nullptr, it.step, it);
  const ChannelSums start = it.gamma;
  const auto relative_gradient = [&] {
    double worst = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (start[k] > 0) worst = std::max(worst, it.gamma[k] / start[k]);
    }
    return std::sqrt(worst);
  };

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
    begin_round(magnitude, &bounds, x, it);
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
    int end = static_cast<int>(length);
    for (int i = 0; report.iterations < state_.options.max_iterations; ++i) {
      if (i == end) {
        length *= kRoundGrowth;
        end += static_cast<int>(length);
        if (end > kLongestRound || !keeps(bounds, x, it.s, it.inverse)) break;
      }
      step_once(magnitude, x, it);
      ++report.iterations;
      // What follows can only be lost to rounding, or to the bounds.
      if (relative_gradient() <= kRoundAccuracy * tolerance) break;
    }
    squares = project(target, magnitude, bounds, before, squares, x, it);
  }
  return report;
}

ChannelSums LeastSquares::evaluate(const Vector& target, float magnitude, const Vector& x, Iterate& it) {
  ChannelSums squares = state_.rows.residual(weights_, target, x, shares_);
  data_squares_ = 0;
  for (const double sum : squares) data_squares_ += sum;
  state_.regulariser.prepare(x, scratch_);
  const ChannelSums regular = parallel_channel_sums(x.size(), [&](std::size_t begin, std::size_t end) {
    ChannelDoubles sums{};
    for (std::size_t i = begin; i < end; ++i) {
      const Channels g = regularised(i, magnitude, x);
      add_product(sums, x[i], g);
      it.s[i] = state_.rows.sum(shares_, i) - g;
    }
    return to_sums(sums);
  });
  add(squares, regular);
  return squares;
}

void LeastSquares::begin_round(float magnitude, const Bounds* bounds, const Vector& x, Iterate& it) {
  it.gamma = parallel_channel_sums(x.size(), [&](std::size_t begin, std::size_t end) {
    ChannelDoubles sums{};
    for (std::size_t i = begin; i < end; ++i) {
      Channels inverse = preconditioner(i, magnitude);
      if (bounds != nullptr) {
        const Channels lower = bounds->lower(i), upper = bounds->upper(i);
        for (std::size_t k = 0; k < 4; ++k) {
          if (held(x[i][k], it.s[i][k], lower[k], upper[k])) inverse[k] = 0.0F;
        }
      }
      it.inverse[i] = inverse;
      it.step[i] = inverse * it.s[i];
      add_product(sums, it.s[i], it.step[i]);
    }
    return to_sums(sums);
  });
}

// One step of conjugate gradients. With three passes over the unknowns, none of which keeps the matrix's
// product with the step: what length the step has is known from the rows before their shares are added up.
void LeastSquares::step_once(float magnitude, Vector& x, Iterate& it) {
  const std::size_t n = x.size();
  const bool regular = magnitude > 0.0F || state_.regulariser.acts();
  ChannelSums curvature = state_.rows.normal(weights_, it.step, shares_);
  if (regular) {
    it.regular.resize(n);
    state_.regulariser.prepare(it.step, scratch_);
    add(curvature, parallel_channel_sums(n, [&](std::size_t begin, std::size_t end) {
          ChannelDoubles sums{};
          for (std::size_t j = begin; j < end; ++j) {
            it.regular[j] = regularised(j, magnitude, it.step);
            add_product(sums, it.step[j], it.regular[j]);
          }
          return to_sums(sums);
        }));
  }
  ChannelSums length{};
  for (std::size_t k = 0; k < 4; ++k) length[k] = curvature[k] > 0 ? it.gamma[k] / curvature[k] : 0;
  const Channels a = to_channels(length);
  const ChannelSums next = parallel_channel_sums(n, [&](std::size_t begin, std::size_t end) {
    ChannelDoubles sums{};
    for (std::size_t j = begin; j < end; ++j) {
      Channels normal = state_.rows.sum(shares_, j);
      if (regular) normal += it.regular[j];
      const Channels s = it.s[j] - a * normal;
      it.s[j] = s;
      add_product(sums, s, it.inverse[j] * s);
    }
    return to_sums(sums);
  });
  ChannelSums ratio{};
  for (std::size_t k = 0; k < 4; ++k) ratio[k] = it.gamma[k] > 0 ? next[k] / it.gamma[k] : 0;
  it.gamma = next;
  const Channels b = to_channels(ratio);
  parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = begin; j < end; ++j) {
      const Channels step = it.step[j];
      x[j] += a * step;
      it.step[j] = it.inverse[j] * it.s[j] + b * step;
    }
  });
}

// Puts what a round made of `before` within the bounds, every channel as far along the round's step as does
// not raise its sum of squares. Returns the sums.
ChannelSums LeastSquares::project(const Vector& target, float magnitude, const Bounds& bounds,
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
