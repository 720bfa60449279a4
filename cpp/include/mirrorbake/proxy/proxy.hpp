#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <variant>
#include <vector>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

/// Proxy geometry: the shape on which an environment map lies (spec §4, [PEM] §4 "EM Representations").
///
/// A lookup follows a ray from a position to the point h where it leaves the proxy and reads the map in the
/// direction h − origin. Coordinates are float, the arithmetic is double: a float kernel loses one to three
/// digits near walls and in flat shapes (1:1e4), where h − origin is a short difference of long vectors. For
/// finite input whose absolute values are below 1e30 the answer is never NaN, and for positions inside it is
/// within 1e-6 rad of the exact one.
///
/// Outside of the proxy (a vertex that pokes through the table on which a box stands, say) the answer is
/// defined so that it is exact wherever the ray passes through the proxy, and changes continuously as the
/// position crosses a wall or the ray starts to miss:
///
///  - Ellipsoid: h is where the ray leaves the ellipsoid; if it never enters, the ray's point that is nearest
///  to the
///    centre in units of the radii, which is the position itself for rays that lead away.
///  - Box: h is the first crossing of one of the three wall planes which the direction faces, each taken at
///  its
///    distance along the ray regardless of the side on which the position lies.
///  - Hemisphere: the nearer one of the sphere's answer and, for directions that point down, the floor
///  plane's,
///    again regardless of side.
///
/// No continuous answer exists on a flat wall for directions that lie in it: there a wall that the direction
/// is exactly parallel to is ignored.
namespace mirrorbake {

/// One of the lengths that tell how large a shape is: metres, above 0. `Value` is float or glm::vec3.
template <typename Shape, typename Value>
struct ShapeExtent {
  const char* name;
  Value Shape::*member;
  const char* meaning;
};

/// What the library, files and Python know of a shape, specialised beside it; where rays leave it is in
/// src/proxy/lookup_formulas.hpp. All shapes but the infinite one have a `centre` and axes of their own in
/// `proxy_from_world`, and
///
///  - `extents`, a tuple of ShapeExtent; in files and in Python they have these names,
///  - `size`, lengths along the axes; `gauge` of a point from the centre, in their units, is below 1 inside,
///  - `inside`, a point clearly inside, along the axes and seen from the centre: the origin of maps, if none
///    is given.
template <typename Shape>
struct ShapeTraits;

/// The classic environment map: only the direction counts.
struct InfiniteSphere {};

template <>
struct ShapeTraits<InfiniteSphere> {
  static constexpr const char* name = "infinite";
  static constexpr std::tuple<> extents = {};
};

/// A box with its own axes; `proxy_from_world` rotates world directions into them (identity: axis-aligned).
struct Box {
  glm::vec3 centre{0.0F};
  glm::vec3 half_extent{1.0F};  ///< > 0
  glm::mat3 proxy_from_world{1.0F};
};

template <>
struct ShapeTraits<Box> {
  static constexpr const char* name = "box";
  static constexpr const char* meaning = "A box.";
  static constexpr std::tuple extents = {ShapeExtent<Box, glm::vec3>{
      "half_extent", &Box::half_extent, "Half the box's edge lengths, along its axes."}};
  static glm::vec3 size(const Box& box) { return box.half_extent; }
  static double gauge(const glm::dvec3& q) { return std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z)}); }
  static glm::vec3 inside(const Box&) { return glm::vec3(0.0F); }
};

/// An ellipsoid with its own axes; a finite sphere has three equal radii.
struct Ellipsoid {
  glm::vec3 centre{0.0F};
  glm::vec3 radii{1.0F};  ///< > 0
  glm::mat3 proxy_from_world{1.0F};
};

template <>
struct ShapeTraits<Ellipsoid> {
  static constexpr const char* name = "ellipsoid";
  static constexpr const char* meaning = "An ellipsoid.";
  static constexpr std::tuple extents = {ShapeExtent<Ellipsoid, glm::vec3>{
      "radii", &Ellipsoid::radii, "Radii of the ellipsoid along its axes."}};
  static glm::vec3 size(const Ellipsoid& ellipsoid) { return ellipsoid.radii; }
  static double gauge(const glm::dvec3& q) { return glm::length(q); }
  static glm::vec3 inside(const Ellipsoid&) { return glm::vec3(0.0F); }
};

/// The half y ≥ 0, on its own axes, of a sphere, closed by a flat floor through the centre.
struct Hemisphere {
  glm::vec3 centre{0.0F};  ///< of the floor's disc
  float radius = 1.0F;     ///< > 0
  glm::mat3 proxy_from_world{1.0F};
};

template <>
struct ShapeTraits<Hemisphere> {
  static constexpr const char* name = "hemisphere";
  static constexpr const char* meaning = "The half of a sphere above its own y = 0, closed by a flat floor.";
  static constexpr std::tuple extents = {
      ShapeExtent<Hemisphere, float>{"radius", &Hemisphere::radius, "Radius of the hemisphere."}};
  static glm::vec3 size(const Hemisphere& dome) { return glm::vec3(dome.radius); }
  static double gauge(const glm::dvec3& q) { return std::max(glm::length(q), 1.0 - q.y); }
  static glm::vec3 inside(const Hemisphere& dome) { return {0.0F, 0.5F * dome.radius, 0.0F}; }
};

template <typename Shape>
concept PlacedShape = requires(Shape shape) {
  shape.centre;
};

struct Proxy {
  std::variant<InfiniteSphere, Box, Ellipsoid, Hemisphere> shape;
  glm::vec3 origin{0.0F};  ///< of the map, world space: lookups are directions seen from here
};

const char* shape_name(const Proxy& proxy);

/// The shape of this name with these lengths, the origin at a point clearly inside; `extents` are those of
/// its traits one after another. None for a name that is not known, or another number of lengths. Not
/// validated.
std::optional<Proxy> proxy_from_numbers(std::string_view name, glm::vec3 centre,
                                        std::span<const float> extents,
                                        const glm::mat3& proxy_from_world = glm::mat3(1.0F));

/// The lengths that proxy_from_numbers takes.
std::vector<float> extents_of(const Proxy& proxy);

/// Direction in which the map is read by a ray from `position` along `direction` (any length > 0): from the
/// map's origin to where the ray leaves the proxy, not normalised ([PEM] §4). For the infinite sphere it is
/// `direction` itself. Positions outside and rays that miss: see above. A zero direction leaves the ray at
/// `position`.
glm::vec3 lookup_direction(const Proxy& proxy, glm::vec3 position, glm::vec3 direction);

/// The same with float64 coordinates; the direction's length is 0 or from 1e-100 to 1e100, whose square and
/// products are still numbers.
glm::dvec3 lookup_direction(const Proxy& proxy, glm::dvec3 position, glm::dvec3 direction);

/// The same for many rays, in parallel and vectorised, with the same bits as one at a time. `lookups` may be
/// the same memory as `positions` or `directions`, but not overlap partly. Throws InvalidArgument if the
/// spans differ in length, or naming the first row with a NaN or infinite component; `lookups` is then
/// unspecified.
void lookup_directions(const Proxy& proxy, std::span<const glm::vec3> positions,
                       std::span<const glm::vec3> directions, std::span<glm::vec3> lookups);

/// The same with float64 coordinates.
void lookup_directions(const Proxy& proxy, std::span<const glm::dvec3> positions,
                       std::span<const glm::dvec3> directions, std::span<glm::dvec3> lookups);

/// Texture coordinates of a mirror's vertices or pixels for one or more layers ([PEM] §4): lookups along the
/// reflections, about the `normals` (any length > 0), of rays from `eye` to the `positions`. `lookups` holds
/// those in the first proxy, then those in the second, …: proxies.size() · positions.size() elements. Memory
/// and errors as for lookup_directions, except that the lookups of several proxies may not replace an input;
/// `eye` has to be finite too, and `proxies` not empty.
void mirror_lookups(std::span<const Proxy> proxies, glm::vec3 eye, std::span<const glm::vec3> positions,
                    std::span<const glm::vec3> normals, std::span<glm::vec3> lookups);

/// The proxy elsewhere, shape and origin.
Proxy translated(const Proxy& proxy, glm::dvec3 by);

/// Throws InvalidArgument, naming the field, if the proxy is not usable: extents not positive or not finite,
/// axes not orthonormal (to 1e-4), origin not inside of the shape.
void validate(const Proxy& proxy);

}  // namespace mirrorbake
