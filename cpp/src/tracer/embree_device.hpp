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

/// Whether successive rays of a thread resemble each other, which lets Embree share work.
enum class Coherence { coherent, incoherent };

inline void intersect1(RTCScene scene, RTCRayHit& ray, Coherence coherence) {
#if MIRRORBAKE_EMBREE_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  if (coherence == Coherence::coherent) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect1(scene, &ray, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (coherence == Coherence::coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect1(scene, &context, &ray);
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
