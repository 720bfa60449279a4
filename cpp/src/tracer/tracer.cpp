#include "mirrorbake/tracer/tracer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "beauty.hpp"
#include "camera_rays.hpp"
#include "integrator.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "options.hpp"
#include "state.hpp"

namespace mirrorbake {
namespace {

using tracing::BeautySums;
using tracing::Hit;
using tracing::Ray;
using tracing::RayKind;

// Embree's own limit is 1.8e18.
constexpr float kLargestCoordinate = 1e18F;

bool usable(glm::vec3 p) {
  return std::abs(p.x) <= kLargestCoordinate && std::abs(p.y) <= kLargestCoordinate &&
         std::abs(p.z) <= kLargestCoordinate;
}

const Scene& validated(const Scene& scene) {
  validate(scene);
  return scene;
}

const TracerOptions& validated(const TracerOptions& options) {
  tracing::check_range("cache_rays", options.cache_rays, 1, 65536);
  tracing::check_range("cache_bounces", options.cache_bounces, 1, 16);
  return options;
}

void check_rays(std::span<const glm::vec3> origins, std::span<const glm::vec3> directions) {
  if (origins.size() != directions.size()) {
    throw InvalidArgument("directions", std::to_string(directions.size()) + " rays",
                          "as many as origins: " + std::to_string(origins.size()));
  }
}

/// Ray number `i` with all checks, its direction made a unit vector. Throws InvalidArgument if it is not usable.
Ray checked_ray(glm::vec3 origin, glm::vec3 direction, std::size_t i, glm::vec3 scene_origin) {
  if (!usable(origin)) {
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

  // Packets take rays through the same nodes: worth it if they start close together and keep together. A look at
  // every fifth will do.
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

namespace tracing {

void check_range(const char* argument, int value, int low, int high) {
  if (value < low || value > high) {
    throw InvalidArgument(argument, std::to_string(value),
                          std::to_string(low) + " to " + std::to_string(high));
  }
}

void check_point(const char* argument, glm::vec3 point) {
  if (!usable(point)) throw InvalidArgument(argument, text_of(point), "finite coordinates up to 1e18");
}

void validate(const TraceOptions& options) {
  check_range("samples_per_pixel", options.samples_per_pixel, 1, 65536);
  check_range("max_specular_depth", options.max_specular_depth, 0, 64);
  check_range("max_diffuse_depth", options.max_diffuse_depth, 0, 64);
}

PixelWindow window_in(const TraceOptions& options, int width, int height) {
  const PixelWindow w = options.window;
  if (w == PixelWindow{}) return {0, 0, width, height};
  const bool inside = w.x >= 0 && w.y >= 0 && w.width > 0 && w.height > 0 && w.width <= width - w.x &&
                      w.height <= height - w.y;
  if (!inside) {
    throw InvalidArgument("window",
                          std::to_string(w.width) + "x" + std::to_string(w.height) + "+" +
                              std::to_string(w.x) + "+" + std::to_string(w.y),
                          "a part of the image of " + std::to_string(width) + "x" + std::to_string(height));
  }
  return w;
}

}  // namespace tracing

Tracer::State::State(Scene scene, const TracerOptions& options)
    : world((validated(scene), std::move(scene)), validated(options)) {
  if (options.indirect == IndirectLight::cached) world.cache = tracing::IrradianceCache(world);
  if (options.indirect == IndirectLight::path) world.guide = tracing::CausticGuide(world);
}

void Tracer::State::check_object(const char* argument, int object) const {
  const auto count = static_cast<int>(world.scene.objects.size());
  if (object < 0 || object >= count) {
    throw InvalidArgument(argument, std::to_string(object),
                          "an object number below " + std::to_string(count));
  }
}

Tracer::Tracer(Scene scene, const TracerOptions& options)
    : state_(std::make_unique<State>(std::move(scene), options)) {}
Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;
Tracer& Tracer::operator=(Tracer&&) noexcept = default;

const Scene& Tracer::scene() const { return state_->world.scene; }

Image Tracer::trace_beauty(const Camera& camera, const TraceOptions& options) const {
  validate(camera);
  tracing::validate(options);
  const tracing::World& world = state_->world;
  const tracing::CameraRays rays(camera);
  const glm::vec3 eye = camera.eye - world.rays.origin();
  const auto ray_through = [&](int, glm::vec2 point) { return Ray{eye, rays.direction(point)}; };
  return tracing::trace_image(world, world.rays.all(), camera.width,
                              tracing::window_in(options, camera.width, camera.height), options, ray_through);
}

BeautyTrace Tracer::trace_beauty_to_noise(const Camera& camera, float noise,
                                          const TraceOptions& options) const {
  validate(camera);
  tracing::validate(options);
  if (!(noise > 0.0F && noise <= 1.0F)) {
    throw InvalidArgument("noise", text_of(noise), "more than 0 and at most 1");
  }
  constexpr int kFirstSamples = 16;
  if (options.samples_per_pixel < kFirstSamples) {
    throw InvalidArgument("samples_per_pixel", std::to_string(options.samples_per_pixel),
                          "at least " + std::to_string(kFirstSamples) + " where the noise decides");
  }
  const tracing::World& world = state_->world;
  const tracing::CameraRays rays(camera);
  const glm::vec3 eye = camera.eye - world.rays.origin();
  const auto ray_through = [&](int, glm::vec2 point) { return Ray{eye, rays.direction(point)}; };
  constexpr int kTileSize = 16;
  BeautySums sums(camera.width, tracing::window_in(options, camera.width, camera.height), kTileSize);

  // Rounds over all tiles, so that which one ends depends neither on the number of threads nor on their order.
  std::vector<std::size_t> open(sums.tile_count());
  std::iota(open.begin(), open.end(), std::size_t{0});
  std::vector<double> relative(sums.tile_count(), 0.0);
  double floor = 0.0;
  for (std::int64_t samples = kFirstSamples; !open.empty(); samples *= 2) {
    const int target = static_cast<int>(std::min<std::int64_t>(samples, options.samples_per_pixel));
    parallel_for(open.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        sums.trace(world, world.rays.all(), options, open[i], target, ray_through);
      }
    });
    if (samples == kFirstSamples) {
      double luminance = 0.0;
      double pixels = 0.0;
      for (std::size_t tile : open) {
        luminance += sums.error(tile).luminance;
        pixels += sums.error(tile).pixels;
      }
      floor = 0.1 * luminance / pixels;
    }
    std::erase_if(open, [&](std::size_t tile) {
      const BeautySums::TileError error = sums.error(tile);
      const double error_of_pixel = std::sqrt(error.squared_error / error.pixels);
      const double scale = std::max(floor, error.luminance / error.pixels);
      relative[tile] = error_of_pixel > 0.0 ? error_of_pixel / scale : 0.0;
      return relative[tile] <= static_cast<double>(noise);
    });
    if (options.progress) {
      options.progress(1.0 - static_cast<double>(open.size()) / static_cast<double>(sums.tile_count()));
    }
    if (target == options.samples_per_pixel) break;
  }

  BeautyTrace trace;
  trace.image = sums.image();
  for (std::size_t tile = 0; tile < sums.tile_count(); ++tile) {
    trace.noise += relative[tile] * relative[tile];
    trace.mean_samples_per_pixel += sums.samples(tile);
  }
  const auto tiles = static_cast<double>(sums.tile_count());
  trace.noise = std::sqrt(trace.noise / tiles);
  trace.mean_samples_per_pixel /= tiles;
  trace.share_above = static_cast<double>(open.size()) / tiles;
  return trace;
}

std::vector<RayHit> Tracer::intersect(std::span<const glm::vec3> origins,
                                      std::span<const glm::vec3> directions,
                                      std::span<const int> hidden) const {
  const tracing::World& world = state_->world;
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
  const tracing::World& world = state_->world;
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
