#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <variant>
#include <vector>
#include <glm/matrix.hpp>

#include "bind.hpp"
#include "bind_proxy.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/proxy/proxy.hpp"

namespace mirrorbake::bindings {
namespace {

using Axes = nb::ndarray<const float, nb::shape<3, 3>, nb::c_contig, nb::device::cpu>;

/// Rows of the array are the proxy's axes in world space, which makes it proxy_from_world; GLM stores
/// columns.
glm::mat3 axes_matrix(const std::optional<Axes>& axes) {
  glm::mat3 matrix(1.0F);
  if (axes) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        matrix[column][row] = (*axes)(static_cast<std::size_t>(row), static_cast<std::size_t>(column));
      }
    }
  }
  return matrix;
}

[[noreturn]] void throw_missing(const Proxy& proxy, const char* field) {
  // AttributeError, so that hasattr() tells.
  const std::string text = std::string("a proxy of kind '") + shape_name(proxy) + "' has no " + field;
  throw nb::attribute_error(text.c_str());
}

/// A member that all shapes but the infinite one have.
template <typename Get>
auto placed_field(const Proxy& proxy, const char* field, Get get) {
  using Value = decltype(get(Box{}));
  return std::visit(
      [&]<typename Shape>(const Shape& shape) -> Value {
        if constexpr (PlacedShape<Shape>) return get(shape);
        throw_missing(proxy, field);
      },
      proxy.shape);
}

template <typename Value>
Value extent_field(const Proxy& proxy, std::string_view name) {
  std::optional<Value> found;
  std::visit(
      [&]<typename Shape>(const Shape& shape) {
        const auto look_at = [&]<typename Own>(const ShapeExtent<Shape, Own>& extent) {
          if constexpr (std::is_same_v<Own, Value>) {
            if (name == extent.name) found = shape.*(extent.member);
          }
        };
        std::apply([&](const auto&... extent) { (look_at(extent), ...); }, ShapeTraits<Shape>::extents);
      },
      proxy.shape);
  if (!found) throw_missing(proxy, std::string(name).c_str());
  return *found;
}

/// What tells a shape besides the map's origin.
template <typename Shape>
std::vector<std::string> fields_of() {
  if constexpr (!PlacedShape<Shape>) return {};
  std::vector<std::string> names = {"centre"};
  std::apply([&](const auto&... extent) { (names.emplace_back(extent.name), ...); },
             ShapeTraits<Shape>::extents);
  names.emplace_back("axes");
  return names;
}

/// Calls function.operator()<Shape>() for every shape.
template <typename Function>
void for_each_shape(const Function& function) {
  [&]<typename... Shape>(const std::variant<Shape...>&) {
    (function.template operator()<Shape>(), ...);
  }(Proxy{}.shape);
}

template <typename Real>
using RayArray = nb::ndarray<const Real, nb::c_contig, nb::device::cpu>;

/// Two arrays of one shape (..., 3).
template <typename Real>
void check_rays(const RayArray<Real>& positions, const char* second, const RayArray<Real>& directions) {
  const auto shape_text = [](const RayArray<Real>& array) {
    std::string text = "(";
    for (std::size_t i = 0; i < array.ndim(); ++i)
      text += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
    return text + ")";
  };
  const auto check = [&](const char* name, const RayArray<Real>& array) {
    if (array.ndim() == 0 || array.shape(array.ndim() - 1) != 3) {
      throw InvalidArgument(name, "of shape " + shape_text(array), "shape (..., 3)");
    }
  };
  check("positions", positions);
  check(second, directions);
  bool same = positions.ndim() == directions.ndim();
  for (std::size_t i = 0; same && i < positions.ndim(); ++i) same = positions.shape(i) == directions.shape(i);
  if (!same) throw InvalidArgument(second, "of shape " + shape_text(directions), "the shape of positions");
}

/// Calls `compute(first, second, results)` on arrays of xyz triples and returns the results in their shape,
/// or with the number of `layers`, if any, before it.
template <typename Real, typename Compute>
nb::ndarray<nb::numpy, Real> map_triples(const RayArray<Real>& first, const RayArray<Real>& second,
                                         std::optional<std::size_t> layers, Compute compute) {
  using Vector = glm::vec<3, Real>;
  const std::size_t count = first.size() / 3;
  const std::size_t results_count = layers.value_or(1) * count;
  auto* results = new Real[3 * results_count];  // not initialised: all of it is written below, or thrown away
  nb::capsule owner(results, [](void* p) noexcept { delete[] static_cast<Real*>(p); });
  {
    nb::gil_scoped_release release;
    compute(std::span(reinterpret_cast<const Vector*>(first.data()), count),
            std::span(reinterpret_cast<const Vector*>(second.data()), count),
            std::span(reinterpret_cast<Vector*>(results), results_count));
  }
  std::vector<std::size_t> shape;
  if (layers) shape.push_back(*layers);
  for (std::size_t i = 0; i < first.ndim(); ++i) shape.push_back(first.shape(i));
  return nb::ndarray<nb::numpy, Real>(results, shape.size(), shape.data(), owner);
}

template <typename Real>
nb::ndarray<nb::numpy, Real> lookup(const Proxy& proxy, const RayArray<Real>& positions,
                                    const RayArray<Real>& directions) {
  check_rays(positions, "directions", directions);
  return map_triples(positions, directions, std::nullopt,
                     [&](auto p, auto d, auto lookups) { lookup_directions(proxy, p, d, lookups); });
}

nb::ndarray<nb::numpy, float> mirror_lookup(const Proxy& proxy, glm::vec3 eye,
                                            const RayArray<float>& positions,
                                            const RayArray<float>& normals) {
  check_rays(positions, "normals", normals);
  return map_triples(positions, normals, std::nullopt, [&](auto p, auto n, auto lookups) {
    mirror_lookups(std::span(&proxy, 1), eye, p, n, lookups);
  });
}

nb::ndarray<nb::numpy, float> mirror_lookups_of_layers(const std::vector<Proxy>& proxies, glm::vec3 eye,
                                                       const RayArray<float>& positions,
                                                       const RayArray<float>& normals) {
  check_rays(positions, "normals", normals);
  return map_triples(positions, normals, proxies.size(),
                     [&](auto p, auto n, auto lookups) { mirror_lookups(proxies, eye, p, n, lookups); });
}

/// What a proxy consists of, for pickles: kind, origin, centre, extents and axes.
nb::tuple proxy_state(const Proxy& proxy) {
  glm::vec3 centre(0.0F);
  glm::mat3 axes(1.0F);
  std::visit(
      [&]<typename Shape>(const Shape& shape) {
        if constexpr (PlacedShape<Shape>) {
          centre = shape.centre;
          axes = shape.proxy_from_world;
        }
      },
      proxy.shape);
  return nb::make_tuple(shape_name(proxy), proxy.origin, centre, extents_of(proxy),
                        std::vector<float>(&axes[0][0], &axes[0][0] + 9));
}

Proxy proxy_from_state(const std::string& kind, glm::vec3 origin, glm::vec3 centre,
                       const std::vector<float>& extents, const std::vector<float>& proxy_from_world) {
  if (proxy_from_world.size() != 9) throw InvalidArgument("state", "of other axes", "9 numbers");
  glm::mat3 matrix;
  std::copy(proxy_from_world.begin(), proxy_from_world.end(), &matrix[0][0]);
  std::optional<Proxy> proxy = proxy_from_numbers(kind, centre, extents, matrix);
  if (!proxy) throw InvalidArgument("state", "of kind " + kind, "what __getstate__ returned");
  proxy->origin = origin;
  validate(*proxy);
  return *proxy;
}

void bind_attributes(nb::class_<Proxy>& proxy) {
  proxy.def_prop_ro("kind", &shape_name, "Name of the shape, which is that of its constructor.")
      .def_ro("origin", &Proxy::origin, "Origin of the map: lookups are directions seen from here.")
      .def_prop_ro(
          "centre",
          [](const Proxy& p) {
            return placed_field(p, "centre", [](const auto& shape) { return shape.centre; });
          },
          "Centre of the shape (of its floor, for the hemisphere). AttributeError if it is infinite.")
      .def_prop_ro(
          "axes",
          [](const Proxy& p) {
            const glm::mat3 rows = glm::transpose(
                placed_field(p, "axes", [](const auto& shape) { return shape.proxy_from_world; }));
            return to_numpy(std::vector<float>(&rows[0][0], &rows[0][0] + 9), {3, 3});
          },
          nb::rv_policy::move,
          "The shape's own axes in world space, one per row. AttributeError if it is infinite.");
  for_each_shape([&]<typename Shape>() {
    const auto bind = [&]<typename Value>(const ShapeExtent<Shape, Value>& extent) {
      const std::string doc = std::string(extent.meaning) + " AttributeError for other kinds.";
      proxy.def_prop_ro(
          extent.name, [name = extent.name](const Proxy& p) { return extent_field<Value>(p, name); },
          doc.c_str());
    };
    std::apply([&](const auto&... extent) { (bind(extent), ...); }, ShapeTraits<Shape>::extents);
  });
}

void bind_lookups(nb::class_<Proxy>& proxy) {
  proxy
      .def("lookup", &lookup<float>, nb::arg("positions"), nb::arg("directions"),
           R"(Directions in which the map is read by rays.

From the map's origin to where each ray leaves the shape, not normalised; `directions` itself for the infinite shape.
Positions outside and rays that miss get a continuous answer, never NaN.

Parameters
----------
positions, directions
    (..., 3), of one shape, finite, world space; directions of any length > 0.

Returns
-------
    Array of the same shape. Computed in float64 and rounded.

Raises
------
InvalidArgument
    Shapes that differ or do not end in 3, NaN or infinite values (the row is named).)")
      .def("lookup_float64", &lookup<double>, nb::arg("positions"), nb::arg("directions"),
           "lookup() with float64 coordinates and results.")
      .def("mirror_lookup", &mirror_lookup, nb::arg("eye"), nb::arg("positions"), nb::arg("normals"),
           R"(Texture coordinates of a mirror's vertices or pixels in one layer ([PEM] section 4).

Lookups along the reflections of the rays from `eye` (x, y, z) to the `positions` about the `normals`.

Parameters
----------
positions, normals
    (..., 3), of one shape, finite, world space; normals of any length > 0.

Returns
-------
    Array of the same shape: directions in which the map is read, not normalised.

Raises
------
InvalidArgument
    Shapes that differ or do not end in 3, NaN or infinite values (the row is named).)")
      .def("__getstate__", &proxy_state)
      .def("__setstate__",
           [](Proxy& self,
              const std::tuple<std::string, glm::vec3, glm::vec3, std::vector<float>, std::vector<float>>&
                  state) { new (&self) Proxy(std::apply(proxy_from_state, state)); })
      .def("validate", &validate, "Raises InvalidArgument, naming the field, if the proxy is not usable.")
      .def("__repr__", [](const Proxy& p) {
        const nb::object self = nb::cast(p);
        std::string text = std::string("Proxy(kind='") + shape_name(p) + "'";
        std::vector<std::string> fields =
            std::visit([]<typename Shape>(const Shape&) { return fields_of<Shape>(); }, p.shape);
        std::replace(fields.begin(), fields.end(), std::string("axes"), std::string("origin"));
        if (fields.empty()) fields = {"origin"};
        for (const std::string& field : fields) {
          text += ", " + field + "=" + nb::cast<std::string>(nb::repr(self.attr(field.c_str())));
        }
        return text + ")";
      });
}

template <typename Shape, std::size_t i>
using ExtentValue = std::decay_t<decltype(Shape{}.*(std::get<i>(ShapeTraits<Shape>::extents).member))>;

template <typename Shape, std::size_t... i>
void bind_shape(nb::class_<Proxy>& proxy, std::index_sequence<i...>) {
  using Traits = ShapeTraits<Shape>;
  const std::string doc = std::string(Traits::meaning) + R"( `origin` has to lie inside (default: the
centre, or above it where that is on a wall). Raises InvalidArgument for unusable values.)";
  proxy.def_static(
      Traits::name,
      [](glm::vec3 centre, ExtentValue<Shape, i>... extents, std::optional<glm::vec3> origin,
         std::optional<Axes> axes) {
        Shape shape;
        shape.centre = centre;
        shape.proxy_from_world = axes_matrix(axes);
        ((shape.*(std::get<i>(Traits::extents).member) = extents), ...);
        const glm::vec3 inside = centre + glm::transpose(shape.proxy_from_world) * Traits::inside(shape);
        return make_proxy(shape, origin.value_or(inside));
      },
      nb::arg("centre"), nb::arg(std::get<i>(Traits::extents).name)..., nb::arg("origin") = nb::none(),
      nb::arg("axes") = nb::none(), doc.c_str());
}

void bind_shapes(nb::module_& m) {
  nb::class_<Proxy> proxy(
      m, "Proxy", R"(The shape on which an environment map lies ([PEM] section 4), with the map's origin.

Made by the static constructors. Immutable. Positions and extents are world space, in metres; `axes` is a (3, 3)
array whose rows are the shape's own axes in world space (default: aligned with the world's).)");
  proxy
      .def_static(
          "infinite", [](glm::vec3 origin) { return make_proxy(InfiniteSphere{}, origin); },
          nb::arg("origin") = glm::vec3(0.0F), "The classic environment map: only the direction counts.")
      .def_static(
          "sphere",
          [](glm::vec3 centre, float radius, std::optional<glm::vec3> origin) {
            return make_proxy(Ellipsoid{centre, glm::vec3(radius)}, origin.value_or(centre));
          },
          nb::arg("centre"), nb::arg("radius"), nb::arg("origin") = nb::none(),
          "A finite sphere: an ellipsoid with three equal radii.");
  for_each_shape([&]<typename Shape>() {
    if constexpr (PlacedShape<Shape>) {
      constexpr std::size_t count = std::tuple_size_v<std::decay_t<decltype(ShapeTraits<Shape>::extents)>>;
      bind_shape<Shape>(proxy, std::make_index_sequence<count>());
    }
  });
  bind_attributes(proxy);
  bind_lookups(proxy);
  m.def(
      "proxy_shapes",
      [] {
        nb::dict shapes;
        for_each_shape([&]<typename Shape>() {
          shapes[ShapeTraits<Shape>::name] = nb::tuple(nb::cast(fields_of<Shape>()));
        });
        return shapes;
      },
      nb::sig("def proxy_shapes() -> dict[str, tuple[str, ...]]"),
      R"(What tells a shape besides the map's origin, by the name of the shape: attributes of a Proxy, and
arguments of the constructor that bears the name.)");
}

void bind_mirror_lookups(nb::module_& m) {
  m.def("mirror_lookups", &mirror_lookups_of_layers, nb::arg("proxies"), nb::arg("eye"), nb::arg("positions"),
        nb::arg("normals"), R"(Texture coordinates of a mirror's vertices or pixels in several layers at once.

As Proxy.mirror_lookup() of each of the `proxies`, to the bit, but vertices are read and rays reflected once.

Parameters
----------
proxies
    One per layer, at least one.
eye, positions, normals
    As for Proxy.mirror_lookup().

Returns
-------
    Array of shape (len(proxies), ..., 3): directions in which the maps are read, not normalised.

Raises
------
InvalidArgument
    As Proxy.mirror_lookup(); no proxies.)");
}

}  // namespace

void bind_proxy(nb::module_& m) {
  bind_shapes(m);
  bind_mirror_lookups(m);
}

}  // namespace mirrorbake::bindings
