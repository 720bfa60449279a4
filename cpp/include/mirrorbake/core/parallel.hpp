#pragma once

#include <cstddef>
#include <functional>
#include <memory>

/// Threads, kept behind this header so that no other module names the threading library.
///
/// Results never depend on the number of threads: work is cut into chunks whose bounds depend on the
/// problem alone, and reductions add the chunks up in their order.
namespace mirrorbake {

/// While it lives, the library uses at most `threads` threads (0: all cores). Throws InvalidArgument if
/// negative or above 1024. Limits nest: the smallest one holds.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(ThreadLimit&&) noexcept;
  ThreadLimit& operator=(ThreadLimit&&) noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Number of threads that parallel loops use now.
int thread_count();

/// Calls `body(begin, end)` for consecutive chunks of `grain` indices of [0, count), in parallel. `grain` ≥
/// 1. An exception thrown by `body` is rethrown here.
void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t begin, std::size_t end)>& body);

/// Sum over [0, count) of `body(begin, end)` per chunk of `grain`, added up in the order of the chunks.
double parallel_sum(std::size_t count, std::size_t grain,
                    const std::function<double(std::size_t begin, std::size_t end)>& body);

}  // namespace mirrorbake
