#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

/// The names of an enumeration's values, written once, beside the enumeration: programs, errors and Python
/// take them from there.
namespace mirrorbake {

template <std::size_t... N>
constexpr auto enum_names(const char (&... name)[N]) {
  return std::array<std::string_view, sizeof...(N)>{name...};
}

/// Specialised with `what`, which errors call such a value, and `names` in the order of the values.
template <typename E>
struct EnumNames {};

template <typename E>
concept NamedEnum = requires {
  EnumNames<E>::what;
  EnumNames<E>::names;
};

template <NamedEnum E>
constexpr std::string_view name_of(E value) {
  return EnumNames<E>::names[static_cast<std::size_t>(value)];
}

/// All names, for help and for errors.
template <NamedEnum E>
std::string listed_names() {
  constexpr auto& names = EnumNames<E>::names;
  return listed(std::vector<std::string>(names.begin(), names.end()));
}

/// The value of this name. Throws InvalidArgument, which calls it `what` and lists the names.
template <NamedEnum E>
E parse_name(std::string_view text, std::string_view what = EnumNames<E>::what) {
  constexpr auto& names = EnumNames<E>::names;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (text == names[i]) return static_cast<E>(i);
  }
  throw InvalidArgument(what, text, listed_names<E>());
}

}  // namespace mirrorbake
