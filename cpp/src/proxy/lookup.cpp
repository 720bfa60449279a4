#include <string>
#include <type_traits>

#include "exit_distance.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/proxy/proxy.hpp"

namespace mirrorbake {
namespace {

template <typename Real>
glm::vec<3, Real> lookup(const Proxy& proxy, const glm::vec<3, Real>& position,
                         const glm::vec<3, Real>& direction) {
  return std::visit(
      [&](const auto& shape) -> glm::vec<3, Real> {
        if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, InfiniteSphere>) {
          return direction;
        } else {
          const auto exit = detail::make_exit<double>(shape);
          const glm::dvec3 p(position);
          const glm::dvec3 d(direction);
          const double t = exit.exit(exit.frame.position(p), exit.frame.direction(d));
          return glm::vec<3, Real>(p + t * d - glm::dvec3(proxy.origin));
        }
      },
      proxy.shape);
}

template <typename Vector>
void lookup_all(const Proxy& proxy, std::span<const Vector> positions, std::span<const Vector> directions,
                std::span<Vector> lookups) {
  if (positions.size() != directions.size() || lookups.size() != directions.size()) {
    throw InvalidArgument("positions, directions, lookups",
                          std::to_string(positions.size()) + ", " + std::to_string(directions.size()) + ", " +
                              std::to_string(lookups.size()) + " elements",
                          "spans of one length");
  }
  for (std::size_t i = 0; i < positions.size(); ++i) lookups[i] = lookup(proxy, positions[i], directions[i]);
}

}  // namespace

glm::vec3 lookup_direction(const Proxy& proxy, glm::vec3 position, glm::vec3 direction) {
  return lookup(proxy, position, direction);
}

glm::dvec3 lookup_direction(const Proxy& proxy, glm::dvec3 position, glm::dvec3 direction) {
  return lookup(proxy, position, direction);
}

void lookup_directions(const Proxy& proxy, std::span<const glm::vec3> positions,
                       std::span<const glm::vec3> directions, std::span<glm::vec3> lookups) {
  lookup_all(proxy, positions, directions, lookups);
}

void lookup_directions(const Proxy& proxy, std::span<const glm::dvec3> positions,
                       std::span<const glm::dvec3> directions, std::span<glm::dvec3> lookups) {
  lookup_all(proxy, positions, directions, lookups);
}

}  // namespace mirrorbake
