#pragma once

#include <string_view>

/// Instruction sets. One binary carries its hot loops several times over, compiled for each level below, and
/// picks the best one that the processor has. Every level gives the same bits: the loops use no fused
/// multiply-add, no approximate reciprocal and no reordering (docs/adr/0020).
namespace mirrorbake {

/// In rising order; `baseline` is whatever the compiler targets by default (SSE2 on x86-64, NEON on ARM64).
enum class Isa { baseline, sse42, avx2, avx512 };

/// "baseline", "sse42", "avx2" or "avx512" (F, BW, DQ and VL).
std::string_view to_string(Isa isa);

/// The level of that name. Throws InvalidArgument for any other.
Isa parse_isa(std::string_view name);

/// Best level that this processor and operating system can run.
Isa best_isa();

/// Level in use now: best_isa(), or less under an IsaLimit.
Isa active_isa();

/// While it lives, the whole process uses at most `isa`: to test and to time one level against another.
/// Objects must be destroyed in the reverse order of their construction.
class IsaLimit {
 public:
  explicit IsaLimit(Isa isa);
  ~IsaLimit();
  IsaLimit(const IsaLimit&) = delete;
  IsaLimit& operator=(const IsaLimit&) = delete;

 private:
  Isa previous_;
};

}  // namespace mirrorbake
