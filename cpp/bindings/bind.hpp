#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

/// What the binding files share: array types and conversions. No algorithms live here.
namespace mirrorbake::bindings {

namespace nb = nanobind;

/// C-contiguous read-only input on the CPU; nanobind converts what differs.
using FloatArray = nb::ndarray<const float, nb::c_contig, nb::device::cpu>;
using FloatMatrix = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using FloatImage = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using ByteArray = nb::ndarray<const std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using PointArray = nb::ndarray<const float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using UvArray = nb::ndarray<const float, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using TriangleArray = nb::ndarray<const std::uint32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

/// Views into an array's memory.
inline std::span<const glm::vec3> points(const PointArray& array) {
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
  return {reinterpret_cast<const glm::vec3*>(array.data()), array.shape(0)};
}
inline std::span<const glm::vec2> pairs(const UvArray& array) {
  return {reinterpret_cast<const glm::vec2*>(array.data()), array.shape(0)};
}
inline std::span<const glm::uvec3> indices(const TriangleArray& array) {
  return {reinterpret_cast<const glm::uvec3*>(array.data()), array.shape(0)};
}

/// A NumPy array that owns the vector's memory.
template <typename T>
nb::ndarray<nb::numpy, T> to_numpy(std::vector<T>&& values, std::initializer_list<std::size_t> shape) {
  auto* owner = new std::vector<T>(std::move(values));
  nb::capsule deleter(owner, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::ndarray<nb::numpy, T>(owner->data(), shape.size(), shape.begin(), deleter);
}

/// The same for a vector of GLM vectors, as an array of shape (n, V::length()).
template <typename V>
nb::ndarray<nb::numpy, typename V::value_type> vectors_to_numpy(std::vector<V>&& values) {
  auto* owner = new std::vector<V>(std::move(values));
  nb::capsule deleter(owner, [](void* p) noexcept { delete static_cast<std::vector<V>*>(p); });
  const std::size_t shape[2] = {owner->size(), static_cast<std::size_t>(V::length())};
  return nb::ndarray<nb::numpy, typename V::value_type>(owner->data(), 2, shape, deleter);
}

/// Reference view of `values`, kept alive by the Python object `owner`.
template <typename V>
nb::ndarray<nb::numpy, const typename V::value_type> vectors_view(const std::vector<V>& values,
                                                                  nb::handle owner) {
  const std::size_t shape[2] = {values.size(), static_cast<std::size_t>(V::length())};
  return nb::ndarray<nb::numpy, const typename V::value_type>(values.data(), 2, shape, owner);
}

template <typename T>
nb::ndarray<nb::numpy, const T> scalars_view(const std::vector<T>& values, nb::handle owner) {
  const std::size_t shape[1] = {values.size()};
  return nb::ndarray<nb::numpy, const T>(values.data(), 1, shape, owner);
}

/// A str or os.PathLike, in UTF-8; names that are not come as they are in the file system.
struct PathText {
  std::string text;
};

/// Gives a class a repr that shows these attributes: Name(a=1, b='x').
template <typename T, typename... Extra>
void show(nb::class_<T, Extra...>& type, std::vector<const char*> attributes) {
  type.def("__repr__", [attributes = std::move(attributes)](nb::handle self) {
    std::string text = nb::cast<std::string>(self.type().attr("__name__")) + "(";
    for (const char* attribute : attributes) {
      if (attribute != attributes.front()) text += ", ";
      text += std::string(attribute) + "=" + nb::cast<std::string>(nb::repr(self.attr(attribute)));
    }
    return nb::str((text + ")").c_str());
  });
}

/// A constructor that sets attributes by keyword; `signature` is what type checkers see.
template <typename T, typename... Extra>
void keyword_init(nb::class_<T, Extra...>& type, const std::string& signature) {
  type.def(
      "__init__",
      [](nb::pointer_and_handle<T> self, const nb::kwargs& values) {
        new (self.p) T();
        nb::inst_mark_ready(self.h);
        for (auto [attribute, value] : values) {
          if (!nb::hasattr(self.h, attribute)) {
            throw nb::type_error(
                ("unexpected keyword argument '" + nb::cast<std::string>(attribute) + "'").c_str());
          }
          nb::setattr(self.h, attribute, value);
        }
      },
      nb::sig(signature.c_str()));
}

/// Lets a struct of plain values be pickled and copied: `attributes` are all that it has, each of which can
/// be set, and its default value is a valid one.
template <typename T, typename... Extra>
void pickle(nb::class_<T, Extra...>& type, std::vector<const char*> attributes) {
  type.def("__getstate__",
           [attributes](nb::handle self) {
             nb::dict state;
             for (const char* attribute : attributes) state[attribute] = self.attr(attribute);
             return state;
           })
      .def("__setstate__", [](nb::handle self, const nb::dict& state) {
        new (nb::inst_ptr<T>(self)) T();
        nb::inst_mark_ready(self);
        for (auto [attribute, value] : state) nb::setattr(self, attribute, value);
      });
}

/// The same, with a repr.
template <typename T, typename... Extra>
void record(nb::class_<T, Extra...>& type, std::vector<const char*> attributes) {
  show(type, attributes);
  pickle(type, std::move(attributes));
}

}  // namespace mirrorbake::bindings

// A glm::vec2 or glm::vec3 is any sequence of two or three numbers in Python and comes back as a tuple.
namespace nanobind::detail {

template <>
struct type_caster<mirrorbake::bindings::PathText> {
  NB_TYPE_CASTER(mirrorbake::bindings::PathText, const_name("str | os.PathLike[str]"))

  bool from_python(handle source, uint8_t, cleanup_list*) noexcept {
    const object path = steal(PyOS_FSPath(source.ptr()));
    const object bytes = path.is_valid() && PyUnicode_Check(path.ptr())
                             ? steal(PyUnicode_AsEncodedString(path.ptr(), "utf-8", "surrogateescape"))
                             : object();
    if (!bytes.is_valid()) {
      PyErr_Clear();
      return false;
    }
    value.text.assign(PyBytes_AsString(bytes.ptr()), static_cast<std::size_t>(PyBytes_Size(bytes.ptr())));
    return true;
  }
};

template <>
struct type_caster<glm::vec2> {
  NB_TYPE_CASTER(glm::vec2, const_name("collections.abc.Sequence[float]"))

  bool from_python(handle source, uint8_t, cleanup_list*) noexcept {
    try {
      if (len(source) != 2) return false;
      for (int i = 0; i < 2; ++i) value[i] = cast<float>(float_(source[i]));
      return true;
    } catch (...) {
      PyErr_Clear();
      return false;
    }
  }
  static handle from_cpp(glm::vec2 v, rv_policy, cleanup_list*) noexcept {
    return make_tuple(v.x, v.y).release();
  }
};

template <>
struct type_caster<glm::vec3> {
  NB_TYPE_CASTER(glm::vec3, const_name("collections.abc.Sequence[float]"))

  bool from_python(handle source, uint8_t, cleanup_list*) noexcept {
    try {
      if (len(source) != 3) return false;
      for (int i = 0; i < 3; ++i) value[i] = cast<float>(float_(source[i]));
      return true;
    } catch (...) {
      PyErr_Clear();
      return false;
    }
  }
  static handle from_cpp(glm::vec3 v, rv_policy, cleanup_list*) noexcept {
    return make_tuple(v.x, v.y, v.z).release();
  }
};

}  // namespace nanobind::detail
