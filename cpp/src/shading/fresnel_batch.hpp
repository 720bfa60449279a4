#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "fresnel_kernels.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

/// What the functions of arrays share: checks, and chunks on several threads.
namespace mirrorbake {

// From here on the output is written past the caches: a store to memory that is in none of them reads it
// first. The price is that whoever reads the result at once finds it in memory (docs/adr/0020 has the
// figures).
constexpr std::size_t kLargeBytes = std::size_t{1} << 22;

// Elements per task: some microseconds of work, against about one to hand it out. Tasks that write past the
// caches end with a wait until that is done, so they are longer.
constexpr std::size_t kFresnelGrain = std::size_t{1} << 14;
constexpr std::size_t kLargeFresnelGrain = std::size_t{1} << 17;

template <typename T>
void check_input(std::string_view name, std::span<const T> input, std::span<T> f) {
  if (input.size() != f.size()) {
    throw InvalidArgument(name, std::to_string(input.size()) + " elements",
                          "as many as the output: " + std::to_string(f.size()));
  }
  const auto in = reinterpret_cast<std::uintptr_t>(input.data());
  const auto out = reinterpret_cast<std::uintptr_t>(f.data());
  const std::size_t bytes = input.size_bytes();
  if (bytes != 0 && in < out + bytes && out < in + bytes) {
    throw InvalidArgument("f", "an array that overlaps an input", "separate memory");
  }
}

/// Calls `kernel(batch, first element)` for each task's part of the arrays.
template <typename T, typename Kernel>
void for_batches(std::span<const T> c, std::span<T> f, Kernel kernel) {
  check_input("c", c, f);
  const bool is_large = f.size_bytes() >= kLargeBytes;
  parallel_for(c.size(), is_large ? kLargeFresnelGrain : kFresnelGrain,
               [&](std::size_t begin, std::size_t end) {
                 kernel(FresnelBatch<T>{c.data() + begin, f.data() + begin, end - begin, is_large}, begin);
               });
}

/// Runs `kernel(batch, parameters…)` over chunks; every parameter is one value for the whole array.
template <typename T, typename Kernel, typename... Parameters>
void map_cosines(std::span<const T> c, std::span<T> f, Kernel kernel, Parameters... parameters) {
  for_batches(c, f, [&](const FresnelBatch<T>& batch, std::size_t) { kernel(batch, parameters...); });
}

/// The same with parameters that are arrays too.
template <typename T, typename Kernel, typename... Parameters>
void map_cosines_each(std::span<const T> c, std::span<T> f, Kernel kernel, Parameters... parameters) {
  for_batches(c, f, [&](const FresnelBatch<T>& batch, std::size_t begin) {
    kernel(batch, (parameters.data() + begin)...);
  });
}

}  // namespace mirrorbake
