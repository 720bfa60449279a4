#include "mirrorbake/inference/map_solver.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <Eigen/Dense>

#include "mirror_sphere.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

const Proxy kInfinity{InfiniteSphere{}, {0.0F, 0.0F, 0.0F}};

const RunTimeModel kIsotropic = [] {
  RunTimeModel model = reference_run_time();
  model.filter = LookupFilter::trilinear;
  return model;
}();

struct Problem {
  CubePyramidLayout layout;
  RenderingMatrix matrix;
  std::vector<float> row_weights;
};

// A solver for the one map of one view.
MapSolver make_solver(const RenderingMatrix& matrix, const TexelTopology& topology,
                      const SolveOptions& options = {}) {
  const SolverView view{&matrix};
  return MapSolver({&view, 1}, {&topology, 1}, 1, options);
}

// Every channel with the same row weights.
MapSolution solve(const MapSolver& solver, std::span<const float> row_weights, std::span<const float> target,
                  int channels, std::span<const float> prior = {}) {
  std::vector<float> weights;
  for (float w : row_weights) weights.insert(weights.end(), static_cast<std::size_t>(channels), w);
  const ViewTarget view{target, weights};
  return solver.solve({.channels = channels, .views = {&view, 1}, .prior = prior});
}

MapSolution solve(const Problem& problem, const SolveOptions& options, std::span<const float> target,
                  int channels, std::span<const float> prior = {}) {
  return solve(make_solver(problem.matrix, problem.layout, options), problem.row_weights, target, channels,
               prior);
}

Problem make_problem(int image, int samples_per_pixel, int size) {
  Problem problem;
  const SurfaceSamples samples = testing::mirror_sphere_samples(image, samples_per_pixel);
  problem.layout = CubePyramidLayout::full(size);
  problem.matrix = build_rendering_matrix(samples, 0, kInfinity, problem.layout, kIsotropic);
  problem.row_weights = testing::random_values(problem.matrix.rows(), 3);
  return problem;
}

Eigen::MatrixXd dense(const RenderingMatrix& matrix) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(matrix.rows()),
                                            static_cast<Eigen::Index>(matrix.columns));
  for (std::size_t r = 0; r < matrix.rows(); ++r) {
    for (std::uint64_t e = matrix.row_offsets[r]; e < matrix.row_offsets[r + 1]; ++e) {
      a(static_cast<Eigen::Index>(r), matrix.texels[e]) = static_cast<double>(matrix.weights[e]);
    }
  }
  return a;
}

// Rows of the regulariser written down from its definition, one per term.
Eigen::MatrixXd dense_regulariser(const CubePyramidLayout& layout, const std::set<std::uint32_t>& seen,
                                  const SolveOptions& options, double scale, double prior_weight) {
  const double smoothness = scale * static_cast<double>(options.smoothness);
  const double agreement = scale * static_cast<double>(options.level_agreement);
  const TexelTopology topology = layout;
  std::vector<Eigen::VectorXd> rows;
  const auto n = static_cast<Eigen::Index>(layout.texels());
  for (int level = 0; level < layout.levels; ++level) {
    const int size = layout.level_size(level);
    for (int face = 0; face < 6; ++face) {
      for (int row = 0; row < size; ++row) {
        for (int column = 0; column < size; ++column) {
          const auto i = static_cast<std::uint32_t>(layout.index(level, face, row, column));
          if (!seen.contains(i)) continue;
          // Each edge is met from both of its ends, so each visit carries half of its square.
          for (const auto& [dr, dc] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
            const std::uint32_t j = topology.texel_at({level, face, row + dr, column + dc});
            if (!seen.contains(j)) continue;
            Eigen::VectorXd v = Eigen::VectorXd::Zero(n);
            v(i) += std::sqrt(0.5 * smoothness);
            v(j) -= std::sqrt(0.5 * smoothness);
            rows.push_back(v);
          }
          std::vector<std::uint32_t> children;
          for (int child = 0; level > 0 && child < 4; ++child) {
            const auto c = static_cast<std::uint32_t>(
                layout.index(level - 1, face, 2 * row + child / 2, 2 * column + child % 2));
            if (seen.contains(c)) children.push_back(c);
          }
          if (!children.empty()) {
            const double count = static_cast<double>(children.size());
            const double w = std::sqrt(agreement * count / 4.0);
            Eigen::VectorXd v = Eigen::VectorXd::Zero(n);
            v(i) = w;
            for (std::uint32_t c : children) v(c) = -w / count;
            rows.push_back(v);
          }
          Eigen::VectorXd v = Eigen::VectorXd::Zero(n);
          v(i) = std::sqrt(scale * prior_weight);
          rows.push_back(v);
        }
      }
    }
  }
  Eigen::MatrixXd g(static_cast<Eigen::Index>(rows.size()), n);
  for (std::size_t r = 0; r < rows.size(); ++r) g.row(static_cast<Eigen::Index>(r)) = rows[r];
  return g;
}

std::vector<float> random_around(float centre, std::size_t count, std::uint64_t seed) {
  std::vector<float> values = testing::random_values(count, seed);
  for (float& value : values) value += centre - 0.5F;
  return values;
}

// The solution of the same problem by dense normal equations in double, for a target bright enough to stay
// within the bounds by itself.
TEST(MapSolver, AgreesWithADenseSolve) {
  const Problem problem = make_problem(24, 4, 8);
  SolveOptions options;
  options.smoothness = 0.02F;
  options.level_agreement = 0.05F;
  options.prior_weight = 0.03F;
  options.tolerance = 1e-7F;
  options.max_iterations = 2000;
  const std::vector<float> target = random_around(5.0F, 3 * problem.matrix.rows(), 7);
  const std::vector<float> prior = random_around(5.0F, 3 * problem.layout.texels(), 8);

  const std::set<std::uint32_t> seen(problem.matrix.texels.begin(), problem.matrix.texels.end());
  ASSERT_LT(seen.size(), problem.layout.texels()) << "the test wants unseen texels too";
  const Eigen::MatrixXd a = dense(problem.matrix);
  const Eigen::VectorXd w =
      Eigen::Map<const Eigen::VectorXf>(problem.row_weights.data(), a.rows()).cast<double>();
  for (const bool with_prior : {false, true}) {
    const MapSolution solution = solve(problem, options, target, 3,
                                       with_prior ? std::span<const float>(prior) : std::span<const float>{});
    const Eigen::VectorXd row_sums = a.rowwise().sum();
    const double scale = (w.array() * row_sums.array().square()).sum() / static_cast<double>(seen.size());
    EXPECT_NEAR(solution.report.row_scale[0], scale, 1e-5 * scale);
    const Eigen::MatrixXd g =
        dense_regulariser(problem.layout, seen, options, scale, with_prior ? 0.03F : 0.0);
    Eigen::MatrixXd normal = a.transpose() * w.asDiagonal() * a + g.transpose() * g;
    for (Eigen::Index i = 0; i < normal.rows(); ++i) {
      if (!seen.contains(static_cast<std::uint32_t>(i))) normal(i, i) = 1.0;
    }
    EXPECT_EQ(solution.report.unknowns, seen.size());
    for (int k = 0; k < 3; ++k) {
      Eigen::VectorXd b(a.rows());
      Eigen::VectorXd base = Eigen::VectorXd::Zero(a.cols());
      for (Eigen::Index r = 0; r < b.size(); ++r)
        b(r) = static_cast<double>(target[static_cast<std::size_t>(3 * r + k)]);
      for (Eigen::Index i = 0; with_prior && i < base.size(); ++i) {
        base(i) = static_cast<double>(prior[static_cast<std::size_t>(3 * i + k)]);
      }
      const Eigen::VectorXd x = base + normal.ldlt().solve(a.transpose() * (w.asDiagonal() * (b - a * base)));
      for (std::uint32_t i : seen) {
        // The gradient is reduced to 1e-7 of its start; the smallest curvature of this problem is about 1e-2.
        EXPECT_NEAR(static_cast<double>(solution.texels[3 * i + static_cast<std::size_t>(k)]),
                    std::max(x(i), 0.0), 2e-4)
            << "prior " << with_prior << ", texel " << i << ", channel " << k;
      }
    }
  }
}

// The conditions of Karush, Kuhn and Tucker: where a texel is inside its bounds the gradient vanishes, where
// it is dark the gradient does not want it brighter.
TEST(MapSolver, IsTheBestMapWithinTheBounds) {
  const Problem problem = make_problem(24, 4, 8);
  SolveOptions options;
  options.smoothness = 0.02F;
  options.level_agreement = 0.05F;
  options.tolerance = 1e-6F;
  options.max_iterations = 20000;
  const std::vector<float> target = random_around(0.1F, problem.matrix.rows(), 7);
  const MapSolution solution = solve(problem, options, target, 1);

  const std::set<std::uint32_t> seen(problem.matrix.texels.begin(), problem.matrix.texels.end());
  const Eigen::MatrixXd a = dense(problem.matrix);
  const Eigen::MatrixXd g =
      dense_regulariser(problem.layout, seen, options, solution.report.row_scale[0], 0.0);
  const Eigen::VectorXd w =
      Eigen::Map<const Eigen::VectorXf>(problem.row_weights.data(), a.rows()).cast<double>();
  const Eigen::VectorXd b = Eigen::Map<const Eigen::VectorXf>(target.data(), a.rows()).cast<double>();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(a.cols());
  for (std::uint32_t i : seen) x(i) = static_cast<double>(solution.texels[i]);
  const Eigen::VectorXd gradient = a.transpose() * (w.asDiagonal() * (a * x - b)) + g.transpose() * (g * x);
  // Of the size of the gradient at x = 0, whose entries reach a few units.
  constexpr double kSmall = 1e-4;
  std::size_t dark = 0;
  for (std::uint32_t i : seen) {
    ASSERT_GE(x(i), 0.0);
    if (x(i) > 0.0) {
      ASSERT_NEAR(gradient(i), 0.0, kSmall) << i;
    } else {
      ASSERT_GT(gradient(i), -kSmall) << i;
      ++dark;
    }
  }
  EXPECT_GT(dark, seen.size() / 20);
  EXPECT_LT(dark, seen.size() / 2);
}

TEST(MapSolver, ReproducesATargetThatAMapCanMake) {
  const Problem problem = make_problem(64, 4, 32);
  SolveOptions options;
  options.smoothness = 1e-7F;
  options.level_agreement = 1e-7F;
  options.tolerance = 1e-6F;
  options.max_iterations = 3000;
  const std::vector<float> truth = testing::random_values(4 * problem.layout.texels(), 1);
  const std::vector<float> target = multiply(problem.matrix, truth, 4);
  const MapSolution solution = solve(problem, options, target, 4);
  // What is left is the pull of the smoothness on a map of white noise; the noise itself is 0.29.
  EXPECT_LT(solution.report.rms_error, 5e-3);
}

// Scaling the light scales the solution: nothing in the solver has a unit. A power of two changes no
// rounding.
TEST(MapSolver, IsLinearOverTenOrdersOfRadiance) {
  const Problem problem = make_problem(32, 4, 16);
  const MapSolver solver = make_solver(problem.matrix, problem.layout);
  const std::vector<float> target = testing::random_values(problem.matrix.rows(), 2);
  const MapSolution unit = solve(solver, problem.row_weights, target, 1);
  for (float scale : {0x1p-14F, 0x1p20F}) {
    std::vector<float> scaled = target;
    for (float& value : scaled) value *= scale;
    const MapSolution solution = solve(solver, problem.row_weights, scaled, 1);
    for (std::size_t i = 0; i < solution.texels.size(); ++i)
      ASSERT_EQ(solution.texels[i], scale * unit.texels[i]);
  }
}

TEST(MapSolver, SolvesATargetThatSpansTenOrdersOfRadiance) {
  const Problem problem = make_problem(32, 4, 16);
  std::vector<float> target = testing::random_values(problem.matrix.rows(), 2);
  for (float& value : target) value = std::pow(10.0F, 10.0F * value - 4.0F);
  const MapSolution solution = solve(problem, {}, target, 1);
  for (float value : solution.texels) ASSERT_TRUE(std::isfinite(value) && value >= 0.0F);
}

TEST(MapSolver, SameBitsOnOneThread) {
  const Problem problem = make_problem(96, 4, 64);
  const std::vector<float> target = testing::random_values(3 * problem.matrix.rows(), 5);
  const MapSolution all = solve(problem, {}, target, 3);
  const ThreadLimit limit(1);
  const MapSolution one = solve(problem, {}, target, 3);
  EXPECT_EQ(all.texels, one.texels);
  EXPECT_EQ(all.report.iterations, one.report.iterations);
}

TEST(MapSolver, SameBitsOnEveryInstructionSet) {
  const Problem problem = make_problem(64, 4, 32);
  for (const int channels : {1, 3, 4}) {
    const std::size_t values = static_cast<std::size_t>(channels) * problem.matrix.rows();
    const std::vector<float> target = testing::random_values(values, 5);
    const auto solved = [&](Isa isa) {
      const IsaLimit limit(isa);
      return solve(problem, {}, target, channels).texels;
    };
    const std::vector<float> expected = solved(Isa::baseline);
    for (const Isa isa : {Isa::sse42, Isa::avx2, Isa::avx512}) {
      EXPECT_EQ(solved(isa), expected) << to_string(isa) << ", " << channels << " channels";
    }
  }
}

TEST(MapSolver, FillsUnseenTexelsBetweenTheSeenOnes) {
  const Problem problem = make_problem(24, 4, 16);
  const std::vector<float> target(problem.matrix.rows(), 0.7F);
  const MapSolution solution = solve(problem, {}, target, 1);
  for (float value : solution.texels) ASSERT_NEAR(value, 0.7F, 1e-5F);
}

TEST(MapSolver, FallsBackToThePriorWhereNothingIsSeen) {
  const Problem problem = make_problem(24, 4, 16);
  const std::vector<float> prior = testing::random_values(problem.layout.texels(), 11);
  const MapSolver solver = make_solver(problem.matrix, problem.layout);
  // A target that the prior explains leaves it as it is, seen or not.
  const MapSolution same = solve(solver, problem.row_weights, multiply(problem.matrix, prior, 1), 1, prior);
  for (std::size_t i = 0; i < prior.size(); ++i) ASSERT_NEAR(same.texels[i], prior[i], 1e-5F);
  // Straight up is seen by this part, the upper half of the sphere; straight down is a quarter circle away
  // from all that it sees. The one follows the target, the other stays near the prior.
  const MapSolution other =
      solve(solver, problem.row_weights, std::vector<float>(problem.matrix.rows(), 5.0F), 1, prior);
  const std::size_t up = problem.layout.index(0, 2, 8, 8);
  const std::size_t down = problem.layout.index(0, 3, 8, 8);
  EXPECT_LT(std::abs(other.texels[up] - 5.0F), 0.3F * (5.0F - prior[up]));
  EXPECT_LT(std::abs(other.texels[down] - prior[down]), 0.3F * (5.0F - prior[down]));
}

TEST(MapSolver, ClampsToRadianceAndCoverage) {
  const Problem problem = make_problem(24, 4, 16);
  const std::vector<float> high(4 * problem.matrix.rows(), 3.0F);
  const std::vector<float> low(4 * problem.matrix.rows(), -3.0F);
  const MapSolver solver = make_solver(problem.matrix, problem.layout);
  const MapSolution above = solve(solver, problem.row_weights, high, 4);
  const MapSolution below = solve(solver, problem.row_weights, low, 4);
  for (std::size_t i = 0; i < above.texels.size(); ++i) {
    ASSERT_NEAR(above.texels[i], i % 4 == 3 ? 1.0F : 3.0F, 1e-4F);
    ASSERT_EQ(below.texels[i], 0.0F);
  }
}

TEST(MapSolver, AnswersWithoutRowsWithoutWeightsAndWithoutARegulariser) {
  RenderingMatrix nothing;
  nothing.columns = CubePyramidLayout::full(4).texels();
  nothing.row_offsets = {0};
  const MapSolution empty = solve(make_solver(nothing, CubePyramidLayout::full(4)), {}, {}, 3);
  EXPECT_EQ(empty.texels, std::vector<float>(3 * nothing.columns, 0.0F));
  EXPECT_EQ(empty.report.unknowns, 0u);

  // Rows that read nothing.
  nothing.row_offsets = {0, 0, 0};
  nothing.row_pixels = {0, 1};
  const std::vector<float> ones(2, 1.0F);
  const MapSolution unread = solve(make_solver(nothing, CubePyramidLayout::full(4)), ones, ones, 1);
  EXPECT_EQ(unread.texels, std::vector<float>(nothing.columns, 0.0F));
  EXPECT_EQ(unread.report.rms_error, 1.0);

  SolveOptions free;
  free.smoothness = free.level_agreement = free.prior_weight = 0.0F;
  const Problem problem = make_problem(16, 1, 16);
  const std::vector<float> target = testing::random_values(problem.matrix.rows(), 4);
  for (float value : solve(problem, free, target, 1).texels) {
    ASSERT_TRUE(std::isfinite(value));
  }
  const std::vector<float> zero_weights(problem.matrix.rows());
  for (float value :
       solve(make_solver(problem.matrix, problem.layout, free), zero_weights, target, 1).texels) {
    ASSERT_EQ(value, 0.0F);
  }
}

TEST(MapSolver, SolvesASinglePixelAndMapsOfOneTexel) {
  SurfaceSamples samples = testing::mirror_sphere_samples(1, 1);
  ASSERT_EQ(samples.size(), 1u);
  for (int size : {1, 2, 64}) {
    const CubePyramidLayout layout = CubePyramidLayout::full(size);
    const RenderingMatrix a = build_rendering_matrix(samples, samples.part[0], kInfinity, layout, kIsotropic);
    ASSERT_EQ(a.rows(), 1u);
    SolveOptions options;
    options.smoothness = options.level_agreement = 1e-6F;
    options.tolerance = 1e-6F;
    const std::vector<float> target{2.5F};
    const std::vector<float> weight{1.0F};
    const MapSolution solution = solve(make_solver(a, layout, options), weight, target, 1);
    EXPECT_NEAR(multiply(a, solution.texels, 1)[0], 2.5F, 1e-3F) << size;
  }
}

TEST(MapSolver, RejectsBadInputWithItsCount) {
  const Problem problem = make_problem(16, 1, 8);
  const MapSolver solver = make_solver(problem.matrix, problem.layout);
  std::vector<float> target(problem.matrix.rows(), 1.0F);
  target[0] = std::numeric_limits<float>::quiet_NaN();
  target[5] = std::numeric_limits<float>::infinity();
  try {
    solve(solver, problem.row_weights, target, 1);
    FAIL() << "accepted NaN";
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("2 values"), std::string::npos) << error.what();
  }
  EXPECT_THROW(solve(solver, problem.row_weights, {}, 1), InvalidArgument);
  EXPECT_THROW(solve(solver, problem.row_weights, std::vector<float>(5 * problem.matrix.rows()), 5),
               InvalidArgument);
  EXPECT_THROW(
      solve(solver, problem.row_weights, std::vector<float>(problem.matrix.rows()), 1, std::vector<float>(3)),
      InvalidArgument);
  EXPECT_THROW(solve(solver, {}, std::vector<float>(problem.matrix.rows()), 1), InvalidArgument);
  EXPECT_THROW(make_solver(problem.matrix, CubePyramidLayout::full(16)), InvalidArgument);
  // Finite, but its square is not.
  target.assign(problem.matrix.rows(), 3e38F);
  EXPECT_THROW(solve(solver, problem.row_weights, target, 1), InvalidArgument);
  SolveOptions negative, endless;
  negative.smoothness = -1.0F;
  endless.tolerance = std::numeric_limits<float>::infinity();
  EXPECT_THROW(make_solver(problem.matrix, problem.layout, negative), InvalidArgument);
  EXPECT_THROW(make_solver(problem.matrix, problem.layout, endless), InvalidArgument);
}

// Views of blends: the blend of the solved nodes shows what each view wants, where one map could not. Between
// the nodes, a view's row is spread over both.
TEST(MapSolver, NodesAreFoundFromViewsOfTheirBlends) {
  const Problem problem = make_problem(48, 4, 16);
  const std::size_t texels = problem.layout.texels();
  const std::vector<float> first = testing::random_values(texels, 21);
  const std::vector<float> second = testing::random_values(texels, 22);
  std::vector<SolverView> views;
  std::vector<std::vector<float>> targets;
  for (float t : {0.0F, 0.3F, 0.6F, 1.0F}) {
    views.push_back({&problem.matrix, {{0, 1.0F - t}, {1, t}}});
    std::vector<float> blend(texels);
    for (std::size_t i = 0; i < texels; ++i) blend[i] = (1.0F - t) * first[i] + t * second[i];
    targets.push_back(multiply(problem.matrix, blend, 1));
  }
  const TexelTopology topology = problem.layout;
  const SolveOptions options{
      .smoothness = 1e-7F, .level_agreement = 1e-7F, .tolerance = 1e-6F, .max_iterations = 3000};
  const MapSolver solver(views, {&topology, 1}, 2, options);
  std::vector<ViewTarget> wanted;
  for (const auto& target : targets) wanted.push_back({target, problem.row_weights});
  const MapSolution solution = solver.solve({.channels = 1, .views = wanted});
  ASSERT_EQ(solution.texels.size(), 2 * texels);
  // As for one map: what is left is the pull of the smoothness on white noise.
  EXPECT_LT(solution.report.rms_error, 5e-3);
  const std::vector<float> shown = multiply(problem.matrix, {solution.texels.data(), texels}, 1);
  for (std::size_t r = 0; r < shown.size(); ++r) ASSERT_NEAR(shown[r], targets[0][r], 0.05F);

  // A view of a node that does not exist.
  const SolverView half{&problem.matrix, {{0, 0.5F}, {1, 0.5F}}};
  EXPECT_THROW(MapSolver({&half, 1}, {&topology, 1}, 1, options), InvalidArgument);
}

// A row that reads more texels than 16 bits count, between rows that read few.
// Which view a row belongs to says nothing of the map where views see the same nodes, even with another
// view between them. Up to rounding: sums are made in another order.
TEST(MapSolver, RowsMayBeDividedAmongViews) {
  const Problem problem = make_problem(48, 4, 16);
  const RenderingMatrix& whole = problem.matrix;
  const std::vector<float> map = testing::random_values(whole.columns, 11);
  const std::vector<float> target = multiply(whole, map, 1);
  std::array<RenderingMatrix, 3> matrices;
  std::array<std::vector<float>, 3> targets, weights;
  for (RenderingMatrix& matrix : matrices) {
    matrix.columns = whole.columns;
    matrix.row_offsets = {0};
  }
  const auto give = [&](std::size_t view, std::size_t r, float wanted) {
    for (std::size_t e = whole.row_offsets[r]; e < whole.row_offsets[r + 1]; ++e) {
      matrices[view].texels.push_back(whole.texels[e]);
      matrices[view].weights.push_back(whole.weights[e]);
    }
    matrices[view].row_offsets.push_back(matrices[view].texels.size());
    matrices[view].row_pixels.push_back(whole.row_pixels[r]);
    targets[view].push_back(wanted);
    weights[view].push_back(problem.row_weights[r]);
  };
  for (std::size_t r = 0; r < whole.rows(); ++r) {
    give(r % 3 == 0 ? 0 : 2, r, target[r]);
    give(1, r, 1.0F);
  }
  const TexelTopology topology = problem.layout;
  const SolveOptions options{.tolerance = 1e-5F, .max_iterations = 5000};
  const std::array<SolverView, 2> undivided{SolverView{&whole, {{0}}}, {&matrices[1], {{1}}}};
  const std::array<ViewTarget, 2> undivided_targets{ViewTarget{target, problem.row_weights},
                                                    {targets[1], weights[1]}};
  const std::array<SolverView, 3> divided{
      SolverView{&matrices[0], {{0}}}, {&matrices[1], {{1}}}, {&matrices[2], {{0}}}};
  const std::array<ViewTarget, 3> divided_targets{
      ViewTarget{targets[0], weights[0]}, {targets[1], weights[1]}, {targets[2], weights[2]}};
  const MapSolution expected =
      MapSolver(undivided, {&topology, 1}, 2, options).solve({.channels = 1, .views = undivided_targets});
  const MapSolution found =
      MapSolver(divided, {&topology, 1}, 2, options).solve({.channels = 1, .views = divided_targets});
  ASSERT_TRUE(expected.report.converged && found.report.converged);
  ASSERT_EQ(found.texels.size(), expected.texels.size());
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < found.texels.size(); ++i) {
    difference += std::pow(static_cast<double>(found.texels[i] - expected.texels[i]), 2);
    norm += std::pow(static_cast<double>(expected.texels[i]), 2);
  }
  EXPECT_LT(std::sqrt(difference / norm), 1e-3);
}

TEST(MapSolver, SolvesRowsOfAHundredThousandTexels) {
  const CubePyramidLayout layout = CubePyramidLayout::full(256);
  RenderingMatrix matrix;
  matrix.columns = layout.texels();
  matrix.row_offsets = {0};
  const auto add_row = [&](std::uint32_t first, std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      matrix.texels.push_back(first + i);
      matrix.weights.push_back(1.0F / static_cast<float>(count));
    }
    matrix.row_offsets.push_back(matrix.texels.size());
    matrix.row_pixels.push_back(static_cast<std::uint32_t>(matrix.row_pixels.size()));
  };
  add_row(0, 3);
  add_row(100, 100000);
  add_row(100098, 5);
  add_row(300000, 2);
  const std::vector<float> target{0.25F, 2.0F, 1.0F, 4.0F};
  const std::vector<float> weights(4, 1.0F);
  const SolveOptions free{.smoothness = 0.0F, .level_agreement = 0.0F, .prior_weight = 0.0F};
  const MapSolution solution = solve(make_solver(matrix, layout, free), weights, target, 1);
  EXPECT_EQ(solution.report.unknowns, 3u + 100003u + 2u);
  const std::vector<float> shown = multiply(matrix, solution.texels, 1);
  // 1e5 terms in float.
  for (std::size_t r = 0; r < shown.size(); ++r) EXPECT_NEAR(shown[r], target[r], 1e-2F * target[r]) << r;
}

// A x of a map of one colour has that colour, so that the sums of the matrix' rows tell all that one step
// needs; with its diagonal as the preconditioner it takes eight. The preconditioner has eight binary digits.
TEST(MapSolver, FindsAMapOfOneColourInOneStep) {
  const Problem problem = make_problem(64, 16, 32);
  const SolveOptions options{
      .smoothness = 0.0F, .level_agreement = 0.0F, .prior_weight = 0.0F, .tolerance = 2e-2F};
  const std::vector<float> target(problem.matrix.rows(), 3.0F), black(problem.layout.texels(), 0.0F);
  const MapSolver solver = make_solver(problem.matrix, problem.layout, options);
  const ViewTarget view{target, problem.row_weights};
  const MapSolution solution = solver.solve({.channels = 1, .views = {&view, 1}, .initial = black});
  EXPECT_TRUE(solution.report.converged);
  EXPECT_EQ(solution.report.iterations, 1);
  for (const float texel : solution.texels) ASSERT_NEAR(texel, 3.0F, 0.03F);
}

TEST(MapSolver, ReportsWhetherItConverged) {
  const Problem problem = make_problem(48, 4, 32);
  const std::vector<float> target = testing::random_values(problem.matrix.rows(), 2);
  EXPECT_TRUE(solve(problem, {.max_iterations = 2000}, target, 1).report.converged);
  const MapSolution hasty = solve(problem, {.max_iterations = 3}, target, 1);
  EXPECT_FALSE(hasty.report.converged);
  EXPECT_EQ(hasty.report.iterations, 3);
  for (float value : hasty.texels) ASSERT_TRUE(std::isfinite(value) && value >= 0.0F);
}

TEST(MapSolver, SlackEndsASolveThatLeadsToAnotherEarlier) {
  const Problem problem = make_problem(48, 4, 32);
  const std::vector<float> target = testing::random_values(problem.matrix.rows(), 2);
  const MapSolver solver = make_solver(problem.matrix, problem.layout, {.max_iterations = 2000});
  const ViewTarget view{target, problem.row_weights};
  const SolveReport whole = solver.solve({.channels = 1, .views = {&view, 1}}).report;
  const SolveReport rough = solver.solve({.channels = 1, .views = {&view, 1}, .slack = 30.0F}).report;
  EXPECT_TRUE(rough.converged);
  EXPECT_LE(rough.relative_gradient, 30.0 * 1e-3);
  EXPECT_LT(rough.iterations, whole.iterations);
  EXPECT_THROW(solver.solve({.channels = 1, .views = {&view, 1}, .slack = 0.5F}), InvalidArgument);
}

TEST(MapSolver, RowWeightsFollowCoverageAndDisplayedBrightness) {
  const Problem problem = make_problem(16, 4, 8);
  const std::vector<float> dark(3 * problem.matrix.rows(), 0.0F);
  const std::vector<float> bright(3 * problem.matrix.rows(), 9.0F);
  const std::vector<float> w0 = display_row_weights(problem.matrix, 4, dark, 3);
  const std::vector<float> w9 = display_row_weights(problem.matrix, 4, bright, 3);
  for (std::size_t r = 0; r < problem.matrix.rows(); ++r) {
    EXPECT_EQ(w0[3 * r], static_cast<float>(problem.matrix.row_samples(r)) / 4.0F);
    EXPECT_EQ(w0[3 * r], w0[3 * r + 2]);
    EXPECT_NEAR(w9[3 * r], w0[3 * r] / 100.0F, 1e-6F);
  }
}

}  // namespace
}  // namespace mirrorbake
