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

using Words = std::uint32_t __attribute__((vector_size(16)));
using Halves = std::uint16_t __attribute__((vector_size(8)));
using Flags = std::int32_t __attribute__((vector_size(16)));
bool any(Flags flags) { return (flags[0] | flags[1] | flags[2] | flags[3]) != 0; }

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

// Whether a round may go on: nothing has left its bounds, and nothing that is held on one wants inside.
bool keeps(const Bounds& bounds, const TexelVector& x, const TexelVector& s,
           const std::vector<InverseDiagonal>& inverse) {
  std::atomic<bool> kept{true};
  const std::size_t stride = x.stride();
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end && kept.load(std::memory_order_relaxed); ++i) {
      const Channels at = x[i], lower = bounds.lower(i), upper = bounds.upper(i);
      Flags still{};
      for (std::size_t k = 0; k < stride; ++k) still[k] = inverse[stride * i + k] == 0 ? -1 : 0;
      const Flags left = (at < lower) | (at > upper);
      const Flags returns = still & (s[i] != Channels{}) & ~held(at, s[i], lower, upper);
      if (any(left | returns)) kept = false;
    }
  });
  return kept;
}

}  // namespace

LeastSquares::LeastSquares(const MapSolver::State& state, Vector row_weights, int stride)
    : state_(state),
      stride_(stride),
      weights_(std::move(row_weights)),
      shares_(state.rows.shares(), stride),
      diagonal_(state.rows.unknowns(), stride) {
  state.rows.diagonal(weights_, shares_);
  std::copy_n(shares_.data(), diagonal_.size() * diagonal_.stride(), diagonal_.data());
  row_scale_ = find_row_scale();
  scale_ = to_channels(row_scale_);
}

TexelVector LeastSquares::back_project(const Vector& target) {
  const BandedRows& rows = state_.rows;
  const TexelVector nothing = vector();
  const auto transposed = [&](const Vector& t) {
    TexelVector sums(rows.shares(), stride_);
    rows.for_bands([&](const Band& band) {
      ChannelSums squares{};
      rows.put(band, rows.residual(band, weights_, t, nothing, squares), sums);
    });
    rows.for_bands([&](const Band& band) { rows.add_parts(band, sums); });
    return sums;
  };
  const TexelVector wanted = transposed(target);
  const TexelVector total = transposed(Vector(target.size(), broadcast(1.0F)));
  TexelVector x = vector();
  parallel_for(x.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Channels by = total[i];
      x.set(i, by > Channels{} ? wanted[i] / by : Channels{});
    }
  });
  return x;
}

// Σ w (A 1)² over the unknowns.
ChannelSums LeastSquares::find_row_scale() {
  TexelVector ones = vector();
  std::fill_n(ones.data(), ones.size() * ones.stride(), 1.0F);
  ChannelSums sums = state_.rows.sum_over_bands([&](const Band& band) {
    ChannelSums squares{};
    state_.rows.normal(band, weights_, ones, squares);
    return squares;
  });
  for (double& sum : sums) sum /= static_cast<double>(std::max<std::size_t>(state_.rows.unknowns(), 1));
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
                                   double tolerance, TexelVector& x) {
  Iterate it{vector(), vector(), {}, {}};
  it.inverse.resize(x.size() * x.stride());
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
  report.unknowns = state_.rows.unknowns();
  report.row_scale = row_scale_;
  clamp_to(bounds, x);
  ChannelSums squares = evaluate(target, magnitude, x, it);
  double length = kFirstRound;
  double best = std::numeric_limits<double>::infinity();
  int best_at = 0;
  TexelVector before;
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

ChannelSums LeastSquares::evaluate(const Vector& target, float magnitude, const TexelVector& x, Iterate& it) {
  const BandedRows& rows = state_.rows;
  state_.regulariser.prepare(x, scratch_);
  std::vector<double> of_rows(rows.bands());
  const ChannelSums squares = rows.sum_over_bands([&](const Band& band) {
    ChannelSums sums{}, regular{};
    Channels* made = rows.residual(band, weights_, target, x, sums);
    for (const double sum : sums) of_rows[rows.number_of(band)] += sum;
    regularise(band, -1.0F, magnitude, x, made, regular);
    rows.put(band, made, shares_);
    for (std::size_t k = 0; k < 4; ++k) sums[k] -= regular[k];
    return sums;
  });
  data_squares_ = 0;
  for (const double sum : of_rows) data_squares_ += sum;
  rows.for_bands([&](const Band& band) {
    rows.add_parts(band, shares_);
    std::copy_n(shares_.at(band.first), band.own * x.stride(), it.s.at(band.first));
  });
  return squares;
}

void LeastSquares::regularise(const Band& band, float sign, float magnitude, const TexelVector& x,
                              Channels* made, ChannelSums& sums) const {
  if (!(magnitude > 0.0F || state_.regulariser.acts())) return;
  const Channels factor = broadcast(sign) * scale_;
  add(sums, state_.regulariser.add(band.first, band.first + band.own, factor, factor * broadcast(magnitude),
                                   x, scratch_, made));
}

void LeastSquares::begin_round(float magnitude, const Bounds* bounds, const TexelVector& x, Iterate& it) {
  it.gamma = parallel_channel_sums(x.size(), [&](std::size_t begin, std::size_t end) {
    ChannelDoubles sums{};
    for (std::size_t i = begin; i < end; ++i) {
      const Channels s = it.s[i];
      Channels inverse = preconditioner(i, magnitude);
      if (bounds != nullptr) {
        inverse = held(x[i], s, bounds->lower(i), bounds->upper(i)) ? Channels{} : inverse;
      }
      // As the loops read it, rounded towards 0.
      const Words bits = std::bit_cast<Words>(inverse) >> 16;
      const auto halves = __builtin_convertvector(bits, Halves);
      std::memcpy(&it.inverse[x.stride() * i], &halves, x.stride() == 4 ? 8 : 6);
      const Channels step = std::bit_cast<Channels>(bits << 16) * s;
      it.step.set(i, step);
      add_product(sums, s, step);
    }
    return to_sums(sums);
  });
}

// One step of conjugate gradients, in three passes. The first makes the bands' shares of the matrix's product
// with the step, and what length the step has; that product is added up by the second, nowhere kept.
void LeastSquares::step_once(float magnitude, TexelVector& x, Iterate& it) {
  const BandedRows& rows = state_.rows;
  const SolverLoops& loops = solver_loops();
  const std::size_t stride = x.stride();
  state_.regulariser.prepare(it.step, scratch_);
  const ChannelSums curvature = rows.sum_over_bands([&](const Band& band) {
    ChannelSums sums{};
    Channels* made = rows.normal(band, weights_, it.step, sums);
    regularise(band, 1.0F, magnitude, it.step, made, sums);
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
ChannelSums LeastSquares::project(const Vector& target, float magnitude, const Bounds& bounds,
                                  const TexelVector& before, const ChannelSums& squares, TexelVector& x,
                                  Iterate& it) {
  const TexelVector unbounded = x;
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
      for (std::size_t i = begin; i < end; ++i) x.set(i, before[i] + share * (unbounded[i] - before[i]));
    });
  }
}

}  // namespace mirrorbake
