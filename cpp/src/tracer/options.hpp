#pragma once

#include "mirrorbake/tracer/tracer.hpp"

namespace mirrorbake::tracing {

/// Embree's own limit is 1.8e18.
inline constexpr float kLargestCoordinate = 1e18F;

/// Whether all coordinates are finite and near enough for Embree.
bool usable(glm::vec3 point);
/// Throws InvalidArgument for a point that is not finite or too far away for Embree.
void check_point(const char* argument, glm::vec3 point);

void validate(const TraceOptions& options);
/// The window of an image that the options mean. Throws InvalidArgument if it does not lie in the image.
PixelWindow window_in(const TraceOptions& options, int width, int height);

}  // namespace mirrorbake::tracing
