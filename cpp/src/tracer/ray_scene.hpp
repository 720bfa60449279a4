#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>
#include <glm/vec3.hpp>

#include "embree_device.hpp"
#include "mirrorbake/scene/scene.hpp"
#include "opacity_filter.hpp"

namespace mirrorbake::tracing {

struct Ray {
  glm::vec3 origin{0.0F};
  glm::vec3 direction{0.0F, 0.0F, 1.0F};  ///< unit
  float max_distance = std::numeric_limits<float>::infinity();
  float min_distance = 0.0F;  ///< of single rays; packets start at their origins
};

/// Kinds of rays that see different sets of objects (Visibility).
enum class RayKind { camera, reflection, shadow };

inline constexpr std::size_t kPacketSize = 16;
inline constexpr std::uint32_t kNoGeometry = RTC_INVALID_GEOMETRY_ID;

struct Hit {
  float distance = std::numeric_limits<float>::infinity();
  /// Object number, or that of a light: object count + rectangle light number, or object count + rectangle
  /// light count + sphere light number.
  std::uint32_t geometry = kNoGeometry;
  std::uint32_t triangle = 0;
  float u = 0.0F;  ///< weight of the triangle's second vertex
  float v = 0.0F;  ///< and of its third

  bool missed() const { return geometry == kNoGeometry; }
};

/// Rays in the form in which Embree takes and answers them.
class RayPacket {
 public:
  RayPacket() {
    for (std::size_t i = 0; i < kPacketSize; ++i) {
      set(i, {});
      query_.ray.tnear[i] = 0.0F;
      query_.ray.time[i] = 0.0F;
      query_.ray.id[i] = 0;
      query_.ray.flags[i] = 0;
      query_.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
  }

  void set(std::size_t i, const Ray& ray) {
    query_.ray.org_x[i] = ray.origin.x;
    query_.ray.org_y[i] = ray.origin.y;
    query_.ray.org_z[i] = ray.origin.z;
    query_.ray.dir_x[i] = ray.direction.x;
    query_.ray.dir_y[i] = ray.direction.y;
    query_.ray.dir_z[i] = ray.direction.z;
    query_.ray.tfar[i] = ray.max_distance;
    query_.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }

  /// Origin and direction.
  Ray ray(std::size_t i) const {
    return {{query_.ray.org_x[i], query_.ray.org_y[i], query_.ray.org_z[i]},
            {query_.ray.dir_x[i], query_.ray.dir_y[i], query_.ray.dir_z[i]}};
  }
  std::uint32_t geometry(std::size_t i) const { return query_.hit.geomID[i]; }
  /// That of the hit; the ray's own, for a miss.
  float distance(std::size_t i) const { return query_.ray.tfar[i]; }
  Hit hit(std::size_t i) const {
    if (geometry(i) == kNoGeometry) return {};
    return {distance(i), geometry(i), query_.hit.primID[i], query_.hit.u[i], query_.hit.v[i]};
  }

 private:
  friend class RayScene;
  alignas(64) RTCRayHit16 query_;
};

/// The scene, which must not go away, in Embree: one geometry per object, then one per rectangle light and
/// per sphere light. Coordinates are relative to `origin`, so that a scene far from the world's origin is
/// traced with the precision of one close to it.
class RayScene {
 public:
  explicit RayScene(const Scene& scene);

  /// What a ray can meet: the scene, or the scene without some objects.
  class View {
   public:
    /// Closest hit. The ray must be finite and its direction a unit vector.
    Hit intersect(const Ray& ray, RayKind kind) const;
    /// Closest hits of up to kPacketSize rays that resemble each other: several times faster than one by one.
    void intersect_packet(std::span<const Ray> rays, Hit* hits, RayKind kind) const;
    /// The same for the packet's first `count` rays, together if they are `alike`, else one by one.
    void intersect(RayPacket& packet, std::size_t count, RayKind kind, bool alike) const;
    /// Whether a shadow ray meets anything.
    bool occluded(const Ray& ray) const;

   private:
    friend class RayScene;
    /// What the rays of one kind can meet.
    struct Visible {
      RTCScene scene = nullptr;
      unsigned mask = ~0U;
      std::shared_ptr<std::remove_pointer_t<RTCScene>> own;  ///< set when a mask could not express it
    };
    const Visible& visible_to(RayKind kind) const { return visible_[static_cast<std::size_t>(kind)]; }

    std::array<Visible, 3> visible_;
  };

  const View& all() const { return all_; }
  View without(std::span<const int> hidden) const;

  glm::vec3 origin() const { return origin_; }
  /// Positions of an object relative to `origin`.
  std::span<const glm::vec3> positions(int object) const {
    return positions_[static_cast<std::size_t>(object)];
  }
  /// Bounds of an object relative to `origin`.
  const Bounds& object_bounds(int object) const { return bounds_[static_cast<std::size_t>(object)]; }
  /// Radius of a sphere around the middle of everything.
  float radius() const { return radius_; }

 private:
  /// `leave_out` holds an entry per object.
  EmbreeScene build(const std::vector<bool>& leave_out) const;

  EmbreeDevice device_;
  std::vector<OpacityLookup> opacity_lookups_;  ///< per object; geometries point to them
  std::vector<EmbreeGeometry> geometries_;
  EmbreeScene scene_;
  std::vector<Visibility> visibility_;  ///< per object
  View all_;
  glm::vec3 origin_{0.0F};
  float radius_ = 0.0F;
  std::vector<std::span<const glm::vec3>> positions_;  ///< memory of the Embree geometries
  std::vector<Bounds> bounds_;
  std::vector<unsigned> mask_bits_;  ///< per geometry
  bool masks_supported_ = false;
  int object_count_ = 0;
};

}  // namespace mirrorbake::tracing
