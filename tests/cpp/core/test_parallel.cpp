#include "mirrorbake/core/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/interrupt.hpp"

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

std::thread::id waiting;  // whose loops `stop` leaves

void stop() {
  if (std::this_thread::get_id() == waiting) throw NumericalError("stopped");
}

/// Sets a check for a test.
struct Check {
  Check() {
    waiting = std::this_thread::get_id();
    set_interrupt_check(&stop);
  }
  ~Check() { set_interrupt_check(nullptr); }
  Check(const Check&) = delete;
  Check& operator=(const Check&) = delete;
};

TEST(Parallel, ACheckLeavesALoopBetweenItsChunks) {
  const Check check;
  std::atomic<int> chunks = 0;
  const auto body = [&](std::size_t, std::size_t) {
    ++chunks;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  EXPECT_THROW(parallel_for(1'000'000, 1, body), NumericalError);
  EXPECT_LT(chunks, 10'000);
}

TEST(Parallel, ACheckLeavesLongChunksOnAllThreads) {
  const Check check;
  // Each ends by being stopped alone.
  const auto body = [](std::size_t, std::size_t) {
    for (;;) {
      poll_interrupt();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  EXPECT_THROW(parallel_for(8, 1, body), NumericalError);
}

TEST(Parallel, WithoutACheckNothingIsAsked) {
  poll_interrupt();
  int calls = 0;
  parallel_for(1, 1, [&](std::size_t, std::size_t) { ++calls; });
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace mirrorbake
