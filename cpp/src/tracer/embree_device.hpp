#pragma once

// The one place that knows which Embree is installed: 3.13 and 4 differ in their include path and in how the
// per-call arguments are passed.
#if MIRRORBAKE_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <memory>
#include <type_traits>

namespace mirrorbake::tracing {

template <auto release>
struct EmbreeRelease {
  template <typename T>
  void operator()(T* handle) const {
    release(handle);
  }
};

using EmbreeDevice = std::unique_ptr<std::remove_pointer_t<RTCDevice>, EmbreeRelease<rtcReleaseDevice>>;
using EmbreeScene = std::unique_ptr<std::remove_pointer_t<RTCScene>, EmbreeRelease<rtcReleaseScene>>;
using EmbreeGeometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, EmbreeRelease<rtcReleaseGeometry>>;

inline void intersect1(RTCScene scene, RTCRayHit& ray) {
#if MIRRORBAKE_EMBREE_MAJOR >= 4
  rtcIntersect1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &ray);
#endif
}

/// Sixteen coherent rays, of which those with `valid` = −1 are traced.
inline void intersect16(const int* valid, RTCScene scene, RTCRayHit16& rays) {
#if MIRRORBAKE_EMBREE_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &rays, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &context, &rays);
#endif
}

inline void occluded1(RTCScene scene, RTCRay& ray) {
#if MIRRORBAKE_EMBREE_MAJOR >= 4
  rtcOccluded1(scene, &ray, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
}

}  // namespace mirrorbake::tracing
