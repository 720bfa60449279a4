#pragma once

#include "mirrorbake/projection/map_point.hpp"

/// The equidistant fisheye (spec P6): the distance from the centre is proportional to the angle θ from the −Z
/// axis, and reaches 1 at half the field of view. +X is to the right, +Y up. 180° is an Omnimax frame ([WP]),
/// 360° the angular map of light probes (spec P5), r = θ/π.
namespace mirrorbake {

/// Beyond the field of view: the nearest point of the rim, not covered. Directions along +Z have no azimuth
/// and lie at (1, 0). NaN, infinite and zero directions give the centre, not covered. `field_of_view` in
/// radians, (0, 2π].
MapPoint fisheye_from_direction(glm::dvec3 direction, double field_of_view);

/// Unit direction; outside of the unit disc θ simply goes on growing.
glm::dvec3 direction_from_fisheye(double x, double y, double field_of_view);

MapJacobian fisheye_jacobian(double x, double y, double field_of_view);

}  // namespace mirrorbake
