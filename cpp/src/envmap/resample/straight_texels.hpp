#pragma once

#include <glm/vec2.hpp>

#include "bilinear_mean.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "resample_kernels.hpp"

/// Which texels' images in the source are straight enough for one quadrilateral, and how much of them is
/// interpolated.
namespace mirrorbake {

/// None of a map of few texels is straight enough: that its corners make a parallelogram says nothing of
/// edges that bend alike.
StraightLimits straight_limits(const EnvMapLayout& source, const EnvMapLayout& target);
/// Limits of the parts into which a texel that is not straight is divided.
StraightLimits limits_of_parts(const EnvMapLayout& source, const StraightLimits& limits);
bool is_straight(const Quad& quad, const StraightLimits& limits);

/// Extent of a quadrilateral's diagonals along an axis, in texels.
double length_of(const Quad& quad);

inline double cross(glm::dvec2 a, glm::dvec2 b) { return a.x * b.y - a.y * b.x; }

/// Length, in texels of the source, of a texel that covers `area` of them and whose sides' squares add up to
/// `squares`; the width of a long one (ResampleKernels::classify()).
double texel_side(double area, double squares);

/// How much of `automatic` is interpolation for texels that many of the source's long. At less than one texel
/// of the source nothing is left to alias, so that the change is quick.
double interpolated_share(double side);

/// How much of that is left at a place of a sphere map as source, in texels: less near its rim, where the
/// next texel may be beyond it, and interpolation would hand flux out to what has none.
double interpolable(const EnvMapLayout& sphere_map, glm::dvec2 position);

}  // namespace mirrorbake
