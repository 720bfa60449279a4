#include "opacity_filter.hpp"

#include <bit>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "barycentric.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/sampling.hpp"

namespace mirrorbake::tracing {
namespace {

std::uint64_t bits(float a, float b) {
  return std::uint64_t{std::bit_cast<std::uint32_t>(a)} << 32 | std::bit_cast<std::uint32_t>(b);
}

/// Uniform in [0,1) over rays and triangles.
float chance(RTCRayN* rays, unsigned count, unsigned i, std::uint32_t object, std::uint32_t triangle) {
  std::uint64_t hash = hash64(std::uint64_t{object} << 32 | triangle);
  hash = hash64(hash, bits(RTCRayN_org_x(rays, count, i), RTCRayN_org_y(rays, count, i)));
  hash = hash64(hash, bits(RTCRayN_org_z(rays, count, i), RTCRayN_dir_x(rays, count, i)));
  hash = hash64(hash, bits(RTCRayN_dir_y(rays, count, i), RTCRayN_dir_z(rays, count, i)));
  return unit_float(static_cast<std::uint32_t>(hash >> 32));
}

/// Embree's callback: clears `valid` of the hits that are none.
void filter(const RTCFilterFunctionNArguments* arguments) {
  const auto& lookup = *static_cast<const OpacityLookup*>(arguments->geometryUserPtr);
  const Object& object = lookup.scene->objects[lookup.object];
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0) continue;
    const unsigned triangle = RTCHitN_primID(arguments->hit, arguments->N, i);
    const Material& material =
        lookup.scene->materials[static_cast<std::size_t>(material_of(object, triangle))];
    const glm::vec2 barycentric(RTCHitN_u(arguments->hit, arguments->N, i),
                                RTCHitN_v(arguments->hit, arguments->N, i));
    const float opacity = opacity_at(*lookup.scene, material, uv_at(object.mesh, triangle, barycentric));
    if (opacity >= 1.0F) continue;
    if (opacity <= chance(arguments->ray, arguments->N, i, lookup.object, triangle)) arguments->valid[i] = 0;
  }
}

}  // namespace

void set_opacity_filter(RTCDevice device, RTCGeometry geometry, const OpacityLookup& lookup) {
  if (rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED) == 0) {
    throw Error("a material's opacity needs an Embree with filter functions, which this one is not");
  }
  // Embree hands the pointer back as a mutable one; the filter only reads.
  rtcSetGeometryUserData(geometry, const_cast<OpacityLookup*>(&lookup));
  rtcSetGeometryIntersectFilterFunction(geometry, filter);
  rtcSetGeometryOccludedFilterFunction(geometry, filter);
}

}  // namespace mirrorbake::tracing
