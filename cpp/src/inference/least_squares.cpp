#include "least_squares.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

// Steps of the first round, and by how much each is longer than the one before. Measured on traced views:
// with first rounds of 10 steps a solve takes up to twice as many.
constexpr double kFirstRound = 5;
constexpr double kRoundGrowth = 1.3;

// A round goes on while no more of the unknowns' channels are on the wrong side of a bound, or held on one in
// vain. Of traced views it is some hundredths.
constexpr double kFew = 1e-3;

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

using Words = std::uint32_t __attribute__((vector_size(16)));
using Halves = std::uint16_t __attribute__((vector_size(8)));
using Flags = std::int32_t __attribute__((vector_size(16)));

void clamp_to(const Bounds& bounds, TexelVector& x) {
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Channels lower = bounds.lower(i), upper = bounds.upper(i), at = x.alone(i);
      const Channels above = at < lower ? lower : at;
      x.set(i, above > upper ? upper : above);
    }
  });
}

// Which channels of a texel lie on a bound from which half the negative gradient s does not lead inside.
Flags held(Channels x, Channels s, Channels lower, Channels upper) {
  return ((x <= lower) & (s <= Channels{})) | ((x >= upper) & (s >= Channels{}));
}

// Whether a round may go on: next to nothing has left its bounds, or is held on one and wants inside.
bool keeps(const Bounds& bounds, const TexelVector& x, const TexelVector& s,
           const std::vector<HalfFloat>& inverse) {
  const std::size_t stride = x.stride();
  const auto few = static_cast<std::size_t>(kFew * static_cast<double>(inverse.size()));
  std::atomic<std::size_t> wrong{0};
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    if (wrong.load(std::memory_order_relaxed) > few) return;
    Flags here{};
    for (std::size_t i = begin; i < end; ++i) {
      const Channels at = x[i], lower = bounds.lower(i), upper = bounds.upper(i);
      Flags still{};
      for (std::size_t k = 0; k < stride; ++k) still[k] = inverse[stride * i + k] == 0 ? -1 : 0;
      const Flags left = (at < lower) | (at > upper);
      const Flags returns = still & (s[i] != Channels{}) & ~held(at, s[i], lower, upper);
      here -= left | returns;
    }
    for (std::size_t k = 0; k < stride; ++k) wrong += static_cast<std::size_t>(here[k]);
  });
  return wrong <= few;
}

}  // namespace

LeastSquares::LeastSquares(const MapSolver::State& state, Vector row_weights, float magnitude, int stride)
    : state_(state),
      magnitude_(magnitude),
      stride_(stride),
      weights_(std::move(row_weights)),
      shares_(state.rows.shares(), stride),
      row_sums_(vector()) {
  find_row_sums();
  find_preconditioner();
}

// Of AᵀWA, which has no entry below 0, and of what the regulariser's weights are relative to, Σ w (A 1)² over
// the unknowns.
void LeastSquares::find_row_sums() {
  const BandedRows& rows = state_.rows;
  // Of a map of ones, whose place they take.
  std::fill_n(row_sums_.data(), row_sums_.size() * row_sums_.stride(), 1.0F);
  row_scale_ = rows.sum_over_bands([&](const Band& band) {
    ChannelSums squares{};
    rows.put(band, rows.normal(band, weights_, row_sums_, squares), shares_);
    return squares;
  });
  rows.for_bands([&](const Band& band) {
    rows.add_parts(band, shares_);
    std::copy_n(shares_.at(band.first), band.own * row_sums_.stride(), row_sums_.at(band.first));
  });
  for (double& sum : row_scale_) sum /= static_cast<double>(std::max<std::size_t>(rows.unknowns(), 1));
  scale_ = to_channels(row_scale_);
}

// The inverse of Σ |entries| of a row of the matrix, not of its diagonal: texels of coarse levels have small
// weights in many rows, so that their diagonals say little of how much they move with others.
void LeastSquares::find_preconditioner() {
  free_.resize(row_sums_.size() * row_sums_.stride());
  parallel_for(row_sums_.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Channels sum = row_sums_[i] + broadcast(state_.regulariser.row_sum(i) + magnitude_) * scale_;
      const Channels inverse = sum > Channels{} ? broadcast(1.0F) / sum : Channels{};
      // Rounded towards 0.
      const auto halves = __builtin_convertvector(std::bit_cast<Words>(inverse) >> 16, Halves);
      std::memcpy(&free_[row_sums_.stride() * i], &halves, row_sums_.stride() == 4 ? 8 : 6);
    }
  });
}

// What each unknown's rows want of it on average; s: AᵀW target.
TexelVector LeastSquares::back_project(const TexelVector& s) const {
  TexelVector x = vector();
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Channels by = row_sums_[i];
      x.set(i, by > Channels{} ? s[i] / by : Channels{});
    }
  });
  return x;
}

ChannelSums LeastSquares::size_of(TexelVector& s) const {
  // A step of no length changes nothing.
  const Channels none{};
  return parallel_channel_sums(s.size(), [&](std::size_t begin, std::size_t end) {
    ChannelSums sums{};
    solver_loops().gradient(end - begin, s.stride(), floats(&none), s.at(begin),
                            free_.data() + s.stride() * begin, s.at(begin), sums.data());
    return sums;
  });
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
SolveReport LeastSquares::minimise(const Vector& target, const Bounds& bounds, double tolerance,
                                   TexelVector& x) {
  Iterate it{vector(), vector(), {}, {}};
  it.inverse.resize(free_.size());
  evaluate(target, TexelVector(), it);
  const ChannelSums start = size_of(it.s);
  if (x.size() == 0) x = back_project(it.s);
  const auto relative_gradient = [&] {
    double worst = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (start[k] > 0) worst = std::max(worst, it.gamma[k] / start[k]);
    }
    return std::sqrt(worst);
  };

  SolveReport report;
  report.unknowns = state_.rows.unknowns();
  report.row_scale = row_scale_;
  clamp_to(bounds, x);
  ChannelSums squares = evaluate(target, x, it);
  double length = kFirstRound;
  double best = std::numeric_limits<double>::infinity();
  int best_at = 0;
  TexelVector before;
  while (true) {
    begin_round(bounds, x, it);
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
      step_once(x, it);
      ++report.iterations;
      // What follows can only be lost to rounding, or to the bounds.
      if (relative_gradient() <= kRoundAccuracy * tolerance) break;
    }
    squares = project(target, bounds, before, squares, x, it);
  }
  return report;
}

ChannelSums LeastSquares::evaluate(const Vector& target, const TexelVector& x, Iterate& it) {
  const BandedRows& rows = state_.rows;
  const bool at_zero = x.size() == 0;
  if (!at_zero) state_.regulariser.prepare(x, scratch_);
  std::vector<double> of_rows(rows.bands());
  const ChannelSums squares = rows.sum_over_bands([&](const Band& band) {
    ChannelSums sums{}, regular{};
    Channels* made = rows.residual(band, weights_, target, x, sums);
    for (const double sum : sums) of_rows[rows.number_of(band)] += sum;
    if (!at_zero) regularise(band, -1.0F, x, made, regular);
    rows.put(band, made, shares_);
    for (std::size_t k = 0; k < 4; ++k) sums[k] -= regular[k];
    return sums;
  });
  data_squares_ = 0;
  for (const double sum : of_rows) data_squares_ += sum;
  rows.for_bands([&](const Band& band) {
    rows.add_parts(band, shares_);
    std::copy_n(shares_.at(band.first), band.own * it.s.stride(), it.s.at(band.first));
  });
  return squares;
}

void LeastSquares::regularise(const Band& band, float sign, const TexelVector& x, Channels* made,
                              ChannelSums& sums) const {
  if (!(magnitude_ > 0.0F || state_.regulariser.acts())) return;
  const Channels factor = broadcast(sign) * scale_;
  add(sums, state_.regulariser.add(band.first, band.first + band.own, factor, factor * broadcast(magnitude_),
                                   x, scratch_, made));
}

void LeastSquares::begin_round(const Bounds& bounds, const TexelVector& x, Iterate& it) {
  const std::size_t stride = x.stride();
  it.gamma = parallel_channel_sums(x.size(), [&](std::size_t begin, std::size_t end) {
    ChannelSums sums{};
    solver_loops().begin(end - begin, stride, free_.data() + stride * begin, bounds.base.at(begin),
                         floats(&bounds.largest), x.at(begin), it.s.at(begin),
                         it.inverse.data() + stride * begin, it.step.at(begin), sums.data());
    return sums;
  });
}

// One step of conjugate gradients, in three passes. The first makes the bands' shares of the matrix's product
// with the step, and what length the step has; that product is added up by the second, nowhere kept.
void LeastSquares::step_once(TexelVector& x, Iterate& it) {
  const BandedRows& rows = state_.rows;
  const SolverLoops& loops = solver_loops();
  const std::size_t stride = x.stride();
  state_.regulariser.prepare(it.step, scratch_);
  const ChannelSums curvature = rows.sum_over_bands([&](const Band& band) {
    ChannelSums sums{};
    Channels* made = rows.normal(band, weights_, it.step, sums);
    regularise(band, 1.0F, it.step, made, sums);
    rows.put(band, made, shares_);
    return sums;
  });
  ChannelSums length{};
  for (std::size_t k = 0; k < 4; ++k) length[k] = curvature[k] > 0 ? it.gamma[k] / curvature[k] : 0;
  const Channels a = to_channels(length);
  const ChannelSums next = rows.sum_over_bands([&](const Band& band) {
    rows.add_parts(band, shares_);
    ChannelSums sums{};
    loops.gradient(band.own, stride, floats(&a), shares_.at(band.first),
                   it.inverse.data() + stride * band.first, it.s.at(band.first), sums.data());
    return sums;
  });
  ChannelSums ratio{};
  for (std::size_t k = 0; k < 4; ++k) ratio[k] = it.gamma[k] > 0 ? next[k] / it.gamma[k] : 0;
  it.gamma = next;
  const Channels b = to_channels(ratio);
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    loops.step(end - begin, stride, floats(&a), floats(&b), it.inverse.data() + stride * begin,
               it.s.at(begin), x.at(begin), it.step.at(begin));
  });
}

// Puts what a round made of `before` within the bounds, every channel as far along the round's step as does
// not raise its sum of squares. Returns the sums.
ChannelSums LeastSquares::project(const Vector& target, const Bounds& bounds, const TexelVector& before,
                                  const ChannelSums& squares, TexelVector& x, Iterate& it) {
  const TexelVector unbounded = x;
  Channels share = broadcast(1.0F);
  for (int tries = 0;; ++tries) {
    clamp_to(bounds, x);
    const ChannelSums now = evaluate(target, x, it);
    bool shorter = false;
    for (std::size_t k = 0; k < 4; ++k) {
      // Sums of floats are the same to about this share.
      if (now[k] <= squares[k] * (1.0 + 1e-6) || share[k] == 0.0F) continue;
      share[k] = tries < kMaxHalvings ? 0.5F * share[k] : 0.0F;
      shorter = true;
    }
    if (!shorter) return now;
    parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) x.set(i, before[i] + share * (unbounded[i] - before[i]));
    });
  }
}

}  // namespace mirrorbake
