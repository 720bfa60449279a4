#pragma once

#include <variant>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

/// Proxy geometry: the shape on which an environment map lies (spec §4, [PEM] §4 "EM Representations").
namespace mirrorbake {

/// The classic environment map: only the direction counts.
struct InfiniteSphere {};

/// A box with its own axes; `proxy_from_world` rotates world directions into them (identity: axis-aligned).
struct Box {
  glm::vec3 centre{0.0F};
  glm::vec3 half_extent{1.0F};  ///< > 0
  glm::mat3 proxy_from_world{1.0F};
};

/// An ellipsoid with its own axes; a finite sphere has three equal radii.
struct Ellipsoid {
  glm::vec3 centre{0.0F};
  glm::vec3 radii{1.0F};  ///< > 0
  glm::mat3 proxy_from_world{1.0F};
};

struct Proxy {
  std::variant<InfiniteSphere, Box, Ellipsoid> shape;
  glm::vec3 origin{0.0F};  ///< of the map, world space: lookups are directions seen from here
};

/// Direction in which the map is read by a ray from `position` along `direction` (any length > 0): from the map's
/// origin to where the ray leaves the proxy, not normalised ([PEM] §4). For the infinite sphere it is `direction`
/// itself. A position outside, or a ray that misses, gets a continuous answer, never NaN (spec G2).
glm::vec3 lookup_direction(const Proxy& proxy, glm::vec3 position, glm::vec3 direction);

/// Throws InvalidArgument, naming the field, if the proxy is not usable: extents not positive or not finite, axes
/// not orthonormal, origin outside of the shape.
void validate(const Proxy& proxy);

}  // namespace mirrorbake
