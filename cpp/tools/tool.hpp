#pragma once

#include <charconv>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/image_io.hpp"

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

/// Says on stderr what a file could not hold.
inline void warn_of_losses(const char* program, const std::string& path, const SaveReport& report) {
  if (report.clamped_to_half > 0) {
    std::cerr << program << ": warning: " << path << ": " << report.clamped_to_half
              << " values beyond 65504 clamped to float16\n";
  }
  if (report.clipped > 0) {
    std::cerr << program << ": warning: " << path << ": " << report.clipped
              << " values outside of what the format holds clipped\n";
  }
}

/// The program's exit status: what `run` returns (0 done, 2 usage), 2 for an argument with a value that it
/// does not take, 3 for a file that cannot be read, makes no sense or cannot be written, 4 for a computation
/// without an answer; all of them with a message on stderr.
template <typename Run>
int exit_status(const char* program, const Run& run) {
  try {
    const int status = run();
    std::cout.flush();
    if (!std::cout || std::fflush(stdout) != 0) throw FileError("standard output", "cannot be written");
    return status;
  } catch (const InvalidArgument& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 2;
  } catch (const NumericalError& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 4;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "%s: there is not enough memory for this\n", program);
    return 3;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 3;
  }
}

}  // namespace mirrorbake::tool
