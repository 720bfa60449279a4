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

View transpose(const SolverView& view) {
  const RenderingMatrix& matrix = *view.matrix;
  View result{&matrix, view.nodes, {}, {}, {}, {}, {}};
  std::vector<std::uint32_t> number_of(matrix.columns, kNoTexel);
  for (const std::uint32_t texel : matrix.texels) number_of[texel] = 0;
  for (std::size_t texel = 0; texel < matrix.columns; ++texel) {
    if (number_of[texel] == kNoTexel) continue;
    number_of[texel] = static_cast<std::uint32_t>(result.texels.size());
    result.texels.push_back(static_cast<std::uint32_t>(texel));
  }
  result.column_offsets.assign(result.texels.size() + 1, 0);
  for (const std::uint32_t texel : matrix.texels) ++result.column_offsets[number_of[texel] + 1];
  for (std::size_t i = 0; i < result.texels.size(); ++i) {
    result.column_offsets[i + 1] += result.column_offsets[i];
  }
  result.rows.resize(matrix.nonzeros());
  result.entries.resize(matrix.nonzeros());
  std::vector<std::uint64_t> next(result.column_offsets.begin(), result.column_offsets.end() - 1);
  for (std::size_t r = 0; r < matrix.rows(); ++r) {
    for (std::uint64_t e = matrix.row_offsets[r]; e < matrix.row_offsets[r + 1]; ++e) {
      const std::uint64_t to = next[number_of[matrix.texels[e]]]++;
      result.rows[to] = static_cast<std::uint32_t>(r);
      result.entries[to] = matrix.weights[e];
    }
  }
  return result;
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
  std::vector<View> transposed;
  std::vector<std::uint8_t> seen(all);
  for (const SolverView& view : views) {
    check_length("matrix columns", view.matrix->columns, texels, "texels of all maps of a node");
    transposed.push_back(transpose(view));
    for (const NodeWeight& node : view.nodes) {
      check_range("node", node.node, 0, nodes - 1);
      check_at_least("node weight", static_cast<double>(node.weight), 0.0);
      const std::size_t first = texels * static_cast<std::size_t>(node.node);
      for (const std::uint32_t texel : transposed.back().texels) seen[first + texel] = 1;
    }
  }
  std::vector<std::uint32_t> number_of(all, kNoTexel);
  std::vector<std::uint32_t> numbered;
  for (std::size_t i = 0; i < all; ++i) {
    if (!seen[i]) continue;
    number_of[i] = static_cast<std::uint32_t>(numbered.size());
    numbered.push_back(static_cast<std::uint32_t>(i));
  }
  for (View& view : transposed) {
    for (const NodeWeight& node : view.nodes) {
      const std::size_t first = texels * static_cast<std::size_t>(node.node);
      std::vector<std::uint32_t>& unknowns = view.unknowns.emplace_back();
      for (const std::uint32_t texel : view.texels) unknowns.push_back(number_of[first + texel]);
    }
  }
  Regulariser regulariser(maps, number_of, numbered.size(), options);
  state_ = std::make_unique<State>(State{options,
                                         {maps.begin(), maps.end()},
                                         texels,
                                         nodes,
                                         std::move(transposed),
                                         std::move(seen),
                                         std::move(numbered),
                                         std::move(regulariser)});
}

MapSolver::~MapSolver() = default;
MapSolver::MapSolver(MapSolver&&) noexcept = default;
MapSolver& MapSolver::operator=(MapSolver&&) noexcept = default;

namespace {

void check(const SolveProblem& problem, const MapSolver::State& state) {
  check_range("channels", problem.channels, 1, 4);
  const std::size_t c = static_cast<std::size_t>(problem.channels);
  check_length("views", problem.views.size(), state.views.size(), "those of the solver");
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    const std::size_t expected = state.views[v].matrix->rows() * c;
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

// Back-projection: what each unknown's rows want on average.
Vector back_project(LeastSquares& system, const MapSolver::State& state, const std::vector<Vector>& target) {
  Vector x(state.unknowns()), total(state.unknowns());
  system.add_transposed(target, x);
  std::vector<Vector> ones = rows_of(state.views);
  for (Vector& rows : ones) std::fill(rows.begin(), rows.end(), broadcast(1.0F));
  system.add_transposed(ones, total);
  for (std::size_t i = 0; i < x.size(); ++i) {
    for (std::size_t k = 0; k < 4; ++k) x[i][k] = total[i][k] > 0.0F ? x[i][k] / total[i][k] : 0.0F;
  }
  return x;
}

// Root mean square of A x − t, weighted.
double rms_error(LeastSquares& system, const std::vector<Vector>& target,
                 const std::vector<Vector>& row_weights, const Vector& x, int channels) {
  std::vector<Vector> error = target;
  system.multiply(x, error);
  double weight = 0;
  for (std::size_t v = 0; v < target.size(); ++v) {
    for (std::size_t r = 0; r < target[v].size(); ++r) {
      error[v][r] -= target[v][r];
      for (std::size_t k = 0; k < static_cast<std::size_t>(channels); ++k) {
        weight += static_cast<double>(row_weights[v][r][k]);
      }
    }
  }
  double squares = 0;
  for (const double sum : system.weighted_squares(error)) squares += sum;
  return weight > 0 ? std::sqrt(squares / weight) : 0.0;
}

}  // namespace

MapSolution MapSolver::solve(const SolveProblem& problem) const {
  const State& s = *state_;
  check(problem, s);
  const std::size_t c = static_cast<std::size_t>(problem.channels);
  const std::size_t n = s.unknowns();
  std::vector<Vector> target, row_weights;
  for (const ViewTarget& view : problem.views) {
    target.push_back(widen(view.target, problem.channels));
    row_weights.push_back(widen(view.row_weights, problem.channels));
  }
  LeastSquares system(s, row_weights);

  // The unknown is the difference from the prior, which without one is zero.
  Vector all = problem.prior.empty() ? Vector(s.seen.size()) : widen(problem.prior, problem.channels);
  const auto seen_texels = [&](const Vector& map) {
    Vector values(n);
    for (std::size_t i = 0; i < n; ++i) values[i] = map[s.texels[i]];
    return values;
  };
  const Vector base = seen_texels(all);
  std::vector<Vector> wanted = target;
  if (!problem.prior.empty()) {
    std::vector<Vector> rendered = rows_of(s.views);
    system.multiply(base, rendered);
    for (std::size_t v = 0; v < wanted.size(); ++v) {
      for (std::size_t r = 0; r < wanted[v].size(); ++r) wanted[v][r] -= rendered[v][r];
    }
  }

  Channels largest{};
  for (std::size_t k = 0; k < 4; ++k) largest[k] = problem.upper_bounds[k];
  Bounds bounds{Vector(n), Vector(n)};
  for (std::size_t i = 0; i < n; ++i) {
    bounds.lower[i] = -base[i];
    bounds.upper[i] = largest - base[i];
  }

  Vector x;
  if (problem.initial.empty()) {
    x = back_project(system, s, wanted);
  } else {
    x = seen_texels(widen(problem.initial, problem.channels));
    for (std::size_t i = 0; i < n; ++i) x[i] -= base[i];
  }

  MapSolution solution;
  solution.report = system.minimise(wanted, problem.prior.empty() ? 0.0F : s.options.prior_weight, bounds, x);
  solution.report.rms_error = rms_error(system, wanted, row_weights, x, problem.channels);

  Vector difference(s.seen.size());
  for (std::size_t i = 0; i < n; ++i) difference[s.texels[i]] = x[i];
  const FillTowards towards = problem.prior.empty() ? FillTowards::neighbours : FillTowards::zero;
  for (std::size_t first = 0; first < difference.size();) {
    for (const TexelTopology& map : s.maps) {
      fill_unknown(map, {s.seen.data() + first, map.texels()}, towards,
                   {difference.data() + first, map.texels()});
      first += map.texels();
    }
  }
  solution.texels.resize(all.size() * c);
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i] += difference[i];
    for (std::size_t k = 0; k < c; ++k) {
      solution.texels[i * c + k] = std::clamp(all[i][k], 0.0F, problem.upper_bounds[k]);
    }
  }
  return solution;
}

}  // namespace mirrorbake
