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

template <typename Shape, typename Function>
void for_each_extent(const Function& function) {
  std::apply([&](const auto&... extent) { (function(extent), ...); }, ShapeTraits<Shape>::extents);
}

void check_extent(const std::string& name, glm::vec3 v) {
  if (!is_finite(v) || !(v.x > 0 && v.y > 0 && v.z > 0)) {
    throw InvalidArgument(name, text_of(v), "positive and finite");
  }
}

void check_shape(const InfiniteSphere&, glm::vec3) {}

template <PlacedShape Shape>
void check_shape(const Shape& shape, glm::vec3 origin) {
  using Traits = ShapeTraits<Shape>;
  const std::string name = std::string(Traits::name) + " ";
  check_finite(name + "centre", shape.centre);
  for_each_extent<Shape>(
      [&](const auto& extent) { check_extent(name + extent.name, glm::vec3(shape.*(extent.member))); });
  check_orthonormal(name + "proxy_from_world", shape.proxy_from_world);
  const glm::dvec3 from_centre = glm::dvec3(origin) - glm::dvec3(shape.centre);
  const double gauge =
      Traits::gauge(glm::dmat3(shape.proxy_from_world) * from_centre / glm::dvec3(Traits::size(shape)));
  if (!(gauge < 1.0)) throw InvalidArgument("proxy origin", text_of(origin), "a point inside of the shape");
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

template <PlacedShape Shape>
void set_shape(LookupConstants& k, const Shape& shape) {
  const glm::vec3 size = ShapeTraits<Shape>::size(shape);
  set_frame(k, shape.centre, shape.proxy_from_world,
            baseline::is_scaled(k.shape) ? 1.0 / glm::dvec3(size) : glm::dvec3(1.0));
  set(k.extent, size);
}

/// The lengths of an extent, of either type.
std::span<float> numbers_of(float& extent) { return {&extent, 1}; }
std::span<float> numbers_of(glm::vec3& extent) { return {&extent.x, 3}; }

template <typename Shape>
std::optional<Proxy> from_numbers(glm::vec3 centre, std::span<const float> extents,
                                  const glm::mat3& proxy_from_world) {
  Shape shape;
  std::size_t used = 0;
  for_each_extent<Shape>([&](const auto& extent) {
    for (float& number : numbers_of(shape.*(extent.member))) {
      if (used < extents.size()) number = extents[used];
      ++used;
    }
  });
  if (used != extents.size()) return std::nullopt;
  Proxy proxy;
  if constexpr (PlacedShape<Shape>) {
    shape.centre = centre;
    shape.proxy_from_world = proxy_from_world;
    proxy.origin = centre + glm::transpose(proxy_from_world) * ShapeTraits<Shape>::inside(shape);
  }
  proxy.shape = shape;
  return proxy;
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
        if constexpr (PlacedShape<std::decay_t<decltype(shape)>>) move(shape.centre);
      },
      result.shape);
  return result;
}

const char* shape_name(const Proxy& proxy) {
  return std::visit([]<typename Shape>(const Shape&) { return ShapeTraits<Shape>::name; }, proxy.shape);
}

std::optional<Proxy> proxy_from_numbers(std::string_view name, glm::vec3 centre,
                                        std::span<const float> extents, const glm::mat3& proxy_from_world) {
  std::optional<Proxy> found;
  const auto try_shape = [&]<typename Shape>(const Shape&) {
    if (name == ShapeTraits<Shape>::name) found = from_numbers<Shape>(centre, extents, proxy_from_world);
  };
  [&]<typename... Shape>(const std::variant<Shape...>&) { (try_shape(Shape{}), ...); }(Proxy{}.shape);
  return found;
}

std::vector<float> extents_of(const Proxy& proxy) {
  std::vector<float> numbers;
  std::visit(
      [&]<typename Shape>(Shape shape) {
        for_each_extent<Shape>([&](const auto& extent) {
          for (const float number : numbers_of(shape.*(extent.member))) numbers.push_back(number);
        });
      },
      proxy.shape);
  return numbers;
}

void validate(const Proxy& proxy) {
  check_finite("proxy origin", proxy.origin);
  std::visit([&](const auto& shape) { check_shape(shape, proxy.origin); }, proxy.shape);
}

}  // namespace mirrorbake
