#pragma once

#include <cstddef>
#include <cstdint>

/// What libFuzzer calls with its inputs, and the tests with theirs. A FileError is the right answer to
/// garbage; whatever else comes back, a crash, a sanitizer's report or a result that does not validate, is a
/// finding.
int fuzz_load_mesh(const std::uint8_t* data, std::size_t size);
int fuzz_load_scene(const std::uint8_t* data, std::size_t size);
int fuzz_load_envmap(const std::uint8_t* data, std::size_t size);
