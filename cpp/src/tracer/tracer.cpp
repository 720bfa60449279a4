#include "mirrorbake/tracer/tracer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "camera_rays.hpp"
#include "integrator.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/projection/cube.hpp"
#include "options.hpp"
#include "primary_rays.hpp"
#include "state.hpp"

namespace mirrorbake {
namespace {

using tracing::Hit;
using tracing::Ray;

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

/// Beauty values along `ray_through(row, point)`, the rays passing through what `view` leaves out.
template <typename RayThrough>
Image trace_image(const tracing::World& world, const tracing::RayScene::View& view, int width, int height,
                  const TraceOptions& options, const RayThrough& ray_through) {
  const tracing::PathLimits limits{options.max_specular_depth, options.max_diffuse_depth};
  Image image(width, height, {"R", "G", "B"});
  parallel_for(static_cast<std::size_t>(height), 1, [&](std::size_t begin, std::size_t end) {
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      tracing::PrimaryRow row(view, options.seed, width, options.samples_per_pixel, y,
                              [&](glm::vec2 point) { return ray_through(y, point); });
      for (int x = 0; x < width; ++x) {
        glm::dvec3 sum(0.0);
        for (int i = 0; i < options.samples_per_pixel; ++i) {
          const tracing::PrimarySample& s = row.next();
          sum += glm::dvec3(tracing::radiance(world, s.ray, s.hit, limits, s.stream, 0));
        }
        const glm::vec3 mean(sum / static_cast<double>(options.samples_per_pixel));
        std::copy_n(&mean.x, 3, image.at(x, y));
      }
    }
  });
  return image;
}

}  // namespace

namespace tracing {

void check_range(const char* argument, int value, int low, int high) {
  if (value < low || value > high) {
    throw InvalidArgument(argument, std::to_string(value),
                          std::to_string(low) + " to " + std::to_string(high));
  }
}

void validate(const TraceOptions& options) {
  check_range("samples_per_pixel", options.samples_per_pixel, 1, 65536);
  check_range("max_specular_depth", options.max_specular_depth, 0, 64);
  check_range("max_diffuse_depth", options.max_diffuse_depth, 0, 64);
}

}  // namespace tracing

Tracer::State::State(Scene scene, const TracerOptions& options)
    : world((validated(scene), std::move(scene)), validated(options)) {
  if (options.indirect == IndirectLight::cached) world.cache = tracing::IrradianceCache(world);
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
  return trace_image(world, world.rays.all(), camera.width, camera.height, options, ray_through);
}

Image Tracer::capture_cube(glm::vec3 origin, int size, std::span<const int> hidden,
                           const TraceOptions& options) const {
  tracing::check_range("size", size, 1, 16384);
  tracing::validate(options);
  if (!usable(origin)) throw InvalidArgument("origin", text(origin), "finite coordinates up to 1e18");
  const tracing::World& world = state_->world;
  const tracing::RayScene::View view = world.rays.without(hidden);
  const glm::vec3 eye = origin - world.rays.origin();
  const auto ray_through = [&](int row, glm::vec2 point) {
    // Rows count through all faces.
    const int face = row / size;
    const glm::vec2 place = (point - glm::vec2(0, face * size)) / static_cast<float>(size);
    return Ray{eye, glm::normalize(direction_from_cube(face, place.x, place.y))};
  };
  return trace_image(world, view, size, 6 * size, options, ray_through);
}

std::vector<RayHit> Tracer::intersect(std::span<const glm::vec3> origins,
                                      std::span<const glm::vec3> directions,
                                      std::span<const int> hidden) const {
  if (origins.size() != directions.size()) {
    throw InvalidArgument("directions", std::to_string(directions.size()) + " rays",
                          "as many as origins: " + std::to_string(origins.size()));
  }
  for (std::size_t i = 0; i < origins.size(); ++i) {
    const std::string number = "[" + std::to_string(i) + "]";
    if (!usable(origins[i]))
      throw InvalidArgument("origins" + number, text(origins[i]), "finite coordinates up to 1e18");
    const double length = glm::length(glm::dvec3(directions[i]));
    if (!std::isfinite(length) || length == 0.0) {
      throw InvalidArgument("directions" + number, text(directions[i]), "a finite vector other than 0");
    }
  }
  const tracing::World& world = state_->world;
  const tracing::RayScene::View view = world.rays.without(hidden);
  std::vector<RayHit> hits(origins.size());
  parallel_for(origins.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Ray ray{origins[i] - world.rays.origin(), glm::vec3(glm::normalize(glm::dvec3(directions[i])))};
      const Hit hit = view.intersect(ray);
      if (hit.missed()) continue;
      hits[i].distance = hit.distance;
      if (world.is_light(hit)) {
        const RectangleLight& light =
            world.scene.rectangle_lights[static_cast<std::size_t>(world.light_number(hit))];
        hits[i].normal =
            glm::vec3(glm::normalize(glm::cross(glm::dvec3(light.edge_u), glm::dvec3(light.edge_v))));
      } else {
        const tracing::Surface surface = tracing::surface_at(world.scene, world.rays, hit, ray.direction);
        hits[i].object = surface.object;
        hits[i].normal = surface.front ? surface.geometric_normal : -surface.geometric_normal;
      }
    }
  });
  return hits;
}

}  // namespace mirrorbake
