#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>

#include <nanobind/nanobind.h>

#include "mirrorbake/core/enum_names.hpp"

/// One of several is a string in Python, whose type is Literal: every enumeration that has names. (A set of
/// several, such as Visibility, is an enum.Flag.)
namespace mirrorbake::bindings {

inline constexpr std::string_view kLiteral = "typing.Literal[";

template <NamedEnum E>
constexpr std::size_t literal_size() {
  std::size_t size = kLiteral.size() + 1;
  for (const std::string_view name : EnumNames<E>::names) size += name.size() + 4;
  return size - 2;  // the first has no comma before it
}

/// typing.Literal['a', 'b'], at compile time.
template <NamedEnum E>
constexpr auto literal() {
  char text[literal_size<E>() + 1] = {};
  std::size_t end = 0;
  const auto add = [&](std::string_view part) {
    for (const char letter : part) text[end++] = letter;
  };
  add(kLiteral);
  for (std::size_t i = 0; i < EnumNames<E>::names.size(); ++i) {
    add(i == 0 ? "'" : ", '");
    add(EnumNames<E>::names[i]);
    add("'");
  }
  add("]");
  return nanobind::detail::descr<literal_size<E>()>(text);
}

}  // namespace mirrorbake::bindings

namespace nanobind::detail {

// As nanobind's for all enumerations, but for the constraint, which makes it the one that is taken.
template <typename E>
requires mirrorbake::NamedEnum<E>
struct type_caster<E, enable_if_t<std::is_enum_v<E>>> {
  static constexpr auto Name = mirrorbake::bindings::literal<E>();
  template <typename T>
  using Cast = E;
  template <typename T>
  static constexpr bool can_cast() {
    return true;
  }

  bool from_python(handle source, uint8_t, cleanup_list*) noexcept {
    Py_ssize_t size = 0;
    const char* text = PyUnicode_AsUTF8AndSize(source.ptr(), &size);
    if (text == nullptr) {
      PyErr_Clear();
      return false;
    }
    name.assign(text, static_cast<std::size_t>(size));
    return true;
  }
  static handle from_cpp(E value, rv_policy, cleanup_list*) noexcept {
    const std::string_view text = mirrorbake::name_of(value);
    return PyUnicode_FromStringAndSize(text.data(), static_cast<Py_ssize_t>(text.size()));
  }
  // Not in from_python, whose failure says no more than that the types do not fit.
  operator E() { return mirrorbake::parse_name<E>(name); }  // NOLINT(google-explicit-constructor)

  std::string name;
};

}  // namespace nanobind::detail
