#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <glm/geometric.hpp>

#include "camera_rays.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "options.hpp"
#include "primary_rays.hpp"
#include "state.hpp"

namespace mirrorbake {
namespace {

// Sums over the samples of a pixel that meet an object.
struct PixelGeometry {
  int hits = 0;
  double depth = 0.0;
  glm::dvec3 normal{0.0}, position{0.0}, albedo{0.0};
  std::map<int, int> objects;  // samples per object

  void write(float* out, int samples) const {
    const double share = hits > 0 ? 1.0 / hits : 0.0;
    *out++ = static_cast<float>(hits) / static_cast<float>(samples);
    *out++ = hits > 0 ? static_cast<float>(depth * share) : std::numeric_limits<float>::infinity();
    for (const glm::dvec3& sum : {normal, position, albedo}) {
      for (int c = 0; c < 3; ++c) *out++ = static_cast<float>(sum[c] * share);
    }
    const auto most = std::max_element(objects.begin(), objects.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    *out = most == objects.end() ? -1.0F : static_cast<float>(most->first);
  }
};

}  // namespace

Image Tracer::trace_geometry(const Camera& camera, const TraceOptions& options) const {
  using namespace tracing;  // NOLINT: this function is all about it
  mirrorbake::validate(camera);
  tracing::validate(options);
  const World& world = state_->lit.world;
  const PixelWindow window = window_in(options, camera.width, camera.height);
  const CameraRays rays(camera);
  const glm::vec3 eye = camera.eye - world.rays.origin();
  const glm::vec3 axis = glm::normalize(camera.target - camera.eye);
  Image image(window.width, window.height,
              {"A", "Z", "normal.X", "normal.Y", "normal.Z", "position.X", "position.Y", "position.Z",
               "albedo.R", "albedo.G", "albedo.B", "object"});
  parallel_for(static_cast<std::size_t>(window.height), 1, [&](std::size_t begin, std::size_t end) {
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      const RowSegment segment{
          camera.width, window.y + y, window.x, window.width, 0, options.samples_per_pixel};
      PrimaryRow row(world.rays.all(), options.seed, segment, [&](glm::vec2 point) {
        return Ray{eye, rays.direction(point)};
      });
      for (int x = 0; x < window.width; ++x) {
        PixelGeometry pixel;
        for (int i = 0; i < options.samples_per_pixel; ++i) {
          const PrimarySample& sample = row.next();
          if (sample.hit.missed() || world.is_light(sample.hit)) continue;
          const Surface surface = surface_at(world.scene, world.rays, sample.hit, sample.ray.direction);
          ++pixel.hits;
          pixel.depth += static_cast<double>(sample.hit.distance * glm::dot(sample.ray.direction, axis));
          pixel.normal += glm::dvec3(surface.normal);
          pixel.position += glm::dvec3(surface.position + world.rays.origin());
          pixel.albedo += glm::dvec3(surface.albedo);
          ++pixel.objects[surface.object];
        }
        pixel.write(image.at(x, y), options.samples_per_pixel);
      }
    }
  });
  return image;
}

}  // namespace mirrorbake
