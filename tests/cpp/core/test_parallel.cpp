#include "mirrorbake/core/parallel.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace {

TEST(Parallel, ForVisitsEveryIndexOnce) {
  for (std::size_t count : {0u, 1u, 7u, 1000u}) {
    std::vector<int> visits(count);
    parallel_for(count, 7, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) ++visits[i];
    });
    EXPECT_EQ(visits, std::vector<int>(count, 1));
  }
}

TEST(Parallel, SumHasTheSameBitsOnAnyNumberOfThreads) {
  const auto sum = [] {
    return parallel_sum(100'000, 64, [](std::size_t begin, std::size_t end) {
      double part = 0;
      for (std::size_t i = begin; i < end; ++i) part += std::sin(static_cast<double>(i));
      return part;
    });
  };
  const double all = sum();
  const ThreadLimit one(1);
  EXPECT_EQ(all, sum());
}

TEST(Parallel, ThreadLimitRejectsNonsense) {
  EXPECT_THROW(ThreadLimit(-1), InvalidArgument);
  EXPECT_THROW(ThreadLimit(5000), InvalidArgument);
}

TEST(Parallel, ForRethrows) {
  EXPECT_THROW(parallel_for(10, 1, [](std::size_t, std::size_t) { throw NumericalError("no"); }),
               NumericalError);
}

}  // namespace
}  // namespace mirrorbake
