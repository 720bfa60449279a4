#include <cmath>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include <nanobind/stl/optional.h>
#include <nanobind/stl/variant.h>

#include "bind.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/proxy/fit.hpp"
#include "mirrorbake/proxy/proxy.hpp"

namespace mirrorbake::bindings {
namespace {

using Axes = nb::ndarray<const float, nb::shape<3, 3>, nb::c_contig, nb::device::cpu>;
using TriangleArray = nb::ndarray<const std::uint32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

/// Rows of the array are the proxy's axes in world space, which makes it proxy_from_world; GLM stores columns.
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

template <typename Shape>
Proxy make_proxy(Shape shape, glm::vec3 origin) {
  Proxy proxy{std::move(shape), origin};
  validate(proxy);
  return proxy;
}

const char* kind_name(const Proxy& proxy) {
  constexpr const char* kNames[] = {"infinite", "box", "ellipsoid", "hemisphere"};
  return kNames[proxy.shape.index()];
}

/// Calls `get` on the shape, if it has what `get` reads; AttributeError otherwise.
template <typename Get>
auto shape_field(const Proxy& proxy, const char* field, Get get) {
  return std::visit(
      [&](const auto& shape) -> std::decay_t<decltype(get(Box{}, Ellipsoid{}))> {
        if constexpr (requires { get(shape, shape); }) {
          return get(shape, shape);
        } else {
          throw nb::attribute_error((std::string("a proxy of kind '") + kind_name(proxy) + "' has no " + field).c_str());
        }
      },
      proxy.shape);
}

}  // namespace
}  // namespace mirrorbake::bindings
