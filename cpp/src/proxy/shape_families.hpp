#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>
#include <glm/vec3.hpp>

#include "mirrorbake/proxy/proxy.hpp"

/// The families of shapes among which choose_proxy() chooses.
namespace mirrorbake::shape_families {

using Parameters = Eigen::VectorXd;

enum class Shape { infinite, sphere, hemisphere, box, ellipsoid };

/// A family of shapes. Its parameters are, with lengths in units of the scene's scale and seen from the
/// origin:
///
///   sphere      centre x y z, log radius
///   hemisphere  centre x z, log depth of the floor, log radius
///   box         log distances of the sides −x −y −z +x +y +z
///   ellipsoid   centre x y z, log radii
///   rotated     ... and a rotation vector
struct Family {
  const char* name;
  Shape shape;
  int parameters;
  bool rotated;
};

// In rising order of parameters; of two with as many, the one with the cheaper lookup first.
inline constexpr Family kFamilies[] = {
    {"infinite", Shape::infinite, 0, false},          {"sphere", Shape::sphere, 4, false},
    {"hemisphere", Shape::hemisphere, 4, false},      {"box", Shape::box, 6, false},
    {"ellipsoid", Shape::ellipsoid, 6, false},        {"rotated box", Shape::box, 9, true},
    {"rotated ellipsoid", Shape::ellipsoid, 9, true},
};

/// Whether the parameters are those of a shape with the origin clearly inside.
bool feasible(const Family& family, const Parameters& q);

/// `origin` of the map, `scale` in metres.
Proxy make_proxy(const Family& family, const Parameters& q, const glm::vec3& origin, double scale);

/// Parameters to begin a fit at: what the hits, in metres, suggest.
std::vector<Parameters> starts(const Family& family, std::span<const glm::vec3> hits, glm::vec3 origin,
                               double scale);

}  // namespace mirrorbake::shape_families
