#include "mirrorbake/core/error.hpp"

#include <initializer_list>
#include <string>

#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

std::string join(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (std::string_view part : parts) text += part;
  return valid_utf8(text);
}

}  // namespace

InvalidArgument::InvalidArgument(std::string_view argument, std::string_view value, std::string_view expected)
    : Error(join({argument, " is ", value, ", expected ", expected})) {}

FileError::FileError(std::string_view path, std::string_view problem)
    : Error(join({path, ": ", problem})), path_(path) {}

}  // namespace mirrorbake
