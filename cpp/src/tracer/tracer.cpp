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

std::string text(glm::vec3 v) {
  return "(" + std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z) + ")";
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

/// Ray number `i`, its direction made a unit vector. Throws InvalidArgument if it is not usable.
Ray checked_ray(glm::vec3 origin, glm::vec3 direction, std::size_t i, glm::vec3 scene_origin) {
  const float square = glm::dot(direction, direction);
  if (!usable(origin)) {
    throw InvalidArgument("origins[" + std::to_string(i) + "]", text(origin),
                          "finite coordinates up to 1e18");
  }
  if (square > 1e-20F && square < 1e20F)
    return {origin - scene_origin, direction * (1.0F / std::sqrt(square))};
  // The square of anything else loses digits in float.
  const double length = glm::length(glm::dvec3(direction));
  if (!std::isfinite(length) || length == 0.0) {
    throw InvalidArgument("directions[" + std::to_string(i) + "]", text(direction),
                          "a finite vector other than 0");
  }
  return {origin - scene_origin, glm::vec3(glm::dvec3(direction) / length)};
}

/// Closest hits of any rays, in packets where neighbours resemble each other.
void intersect_many(const tracing::RayScene::View& view, std::span<const Ray> rays, Hit* hits,
                    float scene_radius) {
  // Packets take rays through the same nodes: worth it if they start close together and keep together.
  constexpr float kAlike = 0.9F;
  const float near = 0.05F * scene_radius;
  for (std::size_t i = 0; i < rays.size(); i += tracing::kPacketSize) {
    const auto packet = rays.subspan(i, std::min(tracing::kPacketSize, rays.size() - i));
    // A look at every fifth will do.
    bool is_alike = true;
    for (std::size_t k = 5; k < packet.size(); k += 5) {
      const glm::vec3 apart = packet[k].origin - packet[0].origin;
      is_alike = is_alike && glm::dot(packet[k].direction, packet[0].direction) > kAlike &&
                 glm::dot(apart, apart) < near * near;
    }
    if (is_alike) {
      view.intersect_packet(packet, hits + i, RayKind::camera);
    } else {
      for (std::size_t k = 0; k < packet.size(); ++k)
        hits[i + k] = view.intersect(packet[k], RayKind::camera);
    }
  }
}

/// Calls `record(first, rays, hits)` for chunks of the rays, in parallel.
template <typename Record>
void for_each_hit(const tracing::World& world, std::span<const glm::vec3> origins,
                  std::span<const glm::vec3> directions, std::span<const int> hidden, const Record& record) {
  check_rays(origins, directions);
  const tracing::RayScene::View view = world.rays.without(hidden);
  constexpr std::size_t kChunk = 256;
  parallel_for(origins.size(), 16 * kChunk, [&](std::size_t begin, std::size_t end) {
    std::array<Ray, kChunk> rays;
    std::array<Hit, kChunk> hits;
    for (std::size_t first = begin; first < end; first += kChunk) {
      const std::size_t count = std::min(kChunk, end - first);
      for (std::size_t i = 0; i < count; ++i) {
        rays[i] = checked_ray(origins[first + i], directions[first + i], first + i, world.rays.origin());
      }
      intersect_many(view, {rays.data(), count}, hits.data(), world.rays.radius());
      record(first, std::span<const Ray>(rays.data(), count), hits.data());
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
  if (!usable(point)) throw InvalidArgument(argument, text(point), "finite coordinates up to 1e18");
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
    throw InvalidArgument("noise", std::to_string(noise), "more than 0 and at most 1");
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
               [&](std::size_t first, std::span<const Ray> rays, const Hit* found) {
                 for (std::size_t i = 0; i < rays.size(); ++i) {
                   const Hit& hit = found[i];
                   if (hit.missed()) continue;
                   RayHit& out = hits[first + i];
                   out.distance = hit.distance;
                   out.normal = world.geometric_normal(rays[i], hit);
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
  for_each_hit(world, origins, directions, hidden,
               [&](std::size_t first, std::span<const Ray> rays, const Hit* found) {
                 for (std::size_t i = 0; i < rays.size(); ++i) {
                   distance[first + i] = found[i].distance;
                   object[first + i] = found[i].missed() || world.is_light(found[i])
                                           ? -1
                                           : static_cast<int>(found[i].geometry);
                 }
               });
}

}  // namespace mirrorbake
