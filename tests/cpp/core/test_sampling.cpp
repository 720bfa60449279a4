#include "mirrorbake/core/sampling.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace mirrorbake {
namespace {

// A (0,2)-sequence: the first 2^k points put exactly one point into every elementary interval of area 2^−k.
TEST(Sampling, Sobol2dFillsEveryElementaryInterval) {
  for (std::uint64_t sequence : {0u, 1u, 77u}) {
    for (int k = 0; k <= 8; ++k) {
      for (int a = 0; a <= k; ++a) {
        std::set<std::pair<int, int>> cells;
        for (std::uint32_t i = 0; i < (1u << k); ++i) {
          const glm::vec2 p = sobol_2d(i, sequence);
          cells.emplace(static_cast<int>(std::ldexp(p.x, a)), static_cast<int>(std::ldexp(p.y, k - a)));
        }
        EXPECT_EQ(cells.size(), std::size_t{1} << k) << "k " << k << ", a " << a;
      }
    }
  }
}

TEST(Sampling, SequencesAreIndependent) {
  // Correlation of two independent uniform variables over n pairs has a standard deviation of 1/√n.
  constexpr int kCount = 4096;
  double sum = 0;
  for (std::uint64_t s = 0; s < kCount; ++s) {
    sum += (sobol_2d(0, s).x - 0.5) * (sobol_2d(0, s + 1).x - 0.5);
  }
  EXPECT_LT(std::abs(sum / kCount * 12.0), 5.0 / std::sqrt(kCount));
}

}  // namespace
}  // namespace mirrorbake
