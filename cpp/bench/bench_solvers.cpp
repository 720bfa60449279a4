// What Eigen's least squares need for a system that script/bench inference writes, and what memory gives.
//
//   bench_solvers bandwidth   prints {"bytes_per_second"}: a[i] = b[i] + s c[i] over arrays beyond all caches
//   bench_solvers FILE        prints one JSON object per solver: {"solver", "iterations", "setup_s",
//                             "solve_s", "residual"}
//
// FILE: uint64 rows, columns, entries; float64 wanted residual relative to b; uint64 offsets of rows + 1;
// uint32 columns and float32 weights of the entries; float32 b of rows × 3. The columns are scaled to unit
// length, which is the preconditioner that all are given. A solver gets as many steps as it needs for the
// wanted residual in the first channel; then it is timed with all three.

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

namespace {

using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor, int>;
using Square = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;
using Columns = Eigen::MatrixXd;

// Of AᵀA: beyond, its incomplete factor takes longer than everything else.
constexpr Eigen::Index kMostSquareEntries = 150'000'000;
constexpr int kMostSteps = 4000;

// Processor time of this one thread, which other programs disturb less than a clock.
double now() { return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC); }

struct Problem {
  Matrix matrix;
  Columns b;
  double residual = 0.0;
};

template <typename T>
std::vector<T> read(std::istream& file, std::size_t count) {
  std::vector<T> values(count);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(count * sizeof(T)));
  return values;
}

Problem load(const char* path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<std::uint64_t> sizes = read<std::uint64_t>(file, 3);
  Problem problem;
  problem.residual = read<double>(file, 1).front();
  const std::vector<std::uint64_t> offsets = read<std::uint64_t>(file, sizes[0] + 1);
  const std::vector<std::uint32_t> columns = read<std::uint32_t>(file, sizes[2]);
  const std::vector<float> weights = read<float>(file, sizes[2]);
  const std::vector<float> b = read<float>(file, 3 * sizes[0]);
  if (!file) {
    std::fprintf(stderr, "bench_solvers: %s cannot be read\n", path);
    std::exit(3);
  }
  std::vector<double> length(sizes[1]);
  for (std::size_t e = 0; e < columns.size(); ++e) {
    length[columns[e]] += static_cast<double>(weights[e]) * static_cast<double>(weights[e]);
  }
  // Columns without an entry are left out: they would make the factor singular.
  std::vector<int> number(sizes[1], -1);
  int used = 0;
  for (std::size_t c = 0; c < length.size(); ++c) {
    if (length[c] > 0.0) number[c] = used++;
  }
  problem.matrix.resize(static_cast<Eigen::Index>(sizes[0]), used);
  problem.matrix.reserve(static_cast<Eigen::Index>(columns.size()));
  for (std::size_t r = 0; r < sizes[0]; ++r) {
    problem.matrix.startVec(static_cast<Eigen::Index>(r));
    for (std::uint64_t e = offsets[r]; e < offsets[r + 1]; ++e) {
      problem.matrix.insertBack(static_cast<Eigen::Index>(r), number[columns[e]]) =
          static_cast<double>(weights[e]) / std::sqrt(length[columns[e]]);
    }
  }
  problem.matrix.finalize();
  problem.b.resize(static_cast<Eigen::Index>(sizes[0]), 3);
  for (std::size_t i = 0; i < b.size(); ++i) {
    problem.b(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3)) = static_cast<double>(b[i]);
  }
  return problem;
}

double residual_of(const Problem& problem, const Columns& x, Eigen::Index channels) {
  return (problem.matrix * x - problem.b.leftCols(channels)).norm() / problem.b.leftCols(channels).norm();
}

// `solve(right sides, steps)` returns x. Finds the steps, then measures.
template <typename Solve>
void measure(const char* name, const Problem& problem, double setup, const Solve& solve) {
  int steps = 8;
  while (steps < kMostSteps &&
         residual_of(problem, solve(problem.b.leftCols(1), steps), 1) > problem.residual) {
    steps += std::max(steps / 5, 1);
  }
  const double start = now();
  const Columns x = solve(problem.b, steps);
  const double seconds = now() - start;
  std::printf(
      "{\"solver\": \"%s\", \"iterations\": %d, \"setup_s\": %.6g, \"solve_s\": %.6g, \"residual\": %.6g}\n",
      name, steps, setup, seconds, residual_of(problem, x, 3));
  std::fflush(stdout);
}

void least_squares(const Problem& problem) {
  const double start = now();
  Eigen::LeastSquaresConjugateGradient<Matrix> solver;
  solver.compute(problem.matrix);
  solver.setTolerance(0.0);
  const double setup = now() - start;
  measure("LeastSquaresConjugateGradient", problem, setup, [&](const Columns& b, int steps) -> Columns {
    solver.setMaxIterations(steps);
    return solver.solve(b);
  });
}

void normal_equations(const Problem& problem) {
  const double start = now();
  const Square square = Square(problem.matrix.transpose()) * Square(problem.matrix);
  if (square.nonZeros() > kMostSquareEntries) {
    std::fprintf(stderr, "bench_solvers: ICCG is left out, its matrix has %lld entries\n",
                 static_cast<long long>(square.nonZeros()));
    return;
  }
  Eigen::ConjugateGradient<Square, Eigen::Lower | Eigen::Upper, Eigen::IncompleteCholesky<double>> solver;
  // The texels outnumber what the pixels tell apart: AᵀA is singular, and its factor needs a shift.
  solver.preconditioner().setInitialShift(0.05);
  solver.compute(square);
  solver.setTolerance(0.0);
  const double setup = now() - start;
  if (solver.info() != Eigen::Success) {
    std::fprintf(stderr, "bench_solvers: ICCG is left out, its factor cannot be made\n");
    return;
  }
  measure("ICCG on the normal equations", problem, setup, [&](const Columns& b, int steps) -> Columns {
    solver.setMaxIterations(steps);
    return solver.solve(problem.matrix.transpose() * b);
  });
}

// The best of some runs.
void bandwidth() {
  constexpr std::size_t kCount = std::size_t{1} << 25;
  std::vector<float> a(kCount), b(kCount, 1.0F), c(kCount, 2.0F);
  double best = 1e9;
  for (int run = 0; run < 12; ++run) {
    const double start = now();
    for (std::size_t i = 0; i < kCount; ++i) a[i] = b[i] + 3.0F * c[i];
    best = std::min(best, now() - start);
  }
  std::printf("{\"bytes_per_second\": %.6g}\n", 3.0 * sizeof(float) * static_cast<double>(kCount) / best);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "bench_solvers: expected bandwidth or a file\n");
    return 2;
  }
  if (std::string(argv[1]) == "bandwidth") {
    bandwidth();
    return 0;
  }
  const Problem problem = load(argv[1]);
  least_squares(problem);
  normal_equations(problem);
  return 0;
}
