#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <nanobind/nanobind.h>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/envmap/conventions.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/envmap/mipmap.hpp"
#include "mirrorbake/envmap/reads.hpp"
#include "mirrorbake/envmap/resample.hpp"
#include "mirrorbake/envmap/sampling.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/image/texture_file.hpp"
#include "mirrorbake/prefilter/background.hpp"
#include "mirrorbake/prefilter/convolve.hpp"
#include "mirrorbake/prefilter/harmonics.hpp"
#include "mirrorbake/prefilter/lobe.hpp"
#include "mirrorbake/scene/load.hpp"
#include "mirrorbake/scene/scene.hpp"
#include "mirrorbake/shading/fresnel.hpp"
#include "mirrorbake/shading/metals.hpp"
#include "mirrorbake/tracer/tracer.hpp"

/// One of several is a string in Python, whose type is Literal; here are the names. (A set of several, such
/// as Visibility, is an enum.Flag.)
namespace mirrorbake::bindings {

template <std::size_t... N>
constexpr auto names(const char (&... name)[N]) {
  return std::array<const char*, sizeof...(N)>{name...};
}

template <std::size_t... N>
constexpr auto literal(const char (&... name)[N]) {
  using nanobind::detail::const_name;
  return const_name("typing.Literal[") +
         nanobind::detail::concat((const_name("'") + const_name(name) + const_name("'"))...) +
         const_name("]");
}

/// What errors call the value, and the names of all values in their order.
template <typename E>
struct EnumNames {};

/// Throws InvalidArgument, which lists the names.
template <typename E>
E enum_value(const std::string& name) {
  constexpr auto all = EnumNames<E>::all;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (name == all[i]) return static_cast<E>(i);
  }
  throw InvalidArgument(EnumNames<E>::what, name, listed(std::vector<std::string>(all.begin(), all.end())));
}

}  // namespace mirrorbake::bindings

namespace nanobind::detail {

template <typename E>
struct NamedEnumCaster {
  static constexpr auto Name = mirrorbake::bindings::EnumNames<E>::python_type;
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
    return PyUnicode_FromString(mirrorbake::bindings::EnumNames<E>::all[static_cast<std::size_t>(value)]);
  }
  // Not in from_python, whose failure says no more than that the types do not fit.
  operator E() { return mirrorbake::bindings::enum_value<E>(name); }  // NOLINT(google-explicit-constructor)

  std::string name;
};

}  // namespace nanobind::detail

// A macro, as the names are needed twice at compile time: apart, and as the text of a type.
#define MIRRORBAKE_NAME_ENUM(type, word, ...)                 \
  template <>                                                 \
  struct mirrorbake::bindings::EnumNames<mirrorbake::type> {  \
    static constexpr const char* what = word;                 \
    static constexpr auto all = names(__VA_ARGS__);           \
    static constexpr auto python_type = literal(__VA_ARGS__); \
  };                                                          \
  template <>                                                 \
  struct nanobind::detail::type_caster<mirrorbake::type>      \
      : nanobind::detail::NamedEnumCaster<mirrorbake::type> {}

MIRRORBAKE_NAME_ENUM(ConventionWay, "way", "from_foreign", "to_foreign");
MIRRORBAKE_NAME_ENUM(FaceLayout, "faces", "automatic", "strip", "column", "grid", "cross", "vertical_cross",
                     "files");
MIRRORBAKE_NAME_ENUM(FileContent, "content", "mesh", "scene");
MIRRORBAKE_NAME_ENUM(FresnelModel, "model", "constant", "schlick", "dielectric", "conductor");
MIRRORBAKE_NAME_ENUM(HarmonicWindow, "window", "none", "hanning", "sloan");
MIRRORBAKE_NAME_ENUM(Illuminant, "illuminant", "D65", "E");
MIRRORBAKE_NAME_ENUM(IndirectLight, "indirect", "none", "cached", "path");
MIRRORBAKE_NAME_ENUM(LayerModel, "layers", "additive", "coated");
MIRRORBAKE_NAME_ENUM(Lens, "lens", "perspective", "fisheye");
MIRRORBAKE_NAME_ENUM(LobeKind, "kind", "lambert", "phong", "ggx", "table");
MIRRORBAKE_NAME_ENUM(LobeScale, "scale", "mean", "sum");
MIRRORBAKE_NAME_ENUM(LookupFilter, "filter", "nearest", "bilinear", "trilinear", "anisotropic");
MIRRORBAKE_NAME_ENUM(MipFilter, "filter", "box", "solid_angle", "seamless");
MIRRORBAKE_NAME_ENUM(NegativeLight, "negative", "clamp", "keep");
MIRRORBAKE_NAME_ENUM(PixelFormat, "format", "automatic", "half", "float32", "uint8", "uint16");
MIRRORBAKE_NAME_ENUM(ResampleFilter, "filter", "automatic", "area", "bilinear", "nearest");
MIRRORBAKE_NAME_ENUM(RoughnessScale, "roughness", "squared", "linear");
MIRRORBAKE_NAME_ENUM(SampleFilter, "filter", "nearest", "bilinear", "trilinear", "ewa");
MIRRORBAKE_NAME_ENUM(SpecularLobe, "lobe", "mirror", "ggx", "phong");
MIRRORBAKE_NAME_ENUM(SurfaceSide, "side", "front", "back");
MIRRORBAKE_NAME_ENUM(TextureWrap, "wrap", "repeat", "clamp", "mirror");
MIRRORBAKE_NAME_ENUM(Transfer, "transfer", "automatic", "srgb", "linear");

#undef MIRRORBAKE_NAME_ENUM
