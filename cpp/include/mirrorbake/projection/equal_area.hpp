#pragma once

#include "mirrorbake/projection/map_point.hpp"

/// The cylindrical equal-area projection (spec P8; Hall, in [WP]; Lambert 1772): longitude against the sine
/// of latitude, so that all texels see the same solid angle. x is the longitude over π, y the sine of the
/// latitude; centre and sides are those of latlong.
namespace mirrorbake {

/// The seam and the poles are those of latlong_from_direction(). NaN, infinite and zero directions give the
/// centre, not covered.
MapPoint equal_area_from_direction(glm::dvec3 direction);

/// Unit direction. x is periodic; y beyond ±1 goes on over the pole, as mirrored there and half a turn away.
/// Near a pole the latitude changes as √(1 − |y|): y in float32 is good for 2e-7 rad divided by the distance
/// from the pole in radians.
glm::dvec3 direction_from_equal_area(double x, double y);

/// ∂d/∂y grows without bound towards the poles; it is that of 1e-9 rad away from them there.
MapJacobian equal_area_jacobian(double x, double y);

}  // namespace mirrorbake
