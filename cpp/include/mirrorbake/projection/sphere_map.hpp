#pragma once

#include "mirrorbake/projection/map_point.hpp"

/// The sphere map, or gazing ball: what an orthographic camera on the +Z axis sees in a mirror ball (spec P3;
/// [EMT] §2.1; [RSI] §3.3). (x, y) are the x and y of h = (v₀ + d)/|v₀ + d|, v₀ = +Z. Every unit of area
/// covers the same solid angle, 4 sr, but the whole rim is the one direction −v₀.
namespace mirrorbake {

/// d = −v₀ has no azimuth and gives the rim at (1, 0). NaN, infinite and zero directions give the centre, not
/// covered.
MapPoint sphere_map_from_direction(glm::dvec3 direction);

/// Unit direction; −v₀ on the rim and outside of it.
glm::dvec3 direction_from_sphere_map(double x, double y);

/// Grows without bound towards the rim; on the rim and outside it is zero, since the direction is constant
/// there.
MapJacobian sphere_map_jacobian(double x, double y);

}  // namespace mirrorbake
