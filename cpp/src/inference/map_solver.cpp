#include "mirrorbake/inference/map_solver.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "least_squares.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "pyramid_fill.hpp"

namespace mirrorbake {
namespace {

// Beyond this magnitude squares and their sums could leave the range of float.
constexpr float kLargest = 1e15F;

void check_magnitude(const char* name, std::span<const float> values) {
  const auto bad =
      std::count_if(values.begin(), values.end(), [](float v) { return !(std::abs(v) <= kLargest); });
  if (bad > 0) {
    throw InvalidArgument(name, "not finite or too large in " + std::to_string(bad) + " values",
                          "finite numbers up to 1e15");
  }
}

void check(const SolveOptions& options) {
  for (const SolveWeight& weight : kSolveWeights) {
    check_at_least(weight.name, static_cast<double>(options.*weight.value), 0.0);
  }
  if (!(options.tolerance > 0.0F && options.tolerance < 1.0F)) {
    throw InvalidArgument("tolerance", text_of(options.tolerance), "a number in (0, 1)");
  }
  check_range("max_iterations", options.max_iterations, 0, 100000);
}

}  // namespace

MapSolver::MapSolver(std::span<const SolverView> views, std::span<const TexelTopology> maps, int nodes,
                     const SolveOptions& options) {
  check(options);
  check_range("nodes", nodes, 1, 1 << 16);
  std::size_t texels = 0;
  for (const TexelTopology& map : maps) texels += map.texels();
  const std::size_t all = texels * static_cast<std::size_t>(nodes);
  if (all >= kNoTexel) {
    throw InvalidArgument("nodes", std::to_string(nodes) + " of " + std::to_string(texels) + " texels",
                          "below 2^32 texels in all");
  }
  for (const SolverView& view : views) {
    check_length("matrix columns", view.matrix->columns, texels, "texels of all maps of a node");
    for (const NodeWeight& node : view.nodes) {
      check_range("node", node.node, 0, nodes - 1);
      check_at_least("node weight", static_cast<double>(node.weight), 0.0);
    }
  }
  BandedRows rows(views, maps, nodes);
  std::vector<std::uint8_t> seen(all);
  std::vector<std::uint32_t> number_of(all, kNoTexel);
  for (std::size_t i = 0; i < rows.unknowns(); ++i) {
    seen[rows.texels()[i]] = 1;
    number_of[rows.texels()[i]] = static_cast<std::uint32_t>(i);
  }
  Regulariser regulariser(maps, number_of, rows.unknowns(), options);
  state_ = std::make_unique<State>(State{options,
                                         {maps.begin(), maps.end()},
                                         texels,
                                         nodes,
                                         std::move(rows),
                                         std::move(seen),
                                         std::move(regulariser)});
}

MapSolver::~MapSolver() = default;
MapSolver::MapSolver(MapSolver&&) noexcept = default;
MapSolver& MapSolver::operator=(MapSolver&&) noexcept = default;

namespace {

void check(const SolveProblem& problem, const MapSolver::State& state) {
  check_range("channels", problem.channels, 1, 4);
  check_at_least("slack", static_cast<double>(problem.slack), 1.0);
  const std::size_t c = static_cast<std::size_t>(problem.channels);
  check_length("views", problem.views.size(), state.rows.views(), "those of the solver");
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    const std::size_t expected = state.rows.places(v).size() * c;
    check_length("target", problem.views[v].target.size(), expected, "rows × channels");
    check_length("row_weights", problem.views[v].row_weights.size(), expected, "rows × channels");
    check_magnitude("target", problem.views[v].target);
    const auto bad = std::count_if(problem.views[v].row_weights.begin(), problem.views[v].row_weights.end(),
                                   [](float w) { return !(w >= 0.0F && w <= kLargest); });
    if (bad > 0) {
      throw InvalidArgument("row_weights",
                            "negative, not finite or too large in " + std::to_string(bad) + " values",
                            "numbers from 0 to 1e15");
    }
  }
  for (const auto& [name, map] : {std::pair{"prior", problem.prior}, std::pair{"initial", problem.initial}}) {
    if (map.empty()) continue;
    check_length(name, map.size(), state.seen.size() * c, "nodes × texels × channels");
    check_magnitude(name, map);
  }
}

// Of the rows in the order of their bands.
Vector widen_rows(const SolveProblem& problem, std::span<const float> ViewTarget::*values,
                  const BandedRows& rows) {
  const auto channels = static_cast<std::size_t>(problem.channels);
  Vector wide(rows.rows());
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    const float* value = (problem.views[v].*values).data();
    for (const std::uint32_t r : rows.places(v)) {
      for (std::size_t k = 0; k < channels; ++k) wide[r][k] = *value++;
    }
  }
  return wide;
}

// Goes on with `texels` of `channels` floats where no row sees them.
void fill_unseen(const MapSolver::State& state, FillTowards towards, std::size_t channels,
                 std::vector<float>& texels) {
  Vector values;
  for (std::size_t first = 0; first < state.seen.size();) {
    for (const TexelTopology& map : state.maps) {
      float* of_map = texels.data() + first * channels;
      const std::span seen(state.seen.data() + first, map.texels());
      first += map.texels();
      // A map that nothing is known of stays 0.
      if (std::ranges::find(seen, 1) == seen.end()) continue;
      values.resize(map.texels());
      parallel_for(map.texels(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          for (std::size_t k = 0; k < channels; ++k) values[i][k] = of_map[i * channels + k];
        }
      });
      fill_unknown(map, seen, towards, values);
      parallel_for(map.texels(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          for (std::size_t k = 0; k < channels; ++k) of_map[i * channels + k] = values[i][k];
        }
      });
    }
  }
}

double sum_of(const Vector& weights, int channels) {
  double sum = 0;
  for (const Channels& weight : weights) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(channels); ++k)
      sum += static_cast<double>(weight[k]);
  }
  return sum;
}

}  // namespace

MapSolution MapSolver::solve(const SolveProblem& problem) const {
  const State& s = *state_;
  check(problem, s);
  const std::size_t c = static_cast<std::size_t>(problem.channels);
  const std::size_t n = s.rows.unknowns();
  const std::vector<std::uint32_t>& texels = s.rows.texels();
  Vector wanted = widen_rows(problem, &ViewTarget::target, s.rows);
  const Vector row_weights = widen_rows(problem, &ViewTarget::row_weights, s.rows);
  const int stride = problem.channels == 4 ? 4 : 3;
  const float magnitude = problem.prior.empty() ? 0.0F : s.options.prior_weight;
  LeastSquares system(s, row_weights, magnitude, stride);

  // Of a map of all nodes, the texels that are seen.
  const auto seen_texels = [&](std::span<const float> map) {
    TexelVector values(n, stride);
    if (map.empty()) return values;
    parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        std::copy_n(map.data() + texels[i] * c, c, values.at(i));
      }
    });
    return values;
  };
  // The unknown is the difference from the prior, which without one is zero.
  const TexelVector base = seen_texels(problem.prior);
  if (!problem.prior.empty()) {
    Vector rendered(wanted.size());
    s.rows.multiply(base, rendered);
    for (std::size_t r = 0; r < wanted.size(); ++r) wanted[r] -= rendered[r];
  }

  Channels largest{};
  for (std::size_t k = 0; k < 4; ++k) largest[k] = problem.upper_bounds[k];
  const Bounds bounds{base, largest};

  TexelVector x;
  if (!problem.initial.empty()) {
    x = seen_texels(problem.initial);
    for (std::size_t i = 0; i < n; ++i) x.set(i, x[i] - base[i]);
  }

  MapSolution solution;
  solution.report =
      system.minimise(wanted, bounds, static_cast<double>(problem.slack * s.options.tolerance), x);
  const double weight = sum_of(row_weights, problem.channels);
  solution.report.rms_error = weight > 0 ? std::sqrt(system.data_squares() / weight) : 0.0;

  solution.texels.resize(s.seen.size() * c);
  parallel_for(n, kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::copy_n(x.at(i), c, solution.texels.data() + texels[i] * c);
    }
  });
  if (problem.unseen == UnseenTexels::filled) {
    fill_unseen(s, problem.prior.empty() ? FillTowards::neighbours : FillTowards::zero, c, solution.texels);
  }
  parallel_for(s.seen.size(), kVectorGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t k = 0; k < c; ++k) {
        const float from = problem.prior.empty() ? 0.0F : problem.prior[i * c + k];
        float& texel = solution.texels[i * c + k];
        texel = std::clamp(from + texel, 0.0F, problem.upper_bounds[k]);
      }
    }
  });
  return solution;
}

}  // namespace mirrorbake
