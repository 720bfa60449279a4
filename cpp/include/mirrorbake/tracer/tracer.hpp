#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "mirrorbake/image/image.hpp"
#include "mirrorbake/scene/scene.hpp"
#include "mirrorbake/tracer/camera.hpp"
#include "mirrorbake/tracer/surface_samples.hpp"

/// Ray tracing with Embree, which stays behind this header.
namespace mirrorbake {

/// Light that reaches a diffuse surface by way of other diffuse surfaces. `none` drops it. `cached` gathers it once
/// per vertex of the static scene and interpolates: noise-free, blurred over a triangle's size, without caustics (the
/// glow of a lamp that a mirror throws on a wall). `path` follows random paths: unbiased, noisy. Direct light
/// is sampled at every point in all three.
enum class IndirectLight { none, cached, path };

struct TracerOptions {
  IndirectLight indirect = IndirectLight::cached;
  /// Gather rays per vertex of the `cached` indirect light, 1…65536; a quarter of them after the first bounce.
  int cache_rays = 64;
  int cache_bounces = 3;   ///< diffuse bounces that `cached` follows, 1…16
  std::uint64_t seed = 0;  ///< of the cache
};

struct TraceOptions {
  int samples_per_pixel = 16;  ///< 1…65536, stratified
  int max_specular_depth = 8;  ///< mirror bounces after the first, 0…64; beyond it the reflection is black
  int max_diffuse_depth = 4;   ///< diffuse bounces of `IndirectLight::path`, 0…64
  std::uint64_t seed = 0;
};

/// The segmented layers of one reflector in one view ([PEM] §3, spec T4), averaged over each pixel: the channels are `R`,
/// `G`, `B` for the beauty image, which has the surroundings too; `coverage`; `diffuse.R` …, `fresnel.R` …,
/// `specular_local.R` … `specular_local.A`, `specular_distant.R` …, `distance`, `reflection.X` …, `normal.X` …,
/// `position.X` …, means over the covered samples, 0 where there are none; and `part`, the most frequent one, −1 for
/// none. `distance` averages the finite ones, and is +inf where all are infinite.
///
/// Per sample, diffuse + fresnel · (local.rgb + (1 − local.a) · distant) is the beauty value up to float
/// rounding; α is 0 or 1. Means lose the covariance of the factors inside a pixel.
struct LayerTrace {
  Image layers;
  SurfaceSamples samples;  ///< with the traced light
  /// Beauty value of each entry of `samples`, by the beauty integrator.
  std::vector<glm::vec3> sample_beauty;
};

/// First hit of a ray. A miss has `distance` = +inf.
struct RayHit {
  float distance = std::numeric_limits<float>::infinity();
  std::int32_t object = -1;  ///< −1: nothing, or a rectangle light
  glm::vec3 normal{0.0F};    ///< unit geometric normal
};

/// A scene made ready for tracing. Construction validates the scene and builds the acceleration structures; all
/// member functions are const and may run from several threads at once. Same arguments give the same bits on any number of threads.
class Tracer {
 public:
  explicit Tracer(Scene scene, const TracerOptions& options = {});
  ~Tracer();
  Tracer(Tracer&&) noexcept;
  Tracer& operator=(Tracer&&) noexcept;

  const Scene& scene() const;

  /// Image of everything, channels R, G, B.
  Image trace_beauty(const Camera& camera, const TraceOptions& options) const;

  /// Layers of the object number `reflector`, whose material must be specular. Throws InvalidArgument for an eye inside
  /// it: in its bounding box, most directions meeting the back of its surface first.
  LayerTrace trace_layers(const Camera& camera, int reflector, const TraceOptions& options) const;

  /// Only what is visible of `reflector`: the geometry part of SurfaceSamples, by the same camera rays as
  /// trace_layers with the same options.
  SurfaceSamples trace_visibility(const Camera& camera, int reflector, const TraceOptions& options) const;

  /// Cube map of the radiance that arrives at `origin`, by rays that pass through the objects in `hidden`. What the rays
  /// show still bears those objects' shadows and reflections, as in the distant layer. Channels R, G, B, face after
  /// face (+X −X +Y −Y +Z −Z) from top to bottom in one image of `size` × 6·`size`.
  Image capture_cube(glm::vec3 origin, int size, std::span<const int> hidden,
                     const TraceOptions& options) const;

  /// First hits of arbitrary rays that pass through the objects in `hidden`. Throws InvalidArgument for a ray that is not finite or has no direction.
  std::vector<RayHit> intersect(std::span<const glm::vec3> origins, std::span<const glm::vec3> directions,
                                std::span<const int> hidden) const;

  /// Irradiance (W m⁻²) on the front at every vertex of an object, all light included, the object itself taking part:
  /// the view-independent diffuse layer. An average over the quarter of each adjacent triangle next to the
  /// vertex, by `rays` (1…65536) samples; 0 at vertices without triangles.
  std::vector<glm::vec3> vertex_irradiance(int object, int rays, std::uint64_t seed) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mirrorbake
