#include "mirrorbake/core/parallel.hpp"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <string>
#include <vector>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/interrupt.hpp"

#ifdef MIRRORBAKE_THREAD_SANITIZER
#include <sanitizer/tsan_interface.h>
#endif

namespace mirrorbake {
namespace {

// The threading library is not built with the thread sanitizer, and this file is not either, lest the
// library's inline functions look like races. The sanitizer has to be told that chunks run after the start of
// their loop and before its end.
void release([[maybe_unused]] char* token) {
#ifdef MIRRORBAKE_THREAD_SANITIZER
  __tsan_release(token);
#endif
}
void acquire([[maybe_unused]] char* token) {
#ifdef MIRRORBAKE_THREAD_SANITIZER
  __tsan_acquire(token);
#endif
}

struct Loop {
  char start = 0;
  char end = 0;
  Loop() { release(&start); }
  ~Loop() { acquire(&end); }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;
};

struct Chunk {
  Loop& loop;
  explicit Chunk(Loop& l) : loop(l) { acquire(&loop.start); }
  ~Chunk() { release(&loop.end); }
  Chunk(const Chunk&) = delete;
  Chunk& operator=(const Chunk&) = delete;
};

constexpr auto kBetweenChecks = std::chrono::milliseconds(20);

std::atomic<InterruptCheck> interrupt_check{nullptr};

/// Ends a chunk of a loop that was stopped elsewhere; the loop drops it for what stopped it.
struct Stopped : std::exception {};

}  // namespace

void set_interrupt_check(InterruptCheck check) { interrupt_check = check; }

void poll_interrupt() {
  const InterruptCheck check = interrupt_check.load(std::memory_order_relaxed);
  if (check == nullptr) return;
  thread_local std::chrono::steady_clock::time_point last;
  const auto now = std::chrono::steady_clock::now();
  if (now - last < kBetweenChecks) return;
  last = now;
  if (tbb::is_current_task_group_canceling()) throw Stopped();
  check();
}

struct ThreadLimit::State {
  explicit State(std::size_t threads) : control(tbb::global_control::max_allowed_parallelism, threads) {}
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads) {
  check_range("threads", threads, 0, 1024, " (0: all cores)");
  if (threads > 0) state_ = std::make_unique<State>(static_cast<std::size_t>(threads));
}
ThreadLimit::~ThreadLimit() = default;
ThreadLimit::ThreadLimit(ThreadLimit&&) noexcept = default;
ThreadLimit& ThreadLimit::operator=(ThreadLimit&&) noexcept = default;

int thread_count() {
  const std::size_t allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return static_cast<int>(std::min(allowed, static_cast<std::size_t>(tbb::info::default_concurrency())));
}

void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t, std::size_t)>& body) {
  grain = std::max<std::size_t>(grain, 1);
  const std::size_t chunks = (count + grain - 1) / grain;
  if (chunks == 0) return;
  poll_interrupt();
  if (chunks == 1) return body(0, count);
  Loop loop;
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t index) {
    const Chunk chunk(loop);
    poll_interrupt();
    body(index * grain, std::min(count, (index + 1) * grain));
  });
}

double parallel_sum(std::size_t count, std::size_t grain,
                    const std::function<double(std::size_t, std::size_t)>& body) {
  grain = std::max<std::size_t>(grain, 1);
  std::vector<double> partial((count + grain - 1) / grain);
  parallel_for(count, grain,
               [&](std::size_t begin, std::size_t end) { partial[begin / grain] = body(begin, end); });
  double sum = 0;
  for (double part : partial) sum += part;
  return sum;
}

}  // namespace mirrorbake
