#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>
#include <glm/vec3.hpp>

#include "embree_device.hpp"
#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake::tracing {

struct Ray {
  glm::vec3 origin{0.0F};
  glm::vec3 direction{0.0F, 0.0F, 1.0F};  ///< unit
  float max_distance = std::numeric_limits<float>::infinity();
};

inline constexpr std::size_t kPacketSize = 16;
inline constexpr std::uint32_t kNoGeometry = RTC_INVALID_GEOMETRY_ID;

struct Hit {
  float distance = std::numeric_limits<float>::infinity();
  std::uint32_t geometry = kNoGeometry;  ///< object number, or object count + rectangle light number
  std::uint32_t triangle = 0;
  float u = 0.0F;  ///< weight of the triangle's second vertex
  float v = 0.0F;  ///< and of its third

  bool missed() const { return geometry == kNoGeometry; }
};

/// The scene's triangles in Embree: one geometry per object, then one per rectangle light. Coordinates are
/// relative to `origin`, so that a scene far from the world's origin is traced with the precision of one
/// close to it.
class RayScene {
 public:
  explicit RayScene(const Scene& scene);

  /// What a ray can meet: the scene, or the scene without some objects.
  class View {
   public:
    /// Closest hit. The ray must be finite and its direction a unit vector.
    Hit intersect(const Ray& ray) const;
    /// Closest hits of up to kPacketSize rays that resemble each other: several times faster than one by one.
    void intersect_packet(std::span<const Ray> rays, Hit* hits) const;
    bool occluded(const Ray& ray) const;

   private:
    friend class RayScene;
    RTCScene scene_ = nullptr;
    unsigned mask_ = ~0U;
    std::shared_ptr<std::remove_pointer_t<RTCScene>>
        own_;  ///< set when the view could not be made with a mask
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
  EmbreeScene build(std::span<const int> hidden) const;

  EmbreeDevice device_;
  std::vector<EmbreeGeometry> geometries_;
  EmbreeScene scene_;
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
