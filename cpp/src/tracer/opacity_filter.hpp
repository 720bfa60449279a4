#pragma once

#include <cstdint>

#include "embree_device.hpp"
#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake::tracing {

/// What the filter looks up; it has to stay where it is as long as the geometry.
struct OpacityLookup {
  const Scene* scene = nullptr;
  std::uint32_t object = 0;
};

/// Lets rays through a geometry's gaps. A surface of opacity p is there for a ray with the probability p:
/// whether it is depends on the bits of the ray and the triangle alone, so that the same ray meets the same
/// surfaces in every layer and on any number of threads (Wyman, McGuire, "Hashed Alpha Testing", I3D 2017,
/// has the idea). Throws Error if Embree was built without filters.
void set_opacity_filter(RTCDevice device, RTCGeometry geometry, const OpacityLookup& lookup);

}  // namespace mirrorbake::tracing
