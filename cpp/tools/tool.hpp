#pragma once

#include <charconv>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

#include "mirrorbake/core/error.hpp"

/// What the programs have in common: values as JSON, and the exit status.
namespace mirrorbake::tool {

inline std::string json_string(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      char code[8];
      std::snprintf(code, sizeof code, "\\u%04x", static_cast<unsigned>(static_cast<unsigned char>(c)));
      result += code;
    } else {
      result += c;
    }
  }
  return result + "\"";
}

/// Shortest text that reads back as the same number; JSON has no infinity.
template <typename T>
std::string json_number(T value) {
  if (!std::isfinite(static_cast<double>(value))) return "null";
  char digits[64];
  return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

template <typename T>
std::string json_list(const std::vector<T>& values) {
  std::string result = "[";
  for (std::size_t i = 0; i < values.size(); ++i) result += (i ? ", " : "") + json_number(values[i]);
  return result + "]";
}

/// The program's exit status: what `run` returns (0 done, 2 usage), 3 for input that cannot be read or makes no sense,
/// 4 for a computation without an answer, both with a message on stderr.
template <typename Run>
int exit_status(const char* program, const Run& run) {
  try {
    return run();
  } catch (const NumericalError& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 4;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 3;
  }
}

}  // namespace mirrorbake::tool
