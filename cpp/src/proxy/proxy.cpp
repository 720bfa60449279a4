#include "mirrorbake/proxy/proxy.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <type_traits>
#include <variant>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "lookup_constants.hpp"
#include "lookup_formulas.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

static_assert(std::variant_size_v<decltype(Proxy::shape)> == static_cast<std::size_t>(LookupShape::count));

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

void set(double (&to)[3], glm::vec3 from) {
  for (int i = 0; i < 3; ++i) to[i] = static_cast<double>(from[i]);
}

void set_frame(LookupConstants& k, glm::vec3 centre, const glm::mat3& proxy_from_world, glm::dvec3 scale) {
  set(k.centre, centre);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      k.rows[3 * row + column] = scale[row] * static_cast<double>(proxy_from_world[column][row]);
    }
  }
  k.rotated = proxy_from_world != glm::mat3(1.0F);
}

void set_shape(LookupConstants&, const InfiniteSphere&) {}

void set_shape(LookupConstants& k, const Box& box) {
  set_frame(k, box.centre, box.proxy_from_world, glm::dvec3(1.0));
  set(k.extent, box.half_extent);
}

void set_shape(LookupConstants& k, const Ellipsoid& ellipsoid) {
  set_frame(k, ellipsoid.centre, ellipsoid.proxy_from_world, 1.0 / glm::dvec3(ellipsoid.radii));
}

void set_shape(LookupConstants& k, const Hemisphere& dome) {
  set_frame(k, dome.centre, dome.proxy_from_world, glm::dvec3(1.0 / static_cast<double>(dome.radius)));
}

}  // namespace

LookupConstants lookup_constants(const Proxy& proxy) {
  LookupConstants k;
  k.shape = static_cast<LookupShape>(proxy.shape.index());
  std::visit([&](const auto& shape) { set_shape(k, shape); }, proxy.shape);
  set(k.origin, proxy.origin);
  return k;
}

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
