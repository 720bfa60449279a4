#pragma once

#include "mirrorbake/projection/map_point.hpp"

/// The latitude-longitude projection (spec P4): the centre looks along −Z, +X is to the right of it, +Y is
/// the whole top row. x is the longitude over π, y the latitude over π/2.
namespace mirrorbake {

/// Directions along +Z lie on the seam: x = 1 if d_x is +0, x = −1 if it is −0. At the poles, where the
/// longitude is undefined, x = 0 or ±1, as atan2 has it. NaN, infinite and zero directions give the centre,
/// not covered.
MapPoint latlong_from_direction(glm::dvec3 direction);

/// Unit direction. x is periodic; y beyond ±1 goes on over the pole.
glm::dvec3 direction_from_latlong(double x, double y);

MapJacobian latlong_jacobian(double x, double y);

}  // namespace mirrorbake
