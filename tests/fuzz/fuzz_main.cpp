#include "fuzz_targets.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return MIRRORBAKE_FUZZ_ENTRY(data, size);
}
