#include "mirrorbake/inference/map_solver.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "pyramid_fill.hpp"
#include "regulariser.hpp"
#include "texel_vector.hpp"

namespace mirrorbake {
namespace {

using Vector = std::vector<Channels>;
constexpr std::size_t kRowGrain = 2048;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

void check_finite(const char* name, std::span<const float> values) {
  const auto bad = std::count_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
  if (bad > 0)
    throw InvalidArgument(name, "not finite in " + std::to_string(bad) + " values", "finite numbers");
}

void check_length(const char* name, std::size_t length, std::size_t expected) {
  if (length != expected) {
    throw InvalidArgument(name, std::to_string(length) + " numbers", std::to_string(expected));
  }
}

void check(const SolveOptions& options) {
  const auto check_weight = [](const char* name, float value) {
    if (!(value >= 0.0F && std::isfinite(value))) throw InvalidArgument(name, text_of(value), "a number ≥ 0");
  };
  check_weight("smoothness", options.smoothness);
  check_weight("level_agreement", options.level_agreement);
  check_weight("prior_weight", options.prior_weight);
  if (!(options.tolerance > 0.0F))
    throw InvalidArgument("tolerance", text_of(options.tolerance), "a number > 0");
  if (options.max_iterations < 0 || options.max_iterations > 100000) {
    throw InvalidArgument("max_iterations", std::to_string(options.max_iterations), "0 to 100000");
  }
}

Channels to_channels(const ChannelSums& sums) {
  Channels c{};
  for (std::size_t k = 0; k < 4; ++k) c[k] = static_cast<float>(sums[k]);
  return c;
}

}  // namespace

std::vector<float> display_row_weights(const RenderingMatrix& matrix, int samples_per_pixel,
                                       std::span<const float> target, int channels) {
  if (samples_per_pixel < 1)
    throw InvalidArgument("samples_per_pixel", std::to_string(samples_per_pixel), "at least 1");
  const std::size_t c = static_cast<std::size_t>(channels);
  check_length("target", target.size(), matrix.rows() * c);
  std::vector<float> weights(matrix.rows());
  for (std::size_t r = 0; r < weights.size(); ++r) {
    const float* b = target.data() + r * c;
    // Luminance of Rec.709 primaries (ITU-R BT.709-6, §3.2).
    const float luminance = c >= 3 ? 0.2126F * b[0] + 0.7152F * b[1] + 0.0722F * b[2] : b[0];
    const float compression = 1.0F + std::max(luminance, 0.0F);
    weights[r] = static_cast<float>(matrix.row_samples[r]) /
                 (static_cast<float>(samples_per_pixel) * compression * compression);
  }
  return weights;
}

namespace {

constexpr int kMaxRounds = 8;

// Of every unknown; the unknowns may be differences from a prior.
struct Bounds {
  Vector lower, upper;
};

// Puts what is out of bounds on its bound and holds it there; frees what is held and wants inside, going by half the negative
// gradient s. Returns whether there was anything to hold or free: only then another round can change the solution.
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

struct MapSolver::State {
  CubePyramidLayout layout;
  SolveOptions options;
  std::vector<float> row_weights;

  // A, its columns renumbered to the seen texels, and AᵀW in rows of its own, so that both products gather.
  std::vector<std::uint64_t> row_offsets;
  std::vector<std::uint32_t> columns;
  std::vector<float> weights;
  std::vector<std::uint64_t> column_offsets;
  std::vector<std::uint32_t> rows;
  std::vector<float> weighted;

  std::vector<std::uint32_t> texels;  // of each unknown
  std::vector<std::uint8_t> seen;     // of each texel
  std::vector<float> column_weight;   // AᵀW 1
  std::vector<float> data_diagonal;   // of AᵀW A
  Regulariser regulariser;

  std::size_t unknowns() const { return texels.size(); }

  void multiply(const Vector& x, Vector& b) const {
    parallel_for(row_weights.size(), kRowGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) {
        Channels sum{};
        for (std::uint64_t e = row_offsets[r]; e < row_offsets[r + 1]; ++e)
          sum += broadcast(weights[e]) * x[columns[e]];
        b[r] = sum;
      }
    });
  }

  // s = AᵀW t − g, half the negative gradient; z = s / diagonal where free is 1, else 0. Returns s·z.
  ChannelSums preconditioned_gradient(float magnitude, const Vector& free, const Vector& t, const Vector& g,
                                      Vector& s, Vector& z) const {
    return parallel_channel_sums(unknowns(), [&](std::size_t begin, std::size_t end) {
      ChannelSums sums{};
      for (std::size_t i = begin; i < end; ++i) {
        s[i] = -g[i];
        for (std::uint64_t e = column_offsets[i]; e < column_offsets[i + 1]; ++e) {
          s[i] += broadcast(weighted[e]) * t[rows[e]];
        }
        const float diagonal = data_diagonal[i] + regulariser.diagonal(i) + magnitude;
        z[i] = diagonal > 0.0F ? free[i] * s[i] / broadcast(diagonal) : Channels{};
        add_product(sums, s[i], z[i]);
      }
      return sums;
    });
  }

  // Minimises Σ w |A x − target|² + regulariser + magnitude |x|² over lower ≤ x ≤ upper, starting from x.
  SolveReport minimise(const Vector& target, float magnitude, const Bounds& bounds, Vector& x) const;
};

namespace {

// Numbers the columns that some row reads.
std::pair<std::vector<std::uint32_t>, std::vector<std::uint32_t>> number_seen(const RenderingMatrix& matrix) {
  std::vector<std::uint32_t> number_of(matrix.columns, Regulariser::kNone);
  for (std::uint32_t texel : matrix.texels) number_of[texel] = 0;
  std::vector<std::uint32_t> texels;
  for (std::size_t texel = 0; texel < matrix.columns; ++texel) {
    if (number_of[texel] == Regulariser::kNone) continue;
    number_of[texel] = static_cast<std::uint32_t>(texels.size());
    texels.push_back(static_cast<std::uint32_t>(texel));
  }
  return {std::move(texels), std::move(number_of)};
}

}  // namespace

MapSolver::MapSolver(const RenderingMatrix& matrix, std::span<const float> row_weights,
                     const CubePyramidLayout& layout, const SolveOptions& options) {
  check(options);
  if (!std::has_single_bit(static_cast<unsigned>(layout.size))) {
    throw InvalidArgument("layout.size", std::to_string(layout.size), "a power of two");
  }
  check_length("matrix columns", matrix.columns, layout.texels());
  check_length("row_weights", row_weights.size(), matrix.rows());
  const auto bad = std::count_if(row_weights.begin(), row_weights.end(),
                                 [](float w) { return !(w >= 0.0F && std::isfinite(w)); });
  if (bad > 0) {
    throw InvalidArgument("row_weights", "negative or not finite in " + std::to_string(bad) + " values",
                          "numbers ≥ 0");
  }

  auto [texels, number_of] = number_seen(matrix);
  const std::size_t n = texels.size();
  std::vector<std::uint32_t> columns(matrix.nonzeros());
  parallel_for(columns.size(), 65536, [&, &numbers = number_of](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) columns[e] = numbers[matrix.texels[e]];
  });

  std::vector<std::uint64_t> column_offsets(n + 1);
  for (std::uint32_t column : columns) ++column_offsets[column + 1];
  for (std::size_t i = 0; i < n; ++i) column_offsets[i + 1] += column_offsets[i];
  std::vector<std::uint32_t> rows(columns.size());
  std::vector<float> weighted(columns.size());
  std::vector<float> column_weight(n);
  std::vector<float> data_diagonal(n);
  std::vector<std::uint64_t> next(column_offsets.begin(), column_offsets.end() - 1);
  for (std::size_t r = 0; r < matrix.rows(); ++r) {
    for (std::uint64_t e = matrix.row_offsets[r]; e < matrix.row_offsets[r + 1]; ++e) {
      const std::uint32_t i = columns[e];
      const float w = row_weights[r] * matrix.weights[e];
      rows[next[i]] = static_cast<std::uint32_t>(r);
      weighted[next[i]++] = w;
      column_weight[i] += w;
      data_diagonal[i] += w * matrix.weights[e];
    }
  }

  std::vector<std::uint8_t> seen(matrix.columns);
  for (std::uint32_t texel : texels) seen[texel] = 1;
  Regulariser regulariser(layout, texels, number_of, {options.smoothness, options.level_agreement});
  state_ = std::make_unique<State>(State{layout,
                                         options,
                                         {row_weights.begin(), row_weights.end()},
                                         matrix.row_offsets,
                                         std::move(columns),
                                         matrix.weights,
                                         std::move(column_offsets),
                                         std::move(rows),
                                         std::move(weighted),
                                         std::move(texels),
                                         std::move(seen),
                                         std::move(column_weight),
                                         std::move(data_diagonal),
                                         std::move(regulariser)});
}

MapSolver::~MapSolver() = default;
MapSolver::MapSolver(MapSolver&&) noexcept = default;
MapSolver& MapSolver::operator=(MapSolver&&) noexcept = default;

// CGLS (Björck, Numerical Methods for Least Squares Problems, 1996, §7.4): the residual t = b − A x is carried along
// instead of AᵀA's, so that rounding grows with the condition number of A, not its square. G x of the regulariser is
// carried along likewise. All channels step together, each with its own step lengths.
//
// The bounds are an active set around it (op. cit., §5.2): texels that a round of conjugate gradients drives out of
// bounds are put on their bound and held there, held ones that the gradient pulls inside are set free, and the next round
// goes on from there. Clamping the unbounded solution instead would be far from the best map: where the data leave a
// combination of texels undetermined, large positive and negative ones cancel each other.
SolveReport MapSolver::State::minimise(const Vector& target, float magnitude, const Bounds& bounds,
                                       Vector& x) const {
  const std::size_t n = unknowns();
  const std::size_t m = row_weights.size();
  Vector residual(m), step_rows(m), gx(n), step_gx(n), s(n), z(n), step(n), scratch;
  Vector free(n, broadcast(1.0F));

  ChannelSums gamma{};
  const ChannelSums scale = preconditioned_gradient(magnitude, free, target, Vector(n), s, z);
  const double tolerance2 = static_cast<double>(options.tolerance) * static_cast<double>(options.tolerance);
  const auto relative_gradient2 = [&] {
    double worst = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (scale[k] > 0) worst = std::max(worst, gamma[k] / scale[k]);
    }
    return worst;
  };

  SolveReport report;
  report.unknowns = n;
  bool bounded = false;
  while (!bounded && report.rounds < kMaxRounds) {
    ++report.rounds;
    multiply(x, residual);
    for (std::size_t r = 0; r < m; ++r) residual[r] = target[r] - residual[r];
    regulariser.apply(x, magnitude, scratch, gx);
    gamma = preconditioned_gradient(magnitude, free, residual, gx, s, z);
    step = z;
    while (report.iterations < options.max_iterations && relative_gradient2() > tolerance2) {
      multiply(step, step_rows);
      const ChannelSums data_curvature = parallel_channel_sums(m, [&](std::size_t begin, std::size_t end) {
        ChannelSums sums{};
        for (std::size_t r = begin; r < end; ++r) {
          add_product(sums, broadcast(row_weights[r]) * step_rows[r], step_rows[r]);
        }
        return sums;
      });
      const ChannelSums curvature = regulariser.apply(step, magnitude, scratch, step_gx);
      ChannelSums length{};
      for (std::size_t k = 0; k < 4; ++k) {
        const double total = data_curvature[k] + curvature[k];
        length[k] = total > 0 ? gamma[k] / total : 0;
      }
      const Channels a = to_channels(length);
      parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          x[i] += a * step[i];
          gx[i] += a * step_gx[i];
        }
      });
      parallel_for(m, kVectorGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t r = begin; r < end; ++r) residual[r] -= a * step_rows[r];
      });
      const ChannelSums next_gamma = preconditioned_gradient(magnitude, free, residual, gx, s, z);
      ChannelSums ratio{};
      for (std::size_t k = 0; k < 4; ++k) ratio[k] = gamma[k] > 0 ? next_gamma[k] / gamma[k] : 0;
      gamma = next_gamma;
      const Channels b = to_channels(ratio);
      parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) step[i] = z[i] + b * step[i];
      });
      ++report.iterations;
    }
    bounded = !hold_to(bounds, s, x, free);
  }
  report.relative_gradient = std::sqrt(relative_gradient2());
  if (!std::isfinite(report.relative_gradient)) throw NumericalError("conjugate gradients diverged");
  return report;
}

MapSolution MapSolver::solve(std::span<const float> target, int channels, std::span<const float> prior,
                             std::span<const float> initial) const {
  const State& s = *state_;
  if (channels < 1 || channels > 4) throw InvalidArgument("channels", std::to_string(channels), "1 to 4");
  const std::size_t c = static_cast<std::size_t>(channels);
  const std::size_t n = s.unknowns();
  const std::size_t m = s.row_weights.size();
  check_length("target", target.size(), m * c);
  check_finite("target", target);
  for (const auto& [name, map] : {std::pair{"prior", prior}, std::pair{"initial", initial}}) {
    if (map.empty()) continue;
    check_length(name, map.size(), s.layout.texels() * c);
    check_finite(name, map);
  }

  // The unknown is the difference from the prior, which without one is zero.
  Vector all = prior.empty() ? Vector(s.layout.texels()) : widen(prior, channels);
  const auto seen_texels = [&](const Vector& map) {
    Vector values(n);
    for (std::size_t i = 0; i < n; ++i) values[i] = map[s.texels[i]];
    return values;
  };
  const Vector base = seen_texels(all);
  Vector b = widen(target, channels);
  if (!prior.empty()) {
    Vector rendered(m);
    s.multiply(base, rendered);
    for (std::size_t r = 0; r < m; ++r) b[r] -= rendered[r];
  }

  Bounds bounds{Vector(n), Vector(n)};
  const Channels largest{kInfinity, kInfinity, kInfinity, 1.0F};
  for (std::size_t i = 0; i < n; ++i) {
    bounds.lower[i] = -base[i];
    bounds.upper[i] = largest - base[i];
  }

  Vector x(n);
  if (!initial.empty()) {
    x = seen_texels(widen(initial, channels));
    for (std::size_t i = 0; i < n; ++i) x[i] -= base[i];
  } else {
    parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        Channels sum{};
        for (std::uint64_t e = s.column_offsets[i]; e < s.column_offsets[i + 1]; ++e) {
          sum += broadcast(s.weighted[e]) * b[s.rows[e]];
        }
        if (s.column_weight[i] > 0.0F) x[i] = sum / broadcast(s.column_weight[i]);
      }
    });
  }

  MapSolution solution;
  solution.report = s.minimise(b, prior.empty() ? 0.0F : s.options.prior_weight, bounds, x);

  Vector difference(s.layout.texels());
  for (std::size_t i = 0; i < n; ++i) difference[s.texels[i]] = x[i];
  fill_unknown(s.layout, s.seen, prior.empty() ? FillTowards::neighbours : FillTowards::zero, difference);
  solution.texels.resize(s.layout.texels() * c);
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i] += difference[i];
    for (std::size_t k = 0; k < c; ++k) {
      const float value = std::max(all[i][k], 0.0F);
      all[i][k] = k == 3 ? std::min(value, 1.0F) : value;
      solution.texels[i * c + k] = all[i][k];
    }
  }

  const Vector final_seen = seen_texels(all);
  const Vector wanted = widen(target, channels);
  Vector rendered(m);
  s.multiply(final_seen, rendered);
  double squares = 0;
  double weight = 0;
  for (std::size_t r = 0; r < m; ++r) {
    const Channels error = rendered[r] - wanted[r];
    for (std::size_t k = 0; k < c; ++k) {
      squares += static_cast<double>(s.row_weights[r]) * static_cast<double>(error[k]) *
                 static_cast<double>(error[k]);
    }
    weight += static_cast<double>(s.row_weights[r]) * static_cast<double>(channels);
  }
  solution.report.rms_error = weight > 0 ? std::sqrt(squares / weight) : 0.0;
  return solution;
}

}  // namespace mirrorbake
