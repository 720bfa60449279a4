#include "mirrorbake/core/isa.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <string>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace {

constexpr std::array<std::string_view, 4> kNames = {"baseline", "sse42", "avx2", "avx512"};

Isa detect() {
#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))
  // These look at the operating system's state saving (XGETBV) too.
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
    return Isa::avx512;
  }
  if (__builtin_cpu_supports("avx2")) return Isa::avx2;
  if (__builtin_cpu_supports("sse4.2")) return Isa::sse42;
#endif
  return Isa::baseline;
}

std::atomic<Isa> active_limit{Isa::avx512};

}  // namespace

std::string_view to_string(Isa isa) { return kNames.at(static_cast<std::size_t>(isa)); }

Isa parse_isa(std::string_view name) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) throw InvalidArgument("isa", name, "baseline, sse42, avx2 or avx512");
  return static_cast<Isa>(found - kNames.begin());
}

Isa best_isa() {
  static const Isa best = detect();
  return best;
}

Isa active_isa() { return std::min(best_isa(), active_limit.load(std::memory_order_relaxed)); }

IsaLimit::IsaLimit(Isa isa) : previous_(active_limit.load()) { active_limit.store(std::min(previous_, isa)); }

IsaLimit::~IsaLimit() { active_limit.store(previous_); }

}  // namespace mirrorbake
