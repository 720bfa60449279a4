#pragma once

#include <cstddef>

#include <nanobind/nanobind.h>

namespace mirrorbake::bindings {

/// A text of several lines in one, at compile time.
template <std::size_t N>
struct OneLine {
  char text[N];

  consteval OneLine(const char (&lines)[N]) {  // NOLINT(google-explicit-constructor): of a literal
    for (std::size_t i = 0; i < N; ++i) text[i] = lines[i] == '\n' ? ' ' : lines[i];
  }
};

/// A signature that stands in several lines; nanobind::sig takes it in one.
template <OneLine text>
nanobind::sig signature() {
  return nanobind::sig(text.text);
}

}  // namespace mirrorbake::bindings
