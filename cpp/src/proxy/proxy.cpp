#include "mirrorbake/proxy/proxy.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <type_traits>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

void check_extent(const char* name, glm::vec3 v) {
  if (!is_finite(v) || !(v.x > 0 && v.y > 0 && v.z > 0)) {
    throw InvalidArgument(name, text_of(v), "positive and finite");
  }
}

/// < 1 inside, in units of the extents.
double gauge(const Box& box, glm::vec3 p) {
  const glm::dvec3 q = glm::abs(glm::dmat3(box.proxy_from_world) * (glm::dvec3(p) - glm::dvec3(box.centre))) /
                       glm::dvec3(box.half_extent);
  return std::max({q.x, q.y, q.z});
}

double gauge(const Ellipsoid& ellipsoid, glm::vec3 p) {
  return glm::length(glm::dmat3(ellipsoid.proxy_from_world) * (glm::dvec3(p) - glm::dvec3(ellipsoid.centre)) /
                     glm::dvec3(ellipsoid.radii));
}

double gauge(const Hemisphere& dome, glm::vec3 p) {
  const glm::dvec3 q = glm::dmat3(dome.proxy_from_world) * (glm::dvec3(p) - glm::dvec3(dome.centre)) /
                       static_cast<double>(dome.radius);
  return std::max(glm::length(q), 1.0 - q.y);
}

void check_shape(const InfiniteSphere&) {}

void check_shape(const Box& box) {
  check_finite("box centre", box.centre);
  check_extent("box half_extent", box.half_extent);
  check_orthonormal("box proxy_from_world", box.proxy_from_world);
}

void check_shape(const Ellipsoid& ellipsoid) {
  check_finite("ellipsoid centre", ellipsoid.centre);
  check_extent("ellipsoid radii", ellipsoid.radii);
  check_orthonormal("ellipsoid proxy_from_world", ellipsoid.proxy_from_world);
}

void check_shape(const Hemisphere& dome) {
  check_finite("hemisphere centre", dome.centre);
  check_extent("hemisphere radius", glm::vec3(dome.radius));
  check_orthonormal("hemisphere proxy_from_world", dome.proxy_from_world);
}

}  // namespace

Proxy translated(const Proxy& proxy, glm::dvec3 by) {
  const auto move = [by](glm::vec3& p) { p = glm::vec3(glm::dvec3(p) + by); };
  Proxy result = proxy;
  move(result.origin);
  std::visit(
      [&](auto& shape) {
        if constexpr (!std::is_same_v<std::decay_t<decltype(shape)>, InfiniteSphere>) move(shape.centre);
      },
      result.shape);
  return result;
}

void validate(const Proxy& proxy) {
  check_finite("proxy origin", proxy.origin);
  std::visit(
      [&](const auto& shape) {
        check_shape(shape);
        if constexpr (!std::is_same_v<std::decay_t<decltype(shape)>, InfiniteSphere>) {
          if (!(gauge(shape, proxy.origin) < 1.0)) {
            throw InvalidArgument("proxy origin", text_of(proxy.origin), "a point inside of the shape");
          }
        }
      },
      proxy.shape);
}

}  // namespace mirrorbake
