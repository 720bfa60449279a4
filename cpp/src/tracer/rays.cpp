#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>
#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "options.hpp"
#include "state.hpp"

namespace mirrorbake {
namespace {

using tracing::Hit;
using tracing::kLargestCoordinate;
using tracing::Ray;
using tracing::RayKind;

void check_rays(std::span<const glm::vec3> origins, std::span<const glm::vec3> directions) {
  if (origins.size() != directions.size()) {
    throw InvalidArgument("directions", std::to_string(directions.size()) + " rays",
                          "as many as origins: " + std::to_string(origins.size()));
  }
}

/// Ray number `i` with all checks, its direction made a unit vector. Throws InvalidArgument if it is not
/// usable.
Ray checked_ray(glm::vec3 origin, glm::vec3 direction, std::size_t i, glm::vec3 scene_origin) {
  if (!tracing::usable(origin)) {
    throw InvalidArgument("origins[" + std::to_string(i) + "]", text_of(origin),
                          "finite coordinates up to 1e18");
  }
  // The squares of very short and very long vectors lose digits in float.
  const double length = glm::length(glm::dvec3(direction));
  if (!std::isfinite(length) || length == 0.0) {
    throw InvalidArgument("directions[" + std::to_string(i) + "]", text_of(direction),
                          "a finite vector other than 0");
  }
  return {origin - scene_origin, glm::vec3(glm::dvec3(direction) / length)};
}

/// Rays straight from the caller's arrays to Embree's packet and their hits back.
class RayBatch {
 public:
  RayBatch(const tracing::RayScene& scene, const tracing::RayScene::View& view)
      : view_(view), origin_(scene.origin()), near_(0.05F * scene.radius()) {}

  /// Traces rays `first` … of the arrays, up to a packet of them. Returns how many.
  std::size_t trace(std::span<const glm::vec3> origins, std::span<const glm::vec3> directions,
                    std::size_t first) {
    count_ = std::min(tracing::kPacketSize, origins.size() - first);
    if (!load(&origins[first], &directions[first])) {
      for (std::size_t i = 0; i < count_; ++i)
        packet_.set(i, checked_ray(origins[first + i], directions[first + i], first + i, origin_));
    }
    view_.intersect(packet_, count_, RayKind::camera, are_alike());
    return count_;
  }

  const tracing::RayPacket& packet() const { return packet_; }

 private:
  // The common case, without a branch. False if any ray needs a closer look.
  bool load(const glm::vec3* origins, const glm::vec3* directions) {
    bool ordinary = true;
    for (std::size_t i = 0; i < count_; ++i) {
      const glm::vec3 o = origins[i];
      const glm::vec3 d = directions[i];
      const float square = glm::dot(d, d);
      const float scale = 1.0F / std::sqrt(square);
      packet_.set(i, {o - origin_, d * scale});
      const float largest = std::max(std::abs(o.x), std::max(std::abs(o.y), std::abs(o.z)));
      const float sum = std::abs(o.x) + std::abs(o.y) + std::abs(o.z);  // NaN if any is
      ordinary =
          ordinary & (largest <= kLargestCoordinate) & (sum >= 0.0F) & (square > 1e-20F) & (square < 1e20F);
    }
    return ordinary;
  }

  // Packets take rays through the same nodes: worth it if they start close together and keep together. A look
  // at every fifth will do.
  bool are_alike() const {
    constexpr float kAlike = 0.9F;
    const Ray start = packet_.ray(0);
    for (std::size_t k = 5; k < count_; k += 5) {
      const Ray other = packet_.ray(k);
      const glm::vec3 apart = other.origin - start.origin;
      if (!(glm::dot(other.direction, start.direction) > kAlike && glm::dot(apart, apart) < near_ * near_))
        return false;
    }
    return true;
  }

  const tracing::RayScene::View& view_;
  glm::vec3 origin_;
  float near_;
  std::size_t count_ = 0;
  tracing::RayPacket packet_;
};

/// Calls `record(first, count, packet)` for packets of the rays, in parallel.
template <typename Record>
void for_each_hit(const tracing::World& world, std::span<const glm::vec3> origins,
                  std::span<const glm::vec3> directions, std::span<const int> hidden, const Record& record) {
  check_rays(origins, directions);
  const tracing::RayScene::View view = world.rays.without(hidden);
  parallel_for(origins.size(), 4096, [&](std::size_t begin, std::size_t end) {
    RayBatch batch(world.rays, view);
    for (std::size_t first = begin; first < end;) {
      const std::size_t count = batch.trace(origins.first(end), directions, first);
      record(first, count, batch.packet());
      first += count;
    }
  });
}

}  // namespace

std::vector<RayHit> Tracer::intersect(std::span<const glm::vec3> origins,
                                      std::span<const glm::vec3> directions,
                                      std::span<const int> hidden) const {
  const tracing::World& world = state_->lit.world;
  std::vector<RayHit> hits(origins.size());
  for_each_hit(world, origins, directions, hidden,
               [&](std::size_t first, std::size_t count, const tracing::RayPacket& packet) {
                 for (std::size_t i = 0; i < count; ++i) {
                   const Hit hit = packet.hit(i);
                   if (hit.missed()) continue;
                   RayHit& out = hits[first + i];
                   out.distance = hit.distance;
                   out.normal = world.geometric_normal(packet.ray(i), hit);
                   if (!world.is_light(hit)) out.object = static_cast<int>(hit.geometry);
                 }
               });
  return hits;
}

void Tracer::intersect(std::span<const glm::vec3> origins, std::span<const glm::vec3> directions,
                       std::span<const int> hidden, std::span<float> distance,
                       std::span<std::int32_t> object) const {
  for (const auto& [name, size] :
       {std::pair{"distance", distance.size()}, std::pair{"object", object.size()}}) {
    if (size != origins.size()) {
      throw InvalidArgument(name, std::to_string(size) + " entries",
                            "as many as origins: " + std::to_string(origins.size()));
    }
  }
  const tracing::World& world = state_->lit.world;
  const auto objects = static_cast<std::uint32_t>(world.scene.objects.size());
  for_each_hit(world, origins, directions, hidden,
               [&](std::size_t first, std::size_t count, const tracing::RayPacket& packet) {
                 float* to_distance = &distance[first];
                 std::int32_t* to_object = &object[first];
                 for (std::size_t i = 0; i < count; ++i) {
                   const std::uint32_t geometry = packet.geometry(i);
                   to_distance[i] = packet.distance(i);
                   to_object[i] = geometry < objects ? static_cast<std::int32_t>(geometry) : -1;
                 }
               });
}

}  // namespace mirrorbake
