#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <limits>
#include <new>
#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/image_io.hpp"

/// What the programs have in common: values as JSON, and the exit status.
namespace mirrorbake::tool {

/// Keys stand in the order in which they are set; numbers that are not finite are null.
using Json = nlohmann::ordered_json;

/// A float with the digits that tell it from other floats, not those of its double.
inline double shortest(float value) {
  if (!std::isfinite(value)) return std::numeric_limits<double>::quiet_NaN();
  std::array<char, 64> digits{};
  const char* end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  double result = 0.0;
  std::from_chars(digits.data(), end, result);
  return result;
}

inline Json shortest(std::span<const float> values) {
  Json list = Json::array();
  for (const float value : values) list.push_back(shortest(value));
  return list;
}

/// In one line; bytes of names that are no UTF-8 become U+FFFD.
inline std::string line_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

inline void print(const Json& json) { std::cout << line_of(json); }

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
