#include "ray_scene.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake::tracing {
namespace {

// Objects beyond the 31st, and the lights, share the last bit of Embree's 32-bit ray masks.
constexpr unsigned kSharedBit = 1U << 31;

// Reflectors are what gets hidden most, and some objects are invisible to some rays: they are the first to
// get a bit of their own.
std::vector<unsigned> assign_mask_bits(const Scene& scene) {
  std::vector<unsigned> bits(scene.objects.size(), kSharedBit);
  const auto rank = [&](const Object& object) {
    if (object.visibility != Visibility::all) return 0;
    return is_specular(scene, object) ? 1 : 2;
  };
  int next = 0;
  for (int wanted = 0; wanted < 3; ++wanted) {
    for (std::size_t i = 0; i < scene.objects.size() && next < 31; ++i) {
      if (rank(scene.objects[i]) == wanted) bits[i] = 1U << next++;
    }
  }
  return bits;
}

constexpr Visibility visibility_bit(RayKind kind) {
  switch (kind) {
    case RayKind::camera: return Visibility::camera;
    case RayKind::reflection: return Visibility::reflection;
    case RayKind::shadow: return Visibility::shadow;
  }
  return Visibility::all;
}

EmbreeGeometry make_geometry(RTCDevice device, std::span<const glm::vec3> positions,
                             std::span<const glm::uvec3> triangles, glm::vec3 origin, unsigned mask,
                             const OpacityLookup* opacity = nullptr) {
  EmbreeGeometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  auto* vertices = static_cast<glm::vec3*>(rtcSetNewGeometryBuffer(
      geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(glm::vec3), positions.size()));
  auto* indices = static_cast<glm::uvec3*>(rtcSetNewGeometryBuffer(
      geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(glm::uvec3), triangles.size()));
  if (vertices == nullptr || indices == nullptr) throw Error("Embree could not allocate a mesh");
  std::transform(positions.begin(), positions.end(), vertices, [&](glm::vec3 p) { return p - origin; });
  std::copy(triangles.begin(), triangles.end(), indices);
  rtcSetGeometryMask(geometry.get(), mask);
  if (opacity != nullptr) set_opacity_filter(device, geometry.get(), *opacity);
  rtcCommitGeometry(geometry.get());
  return geometry;
}

EmbreeGeometry make_ball(RTCDevice device, glm::vec3 centre, float radius) {
  EmbreeGeometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT));
  auto* ball = static_cast<glm::vec4*>(rtcSetNewGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT4, sizeof(glm::vec4), 1));
  if (ball == nullptr) throw Error("Embree could not allocate a sphere");
  *ball = glm::vec4(centre, radius);
  rtcSetGeometryMask(geometry.get(), kSharedBit);
  rtcCommitGeometry(geometry.get());
  return geometry;
}

RTCRay to_embree(const Ray& ray, unsigned mask) {
  RTCRay r;
  r.org_x = ray.origin.x;
  r.org_y = ray.origin.y;
  r.org_z = ray.origin.z;
  r.tnear = ray.min_distance;
  r.dir_x = ray.direction.x;
  r.dir_y = ray.direction.y;
  r.dir_z = ray.direction.z;
  r.time = 0.0F;
  r.tfar = ray.max_distance;
  r.mask = mask;
  r.id = 0;
  r.flags = 0;
  return r;
}

}  // namespace

RayScene::RayScene(const Scene& scene)
    : device_(rtcNewDevice(nullptr)),
      mask_bits_(assign_mask_bits(scene)),
      object_count_(static_cast<int>(scene.objects.size())) {
  if (!device_) throw Error("Embree could not be initialised");
  masks_supported_ = rtcGetDeviceProperty(device_.get(), RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED) != 0;

  glm::vec3 low(std::numeric_limits<float>::max());
  glm::vec3 high(std::numeric_limits<float>::lowest());
  for (const Object& object : scene.objects) {
    bounds_.push_back(bounds(object.mesh));
    visibility_.push_back(object.visibility);
    low = glm::min(low, bounds_.back().min);
    high = glm::max(high, bounds_.back().max);
  }
  std::vector<std::vector<glm::vec3>> light_corners;
  for (const RectangleLight& light : scene.rectangle_lights) {
    const glm::vec3 c = light.corner;
    light_corners.push_back({c, c + light.edge_u, c + light.edge_u + light.edge_v, c + light.edge_v});
    for (glm::vec3 p : light_corners.back()) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
  }
  for (const SphereLight& light : scene.sphere_lights) {
    low = glm::min(low, light.centre - light.radius);
    high = glm::max(high, light.centre + light.radius);
  }
  if (low.x <= high.x) {
    // Scenes around the world's origin keep their coordinates, bit for bit.
    const glm::vec3 centre = 0.5F * low + 0.5F * high;
    const float extent = glm::length(high - low);
    if (glm::length(centre) > extent) origin_ = centre;
    radius_ = 0.5F * extent;
  }
  for (Bounds& b : bounds_) {
    b.min -= origin_;
    b.max -= origin_;
  }

  for (std::uint32_t i = 0; i < scene.objects.size(); ++i) opacity_lookups_.push_back({&scene, i});
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const TriangleMesh& mesh = scene.objects[i].mesh;
    const bool gaps = has_gaps(scene, scene.objects[i]);
    geometries_.push_back(make_geometry(device_.get(), mesh.positions, mesh.triangles, origin_, mask_bits_[i],
                                        gaps ? &opacity_lookups_[i] : nullptr));
    const auto* buffer = static_cast<const glm::vec3*>(
        rtcGetGeometryBufferData(geometries_.back().get(), RTC_BUFFER_TYPE_VERTEX, 0));
    positions_.emplace_back(buffer, mesh.positions.size());
  }
  const glm::uvec3 halves[2] = {{0, 1, 2}, {0, 2, 3}};
  for (const auto& corners : light_corners) {
    geometries_.push_back(make_geometry(device_.get(), corners, halves, origin_, kSharedBit));
  }
  for (const SphereLight& light : scene.sphere_lights) {
    geometries_.push_back(make_ball(device_.get(), light.centre - origin_, light.radius));
  }
  scene_ = build(std::vector<bool>(scene.objects.size(), false));
  all_ = without({});
}

EmbreeScene RayScene::build(const std::vector<bool>& leave_out) const {
  EmbreeScene scene(rtcNewScene(device_.get()));
  // Without ROBUST about 1 ray in 30,000 slips between the triangles of a closed room.
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
  for (std::size_t i = 0; i < geometries_.size(); ++i) {
    if (i < leave_out.size() && leave_out[i]) continue;
    rtcAttachGeometryByID(scene.get(), geometries_[i].get(), static_cast<unsigned>(i));
  }
  rtcCommitScene(scene.get());
  if (rtcGetDeviceError(device_.get()) != RTC_ERROR_NONE) {
    throw Error("Embree could not build its acceleration structure (out of memory?)");
  }
  return scene;
}

RayScene::View RayScene::without(std::span<const int> hidden) const {
  const auto count = static_cast<std::size_t>(object_count_);
  std::vector<bool> is_hidden(count, false);
  for (int object : hidden) {
    if (object < 0 || object >= object_count_) {
      throw InvalidArgument("hidden", std::to_string(object),
                            "object numbers below " + std::to_string(object_count_));
    }
    is_hidden[static_cast<std::size_t>(object)] = true;
  }
  View view;
  std::vector<bool> built_without;
  for (RayKind kind : {RayKind::camera, RayKind::reflection, RayKind::shadow}) {
    View::Visible& visible = view.visible_[static_cast<std::size_t>(kind)];
    visible.scene = scene_.get();
    std::vector<bool> leave_out = is_hidden;
    bool masks_do = true;
    for (std::size_t i = 0; i < count; ++i) {
      if ((visibility_[i] & visibility_bit(kind)) == Visibility::none) leave_out[i] = true;
      if (!leave_out[i]) continue;
      visible.mask &= ~mask_bits_[i];
      masks_do = masks_do && masks_supported_ && mask_bits_[i] != kSharedBit;
    }
    if (masks_do) continue;
    visible.mask = ~0U;
    // The kinds of rays mostly see the same.
    const View::Visible* previous = kind == RayKind::camera ? nullptr : &visible - 1;
    if (previous != nullptr && previous->own && built_without == leave_out) {
      visible = *previous;
    } else {
      visible.own = std::shared_ptr<std::remove_pointer_t<RTCScene>>(build(leave_out));
      visible.scene = visible.own.get();
      built_without = leave_out;
    }
  }
  return view;
}

Hit RayScene::View::intersect(const Ray& ray, RayKind kind) const {
  const Visible& visible = visible_to(kind);
  RTCRayHit query;
  query.ray = to_embree(ray, visible.mask);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  intersect1(visible.scene, query);
  Hit hit;
  if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
    hit = {query.ray.tfar, query.hit.geomID, query.hit.primID, query.hit.u, query.hit.v};
  }
  return hit;
}

void RayScene::View::intersect_packet(std::span<const Ray> rays, Hit* hits, RayKind kind) const {
  RayPacket packet;
  for (std::size_t i = 0; i < rays.size(); ++i) packet.set(i, rays[i]);
  intersect(packet, rays.size(), kind, true);
  for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = packet.hit(i);
}

void RayScene::View::intersect(RayPacket& packet, std::size_t count, RayKind kind, bool alike) const {
  const Visible& visible = visible_to(kind);
  RTCRayHit16& query = packet.query_;
  if (!alike) {
    for (std::size_t i = 0; i < count; ++i) {
      const Hit hit = intersect(packet.ray(i), kind);
      query.ray.tfar[i] = hit.distance;
      query.hit.geomID[i] = hit.geometry;
      query.hit.primID[i] = hit.triangle;
      query.hit.u[i] = hit.u;
      query.hit.v[i] = hit.v;
    }
    return;
  }
  alignas(64) int valid[kPacketSize];
  for (std::size_t i = 0; i < kPacketSize; ++i) {
    valid[i] = i < count ? -1 : 0;
    query.ray.mask[i] = visible.mask;
  }
  intersect16(valid, visible.scene, query);
}

bool RayScene::View::occluded(const Ray& ray) const {
  const Visible& visible = visible_to(RayKind::shadow);
  RTCRay query = to_embree(ray, visible.mask);
  occluded1(visible.scene, query);
  return query.tfar < 0.0F;
}

}  // namespace mirrorbake::tracing
