#pragma once

#include <utility>

#include "mirrorbake/proxy/proxy.hpp"

namespace mirrorbake::bindings {

/// Throws InvalidArgument for a shape that is not usable.
template <typename Shape>
Proxy make_proxy(Shape shape, glm::vec3 origin) {
  Proxy proxy{std::move(shape), origin};
  validate(proxy);
  return proxy;
}

}  // namespace mirrorbake::bindings
