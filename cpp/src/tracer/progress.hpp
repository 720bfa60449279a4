#pragma once

#include <cstddef>
#include <functional>
#include <mutex>

#include "mirrorbake/tracer/tracer.hpp"

namespace mirrorbake::tracing {

/// Reports the share of finished work, from one thread at a time.
class ProgressCounter {
 public:
  ProgressCounter(const TraceOptions& options, std::size_t total)
      : report_(options.progress), total_(total) {}
  void step(std::size_t count = 1) {
    if (!report_) return;
    const std::lock_guard lock(mutex_);
    done_ += count;
    report_(static_cast<double>(done_) / static_cast<double>(total_));
  }

 private:
  const std::function<void(double)>& report_;
  std::size_t total_;
  std::size_t done_ = 0;
  std::mutex mutex_;
};

}  // namespace mirrorbake::tracing
