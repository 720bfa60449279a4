#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/image/image.hpp"
#include "mirrorbake/projection/projection.hpp"
#include "mirrorbake/scene/scene.hpp"
#include "mirrorbake/surface/surface_samples.hpp"
#include "mirrorbake/tracer/camera.hpp"
#include "mirrorbake/tracer/shell_rule.hpp"

/// Ray tracing with Embree, which stays behind this header.
namespace mirrorbake {

/// Light that reaches a diffuse surface by way of other diffuse surfaces. `none` drops it. `cached` gathers
/// it once per vertex of the static scene and interpolates: free of noise, blurred over a triangle's size,
/// caustics too (the glow of a lamp that a mirror throws on a wall). `path` follows random paths: unbiased,
/// noisy. Direct light is sampled at every point in all three.
enum class IndirectLight { none, cached, path };

template <>
struct EnumNames<IndirectLight> {
  static constexpr std::string_view what = "indirect";
  static constexpr auto names = enum_names("none", "cached", "path");
};

struct TracerOptions {
  IndirectLight indirect = IndirectLight::cached;
  /// Gather rays per vertex of the `cached` indirect light, 1…65536; a sixth of them after the first
  /// bounce, one to sixteen times as many for caustics, the brighter the more. Of an object of more than
  /// 16384 vertices each takes a share, down to a fifth, and shares its neighbours'.
  int cache_rays = 96;
  int cache_bounces = 6;   ///< diffuse bounces that `cached` follows, 1…16
  std::uint64_t seed = 0;  ///< of the cache
  /// Object that mirrors what is close to it: around it the cache has more points than the vertices of other
  /// objects, a fourteenth of their distance from it apart. Less than 0: none.
  int focus = -1;
};

/// A rectangle of an image, in pixels from its top left corner.
struct PixelWindow {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;

  bool operator==(const PixelWindow&) const = default;
};

/// The front of a triangle is where its corners are counter-clockwise.
enum class SurfaceSide { front, back };

template <>
struct EnumNames<SurfaceSide> {
  static constexpr std::string_view what = "side";
  static constexpr auto names = enum_names("front", "back");
};

struct TraceOptions {
  int samples_per_pixel = 16;  ///< 1…65536, stratified
  int max_specular_depth = 8;  ///< specular bounces after the first, 0…64; beyond it the reflection is black
  int max_diffuse_depth = 4;   ///< diffuse bounces of `IndirectLight::path`, 0…64
  std::uint64_t seed = 0;
  /// The part of the camera's image to trace, its pixels as in the whole image; of no size: everything.
  PixelWindow window;
  /// More than 0: trace_layers takes more samples where the reflectors are noisy, a power of two times
  /// samples_per_pixel, for a standard error of this much of a pixel's displayed value (sRGB, 0…1), at most
  /// most_samples_per_pixel. How many a pixel takes is decided by the eight around it alone, which keeps its
  /// mean unbiased. samples_per_pixel must then be a multiple of 4. In [0, 1].
  float noise = 0.0F;
  int most_samples_per_pixel = 256;  ///< 1…65536
  /// How trace_layers splits the incident light, front to back; 1 to kMostShells.
  std::vector<ShellRule> shells = default_shell_rules();
  /// Called with the finished share of the work, in (0,1], from one thread at a time.
  std::function<void(double)> progress;
};

/// An image that was traced until its noise was below a limit.
struct BeautyTrace {
  Image image;  ///< channels R, G, B
  /// Standard error of a pixel's luminance relative to the luminance, root mean square over the image's tiles
  /// as the limit is applied to each.
  double noise = 0.0;
  double mean_samples_per_pixel = 0.0;
  double share_above = 0.0;  ///< of the tiles that samples_per_pixel ended before they reached the limit
};

/// The segmented layers of one reflector in one view ([PEM] §3, spec T4), averaged over each pixel: the
/// channels are `R`, `G`, `B` for the beauty image, which has the surroundings too; `coverage`; `diffuse.R`
/// …, `fresnel.R` …, `specular_local.R` … `specular_local.A`, `specular_distant.R` … (by the names of the
/// shells, the last without α), `distance`, `reflection.X` …, `normal.X` …, `position.X` … in the scene,
/// means over the covered samples, 0 where there are none; `part`, the most frequent one, −1 for none;
/// `covariance.R` …; and `background.R` …, the part of the beauty image that comes from other things than the
/// reflector. `distance`, of the last shell, averages the finite ones, and is +inf where all are infinite.
///
/// A shell holds what the ray meets first of its own kind, with the kinds of the shells before it left out.
/// Per sample, diffuse + fresnel · (L₀ + (1 − α₀)(L₁ + (1 − α₁)(…))) over the shells is the beauty value up
/// to float rounding; α is 0 or 1. Means lose the covariance of the factors inside a pixel: `covariance` is
/// what has to be added to the same sum of means to get the mean beauty of the covered samples.
///
/// A rough reflector takes one direction of its lobe per sample. Its incident radiance is multiplied with the
/// lobe's response for F = 1 over the direction's density, and with the Fresnel term of the facet over
/// `fresnel`, which is that of the surface (spec T5). Lights that next-event estimation finds for the lobe
/// are shared between the two ways by multiple importance sampling: the light's part is added to the last
/// shell, and to the others where α is 1.
struct LayerTrace {
  Image layers;
  SurfaceSamples samples;  ///< with the traced light
  /// Beauty value of each entry of `samples`: what the layers add up to.
  std::vector<glm::vec3> sample_beauty;
  /// Per pixel: squared standard error of the displayed value (sRGB, 0…1, mean of the channels) of the
  /// covered samples' mean, estimated from how much four quarters of them differ; what the strata gain beyond
  /// that it does not know.
  std::vector<float> display_variance;
};

/// First hit of a ray. A miss has `distance` = +inf.
struct RayHit {
  float distance = std::numeric_limits<float>::infinity();
  std::int32_t object = -1;  ///< −1: nothing, or a light
  glm::vec3 normal{0.0F};    ///< unit geometric normal
};

/// A scene made ready for tracing. Construction validates the scene and builds the acceleration structures;
/// all member functions are const and may run from several threads at once. Same arguments give the same bits
/// on any number of threads.
class Tracer {
 public:
  explicit Tracer(Scene scene, const TracerOptions& options = {});
  ~Tracer();
  Tracer(Tracer&&) noexcept;
  Tracer& operator=(Tracer&&) noexcept;

  const Scene& scene() const;

  /// The same scene with an object cut into other parts: that of every triangle, and what Object says of
  /// them. What was gathered is kept, so this is much faster than a new tracer. Throws InvalidArgument where
  /// a triangle would have another material.
  Tracer with_parts(int object, std::vector<std::uint16_t> parts, std::vector<std::string> part_names,
                    std::vector<int> part_materials) const;

  /// Image of everything, channels R, G, B.
  Image trace_beauty(const Camera& camera, const TraceOptions& options) const;

  /// The same with as many samples as each tile of 16² pixels needs: 16, 32, 64 … until the standard error of
  /// its pixels, root mean square, is at most `noise` (in (0, 1]) times the tile's mean luminance, or a tenth
  /// of the image's where that is more; samples_per_pixel is the most it takes. The error is that of
  /// independent samples, which the stratified ones undercut. What a tile has missed so far it cannot know
  /// of: rare bright paths are underestimated where it ends early.
  BeautyTrace trace_beauty_to_noise(const Camera& camera, float noise, const TraceOptions& options) const;

  /// What the eye's rays meet first, channels `A` (coverage by objects), `Z` (depth along the view's axis in
  /// metres, +inf where there is nothing), `normal.X` …, `position.X` …, `albedo.R` …, means over the covered
  /// samples, and `object`, the number most samples have, −1 for none. By the same rays as trace_beauty with
  /// the same options.
  Image trace_geometry(const Camera& camera, const TraceOptions& options) const;

  /// Layers of the object number `reflector`, whose material must be specular. Throws InvalidArgument for an
  /// eye that it encloses().
  LayerTrace trace_layers(const Camera& camera, int reflector, const TraceOptions& options) const;

  /// The same for several reflectors, all different, which share the rays from the eye: one LayerTrace each,
  /// with the same bits as alone but for the roundings of the beauty image.
  std::vector<LayerTrace> trace_layers(const Camera& camera, std::span<const int> reflectors,
                                       const TraceOptions& options) const;

  /// Only what is visible of `reflector`: the geometry part of SurfaceSamples, by the same camera rays as
  /// trace_layers with the same options. With `places`, numbers in [0, 1) from the pixel's top left corner,
  /// the rays go through those places of every pixel instead, as a renderer's lookups do, and there are as
  /// many samples.
  SurfaceSamples trace_visibility(const Camera& camera, int reflector, const TraceOptions& options,
                                  std::span<const glm::vec2> places = {}) const;

  /// The radiance that arrives at `origin`, as an environment map (spec T2): rays straight through the texels
  /// of the projection, which pass through the objects in `hidden`. What the rays show still bears those
  /// objects' shadows and reflections, as in the distant layer. A texel is the mean over its area in the map;
  /// beyond the rim of round maps the projection goes on, as in resample(). Channels R, G, B, faces of width
  /// × height texels one below the other in one image, in the order of EnvMapLayout. Throws InvalidArgument
  /// for sides outside 1…16384, or a cube that is not square.
  Image capture(glm::vec3 origin, const Projection& projection, int width, int height,
                std::span<const int> hidden, const TraceOptions& options) const;

  /// capture() as a cube map: one image of `size` × 6·`size`.
  Image capture_cube(glm::vec3 origin, int size, std::span<const int> hidden,
                     const TraceOptions& options) const;

  /// First hits of arbitrary rays that pass through the objects in `hidden`. Throws InvalidArgument for a ray
  /// that is not finite or has no direction.
  std::vector<RayHit> intersect(std::span<const glm::vec3> origins, std::span<const glm::vec3> directions,
                                std::span<const int> hidden) const;

  /// The same into arrays of the rays' size, without normals: for those who have many rays. `object` is −1
  /// for a miss and for a light.
  void intersect(std::span<const glm::vec3> origins, std::span<const glm::vec3> directions,
                 std::span<const int> hidden, std::span<float> distance,
                 std::span<std::int32_t> object) const;

  /// Irradiance (W m⁻²) on one side at every vertex of an object, all light included, the object itself
  /// taking part: the view-independent diffuse layer. An average over the quarter of each adjacent triangle
  /// next to the vertex, by `rays` (1…65536) samples; 0 at vertices without triangles, and on a back that
  /// the first 64 find without light.
  std::vector<glm::vec3> vertex_irradiance(int object, int rays, std::uint64_t seed,
                                           SurfaceSide side = SurfaceSide::front) const;

  /// The same at points of the surface, each alone: `barycentric` are the weights of the second and third
  /// vertex of `triangles`. 0 on triangles without area.
  std::vector<glm::vec3> surface_irradiance(int object, std::span<const std::uint32_t> triangles,
                                            std::span<const glm::vec2> barycentric, int rays,
                                            std::uint64_t seed, SurfaceSide side = SurfaceSide::front) const;

 private:
  struct State;
  explicit Tracer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace mirrorbake
