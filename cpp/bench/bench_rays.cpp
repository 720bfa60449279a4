// Rays of the tracer against a bare Embree loop over the same rays and the same kind of BVH. Prints one JSON
// object per case: {"case", "rays", "threads", "ours", "bare", "share"}, in million rays per second; `share`
// is ours / bare by processor time, which other programs disturb less.
//
// Both sides run on all threads, in turn; the best run counts. It ends with status 1 if the two disagree.

#if MIRRORBAKE_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <limits>
#include <span>
#include <vector>
#include <glm/geometric.hpp>

#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/scene/room.hpp"
#include "mirrorbake/scene/shapes.hpp"
#include "mirrorbake/tracer/tracer.hpp"

namespace {

using namespace mirrorbake;  // NOLINT(google-build-using-namespace): one program, one namespace

constexpr int kSide = 1024;
constexpr int kRuns = 15;

// What Embree can do with the scene's triangles: one geometry per object, robust.
class BareEmbree {
 public:
  explicit BareEmbree(const Scene& scene) : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    for (const Object& object : scene.objects) {
      RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
      auto* vertices = static_cast<glm::vec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                                       RTC_FORMAT_FLOAT3, sizeof(glm::vec3),
                                                                       object.mesh.positions.size()));
      std::copy(object.mesh.positions.begin(), object.mesh.positions.end(), vertices);
      auto* indices = static_cast<glm::uvec3*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                                                       RTC_FORMAT_UINT3, sizeof(glm::uvec3),
                                                                       object.mesh.triangles.size()));
      std::copy(object.mesh.triangles.begin(), object.mesh.triangles.end(), indices);
      rtcCommitGeometry(geometry);
      rtcAttachGeometry(scene_, geometry);
      rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(scene_);
  }
  ~BareEmbree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  BareEmbree(const BareEmbree&) = delete;
  BareEmbree& operator=(const BareEmbree&) = delete;

  // Sixteen at a time, coherent: its fastest call for such rays. Unit directions.
  void intersect(std::span<const glm::vec3> origins, std::span<const glm::vec3> directions,
                 std::span<float> distance, std::span<std::int32_t> object) const {
    parallel_for(origins.size(), 4096, [&](std::size_t begin, std::size_t end) {
#if MIRRORBAKE_EMBREE_MAJOR >= 4
      RTCIntersectArguments context;
      rtcInitIntersectArguments(&context);
      context.flags = RTC_RAY_QUERY_FLAG_COHERENT;
#else
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
#endif
      alignas(64) RTCRayHit16 packet;
      alignas(64) int valid[16];
      for (std::size_t first = begin; first < end; first += 16) {
        const std::size_t count = std::min<std::size_t>(16, end - first);
        for (std::size_t i = 0; i < 16; ++i) {
          const std::size_t k = first + std::min(i, count - 1);
          valid[i] = i < count ? -1 : 0;
          packet.ray.org_x[i] = origins[k].x;
          packet.ray.org_y[i] = origins[k].y;
          packet.ray.org_z[i] = origins[k].z;
          packet.ray.dir_x[i] = directions[k].x;
          packet.ray.dir_y[i] = directions[k].y;
          packet.ray.dir_z[i] = directions[k].z;
          packet.ray.tnear[i] = 0.0F;
          packet.ray.tfar[i] = std::numeric_limits<float>::infinity();
          packet.ray.time[i] = 0.0F;
          packet.ray.mask[i] = ~0U;
          packet.ray.flags[i] = 0;
          packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
          packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        }
#if MIRRORBAKE_EMBREE_MAJOR >= 4
        rtcIntersect16(valid, scene_, &packet, &context);
#else
        rtcIntersect16(valid, scene_, &context, &packet);
#endif
        for (std::size_t i = 0; i < count; ++i) {
          distance[first + i] = packet.ray.tfar[i];
          object[first + i] = static_cast<std::int32_t>(packet.hit.geomID[i]);
        }
      }
    });
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
};

struct Best {
  double seconds = std::numeric_limits<double>::infinity();
  double processor_seconds = std::numeric_limits<double>::infinity();

  template <typename Run>
  void time(const Run& run) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t processor_start = std::clock();
    run();
    processor_seconds =
        std::min(processor_seconds, static_cast<double>(std::clock() - processor_start) / CLOCKS_PER_SEC);
    seconds =
        std::min(seconds, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
};

struct Rays {
  std::vector<glm::vec3> origins;
  std::vector<glm::vec3> directions;
};

bool compare(const char* name, const Tracer& tracer, const BareEmbree& bare, const Rays& rays) {
  const std::size_t count = rays.origins.size();
  std::vector<float> distance(count), bare_distance(count);
  std::vector<std::int32_t> object(count), bare_object(count);
  Best ours;
  Best theirs;
  for (int i = 0; i < kRuns; ++i) {
    ours.time([&] { tracer.intersect(rays.origins, rays.directions, {}, distance, object); });
    theirs.time([&] { bare.intersect(rays.origins, rays.directions, bare_distance, bare_object); });
  }
  std::size_t different = 0;
  for (std::size_t i = 0; i < count; ++i) different += object[i] != bare_object[i] ? 1 : 0;
  const double rays_millions = static_cast<double>(count) * 1e-6;
  std::printf(
      "{\"case\": \"%s\", \"rays\": %zu, \"threads\": %d, \"ours\": %.3f, \"bare\": %.3f, \"share\": %.4f}\n",
      name, count, thread_count(), rays_millions / ours.seconds, rays_millions / theirs.seconds,
      theirs.processor_seconds / ours.processor_seconds);
  // Rays along an edge may take either side of it.
  if (static_cast<double>(different) > 1e-4 * static_cast<double>(count)) {
    std::fprintf(stderr, "bench_rays: %s: %zu of %zu objects differ\n", name, different, count);
    return false;
  }
  return true;
}

}  // namespace

int main() {
  Scene scene = make_room();
  scene.rectangle_lights.clear();  // the bare loop has objects only
  Material mirror;
  mirror.albedo = glm::vec3(0.0F);
  mirror.specular = true;
  mirror.fresnel.r0 = glm::vec3(0.9F);
  scene.materials.push_back(mirror);
  Object teapot;
  teapot.name = "teapot";
  teapot.mesh = make_teapot();
  teapot.material = static_cast<int>(scene.materials.size()) - 1;
  teapot.part_names = teapot_part_names();
  scene.objects.push_back(std::move(teapot));
  const int reflector = static_cast<int>(scene.objects.size()) - 1;
  TracerOptions options;
  options.indirect = IndirectLight::none;
  const Tracer tracer(scene, options);
  const BareEmbree bare(scene);

  Camera camera;
  camera.eye = {0.12F, 0.18F, 0.26F};
  camera.target = {0.0F, 0.07F, 0.0F};
  camera.width = camera.height = kSide;
  const glm::vec3 forward = glm::normalize(camera.target - camera.eye);
  const glm::vec3 right = glm::normalize(glm::cross(forward, camera.up));
  const glm::vec3 up = glm::cross(right, forward);
  const float slope = std::tan(0.5F * camera.vertical_fov_degrees * 3.14159265F / 180.0F);
  Rays primary;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const float u = (2.0F * (static_cast<float>(x) + 0.5F) / kSide - 1.0F) * slope;
      const float v = (1.0F - 2.0F * (static_cast<float>(y) + 0.5F) / kSide) * slope;
      primary.origins.push_back(camera.eye);
      primary.directions.push_back(glm::normalize(forward + u * right + v * up));
    }
  }
  TraceOptions trace;
  trace.samples_per_pixel = 4;
  const SurfaceSamples seen = tracer.trace_visibility(camera, reflector, trace);
  Rays mirrored;
  Rays diffuse;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const glm::vec3 start = seen.position[i] + 1e-5F * seen.normal[i];
    mirrored.origins.push_back(start);
    mirrored.directions.push_back(glm::normalize(seen.reflection[i]));
    // Uniform on a sphere that touches the surface from above: a cosine distribution.
    const glm::vec2 s = sobol_2d(static_cast<std::uint32_t>(i), 7);
    const float z = 1.0F - 2.0F * s.x;
    const float r = std::sqrt(std::max(0.0F, 1.0F - z * z));
    const glm::vec3 ball(r * std::cos(6.2831853F * s.y), r * std::sin(6.2831853F * s.y), z);
    diffuse.origins.push_back(start);
    diffuse.directions.push_back(glm::normalize(1.0001F * seen.normal[i] + ball));
  }
  bool same = compare("capture and primary rays", tracer, bare, primary);
  same = compare("mirror bounces", tracer, bare, mirrored) && same;
  same = compare("diffuse bounces", tracer, bare, diffuse) && same;
  return same ? 0 : 1;
}
