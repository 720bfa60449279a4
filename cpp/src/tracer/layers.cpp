#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include "camera_rays.hpp"
#include "integrator.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "options.hpp"
#include "primary_rays.hpp"
#include "progress.hpp"
#include "state.hpp"

namespace mirrorbake {
namespace {

using tracing::CameraRays;
using tracing::Hit;
using tracing::LitWorld;
using tracing::PathLimits;
using tracing::PrimaryRow;
using tracing::PrimarySample;
using tracing::Ray;
using tracing::RayKind;
using tracing::RayScene;
using tracing::SampleStream;
using tracing::Surface;
using tracing::World;

/// Calls `task(member)` for every array of SurfaceSamples, in parallel.
template <typename Task>
void for_each_array(const Task& task) {
  using S = SurfaceSamples;
  const auto call = [&](auto... members) {
    const std::array<std::function<void()>, sizeof...(members)> calls{[&task, members] { task(members); }...};
    parallel_for(calls.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) calls[i]();
    });
  };
  call(&S::pixel, &S::part, &S::triangle, &S::barycentric, &S::position, &S::normal, &S::reflection,
       &S::dposition_dx, &S::dposition_dy, &S::dreflection_dx, &S::dreflection_dy, &S::fresnel, &S::albedo,
       &S::diffuse);
}

bool meets(const Hit& hit, int object) { return !hit.missed() && static_cast<int>(hit.geometry) == object; }

/// One image row: its samples in order, and the beauty value of each where light is traced.
struct Row {
  SurfaceSamples samples;
  std::vector<glm::vec3> beauty;
};

/// Moves the rows' arrays one behind the other; `array` picks one out of a row's samples.
template <typename Array>
auto join(std::vector<Row>& rows, const Array& array) {
  std::size_t size = 0;
  for (Row& row : rows) size += array(row.samples).size();
  std::remove_reference_t<decltype(array(rows.front().samples))> whole;
  whole.reserve(size);
  for (Row& row : rows) {
    auto& part = array(row.samples);
    whole.insert(whole.end(), part.begin(), part.end());
    part = {};
  }
  return whole;
}

/// The rows one after the other. Empties them.
SurfaceSamples concatenate(std::vector<Row>& rows, const PixelWindow& window, const TraceOptions& options) {
  SurfaceSamples all;
  all.width = window.width;
  all.height = window.height;
  all.samples_per_pixel = options.samples_per_pixel;
  for_each_array([&](auto member) {
    all.*member = join(
        rows, [member](SurfaceSamples & samples) -> auto& { return samples.*member; });
  });
  all.shells.resize(rows.front().samples.shells.size());
  parallel_for(all.shells.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      ShellLight& shell = all.shells[k];
      shell.name = rows.front().samples.shells[k].name;
      shell.radiance = join(
          rows, [k](SurfaceSamples & s) -> auto& { return s.shells[k].radiance; });
      shell.hit_distance = join(
          rows, [k](SurfaceSamples & s) -> auto& { return s.shells[k].hit_distance; });
    }
  });
  return all;
}

void record_surface(SurfaceSamples& out, const World& world, const Surface& s, float distance,
                    const CameraRays::Direction& ray, std::uint32_t pixel) {
  const std::vector<std::uint16_t>& parts =
      world.scene.objects[static_cast<std::size_t>(s.object)].mesh.parts;
  out.pixel.push_back(pixel);
  out.part.push_back(parts.empty() ? std::uint16_t{0} : parts[s.triangle]);
  out.triangle.push_back(s.triangle);
  out.barycentric.push_back(s.barycentric);
  out.position.push_back(s.position + world.rays.origin());
  out.normal.push_back(s.normal);
  out.reflection.push_back(s.reflection);
  const auto dx = tracing::surface_differential(world.scene, world.rays, s, distance, ray.dx);
  const auto dy = tracing::surface_differential(world.scene, world.rays, s, distance, ray.dy);
  out.dposition_dx.push_back(dx.position);
  out.dposition_dy.push_back(dy.position);
  out.dreflection_dx.push_back(dx.reflection);
  out.dreflection_dy.push_back(dy.reflection);
  out.fresnel.push_back(s.fresnel);
  out.albedo.push_back(s.albedo);
}

/// The light that arrives along a direction of the specular lobe, split by what the ray hits first, with the distance along
/// the direction to what each layer's ray hits.
struct SpecularLayers {
  glm::vec4 local{0.0F};
  glm::vec3 distant{0.0F};
  float local_distance = std::numeric_limits<float>::infinity();
  float distant_distance = std::numeric_limits<float>::infinity();

  glm::vec3 incident() const { return glm::vec3(local) + (1.0F - local.a) * distant; }
};

/// The shells that the layers are recorded as, front to back.
std::vector<ShellLight> default_shells() { return {{"local", {}, {}}, {"distant", {}, {}}}; }

void record_light(SurfaceSamples& out, glm::vec3 body, const SpecularLayers& specular) {
  out.diffuse.push_back(body);
  out.shells[0].radiance.push_back(specular.local);
  out.shells[0].hit_distance.push_back(specular.local_distance);
  out.shells[1].radiance.emplace_back(specular.distant, 1.0F);
  out.shells[1].hit_distance.push_back(specular.distant_distance);
}

/// `lobe` is what next-event estimation found for the lobe.
SpecularLayers trace_specular(const LitWorld& lit, const RayScene::View& without_reflector,
                              const Surface& surface, glm::vec3 lobe, const PathLimits& limits,
                              const SampleStream& stream) {
  const World& world = lit.world;
  SpecularLayers layers;
  layers.distant = lobe;
  const tracing::SpecularBounce bounce = tracing::specular_bounce(surface, stream, 0);
  if (bounce.weight == glm::vec3(0.0F)) return layers;
  const Ray ray{tracing::offset_origin(surface, bounce.direction), bounce.direction};
  Hit hit = world.rays.all().intersect(ray, RayKind::reflection);
  if (meets(hit, surface.object)) {
    const glm::vec3 incident = tracing::radiance(lit, ray, hit, limits, stream, 1, bounce.pdf);
    layers.local = glm::vec4(lobe + bounce.weight * incident, 1.0F);
    layers.local_distance = hit.distance;
    hit = without_reflector.intersect(ray, RayKind::reflection);
  }
  layers.distant += bounce.weight * tracing::radiance(lit, ray, hit, limits, stream, 1, bounce.pdf);
  layers.distant_distance = hit.distance;
  return layers;
}

// From inside a body most directions meet the back of its surface first. Bodies need not be closed (the
// teapot is open under its lid), so this asks for a majority rather than for a parity of crossings.
void check_eye_outside(const World& world, const Camera& camera, int reflector) {
  const glm::vec3 eye = camera.eye - world.rays.origin();
  const Bounds& box = world.rays.object_bounds(reflector);
  if (glm::any(glm::lessThan(eye, box.min)) || glm::any(glm::greaterThan(eye, box.max))) return;
  constexpr int kProbes = 128;
  int backs = 0;
  for (std::uint32_t i = 0; i < kProbes; ++i) {
    const glm::vec2 u = sobol_2d(i, 0);
    const float y = 1.0F - 2.0F * u.x;
    const float radius = std::sqrt(std::max(0.0F, 1.0F - y * y));
    const float angle = 6.2831853F * u.y;
    const Ray ray{eye, glm::normalize(glm::vec3(radius * std::cos(angle), y, radius * std::sin(angle)))};
    const Hit hit = world.rays.all().intersect(ray, RayKind::camera);
    if (hit.missed() || static_cast<int>(hit.geometry) != reflector) continue;
    if (!tracing::surface_at(world.scene, world.rays, hit, ray.direction).front) ++backs;
  }
  if (2 * backs > kProbes) {
    throw InvalidArgument("camera.eye", "inside object " + std::to_string(reflector),
                          "a point outside the reflector");
  }
}

// Sums over the covered samples of a pixel, then their means.
class PixelLayers {
 public:
  void add(const Surface& s, glm::vec3 beauty, glm::vec3 body, const SpecularLayers& specular,
           glm::vec3 position, std::uint16_t part) {
    ++covered_;
    beauty_ += beauty;
    diffuse_ += body;
    fresnel_ += s.fresnel;
    local_ += specular.local;
    distant_ += specular.distant;
    if (std::isfinite(specular.distant_distance)) {
      distance_ += specular.distant_distance;
      ++finite_distances_;
    }
    reflection_ += s.reflection;
    normal_ += s.normal;
    position_ += position;
    parts_.push_back(part);
  }

  /// Writes everything but the beauty, in the order of `channel_names`.
  void write(float* out, int samples) {
    const auto put = [&](const auto& sum) {
      const double share = covered_ > 0 ? 1.0 / covered_ : 0.0;
      for (int i = 0; i < sum.length(); ++i) *out++ = static_cast<float>(sum[i] * share);
    };
    *out++ = static_cast<float>(covered_) / static_cast<float>(samples);
    put(diffuse_);
    put(fresnel_);
    put(local_);
    put(distant_);
    *out++ = covered_ == 0            ? 0.0F
             : finite_distances_ == 0 ? std::numeric_limits<float>::infinity()
                                      : static_cast<float>(distance_ / finite_distances_);
    put(reflection_);
    put(normal_);
    put(position_);
    *out++ = static_cast<float>(most_frequent_part());
    const double share = covered_ > 0 ? 1.0 / covered_ : 0.0;
    const glm::dvec3 of_means =
        diffuse_ + fresnel_ * share * (glm::dvec3(local_) + (1.0 - local_.a * share) * distant_);
    put(beauty_ - of_means);
  }

 private:
  int most_frequent_part() {
    std::sort(parts_.begin(), parts_.end());
    int best = -1;
    std::ptrdiff_t most = 0;
    for (auto p = parts_.begin(); p != parts_.end();) {
      const auto end = std::upper_bound(p, parts_.end(), *p);
      if (end - p > most) {
        most = end - p;
        best = *p;
      }
      p = end;
    }
    return best;
  }

  int covered_ = 0;
  int finite_distances_ = 0;
  double distance_ = 0.0;
  glm::dvec3 beauty_{0.0}, diffuse_{0.0}, fresnel_{0.0}, distant_{0.0}, reflection_{0.0}, normal_{0.0},
      position_{0.0};
  glm::dvec4 local_{0.0};
  std::vector<std::uint16_t> parts_;
};

std::vector<std::string> channel_names() {
  return {"R",
          "G",
          "B",
          "coverage",
          "diffuse.R",
          "diffuse.G",
          "diffuse.B",
          "fresnel.R",
          "fresnel.G",
          "fresnel.B",
          "specular_local.R",
          "specular_local.G",
          "specular_local.B",
          "specular_local.A",
          "specular_distant.R",
          "specular_distant.G",
          "specular_distant.B",
          "distance",
          "reflection.X",
          "reflection.Y",
          "reflection.Z",
          "normal.X",
          "normal.Y",
          "normal.Z",
          "position.X",
          "position.Y",
          "position.Z",
          "part",
          "covariance.R",
          "covariance.G",
          "covariance.B"};
}

void check_reflector(const World& world, const Camera& camera, int reflector) {
  const auto count = static_cast<int>(world.scene.objects.size());
  if (reflector < 0 || reflector >= count) {
    throw InvalidArgument("reflector", std::to_string(reflector),
                          "an object number below " + std::to_string(count));
  }
  const Object& object = world.scene.objects[static_cast<std::size_t>(reflector)];
  if (!world.scene.materials[static_cast<std::size_t>(object.material)].specular) {
    throw InvalidArgument("reflector", "'" + object.name + "'", "an object with a specular material");
  }
  check_eye_outside(world, camera, reflector);
}

/// The samples of row `y` of the window.
auto primary_row(const World& world, const Camera& camera, const CameraRays& rays, const PixelWindow& window,
                 const TraceOptions& options, std::size_t y, std::span<const glm::vec2> places = {}) {
  const glm::vec3 eye = camera.eye - world.rays.origin();
  const tracing::RowSegment segment{
      camera.width, window.y + static_cast<int>(y), window.x, window.width, 0, options.samples_per_pixel,
      places};
  return PrimaryRow(world.rays.all(), options.seed, segment, [eye, &rays](glm::vec2 point) {
    return Ray{eye, rays.direction(point)};
  });
}

void check_places(std::span<const glm::vec2> places) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    const glm::vec2 p = places[i];
    if (p.x >= 0.0F && p.y >= 0.0F && p.x < 1.0F && p.y < 1.0F) continue;
    throw InvalidArgument("places[" + std::to_string(i) + "]", text_of(p), "numbers in [0, 1)");
  }
}

std::uint32_t pixel_number(const PixelWindow& window, std::size_t y, int x) {
  return static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(window.width) +
         static_cast<std::uint32_t>(x);
}

}  // namespace

LayerTrace Tracer::trace_layers(const Camera& camera, int reflector, const TraceOptions& options) const {
  return std::move(trace_layers(camera, {&reflector, 1}, options).front());
}

std::vector<LayerTrace> Tracer::trace_layers(const Camera& camera, std::span<const int> reflectors,
                                             const TraceOptions& options) const {
  const LitWorld& lit = state_->lit;
  const World& world = lit.world;
  validate(camera);
  tracing::validate(options);
  const PixelWindow window = tracing::window_in(options, camera.width, camera.height);
  std::vector<int> number_of_object(world.scene.objects.size(), -1);
  std::vector<RayScene::View> without;
  for (int reflector : reflectors) {
    check_reflector(world, camera, reflector);
    int& number = number_of_object[static_cast<std::size_t>(reflector)];
    if (number >= 0) {
      throw InvalidArgument("reflectors", "object " + std::to_string(reflector) + " twice",
                            "different objects");
    }
    number = static_cast<int>(without.size());
    without.push_back(world.rays.without({&reflector, 1}));
  }
  const CameraRays rays(camera);
  const PathLimits limits{options.max_specular_depth, options.max_diffuse_depth};

  std::vector<LayerTrace> traces(reflectors.size());
  std::vector<std::vector<Row>> rows(reflectors.size());
  for (std::size_t r = 0; r < traces.size(); ++r) {
    traces[r].layers = Image(window.width, window.height, channel_names());
    rows[r].resize(static_cast<std::size_t>(window.height));
    for (Row& row : rows[r]) row.samples.shells = default_shells();
  }
  tracing::ProgressCounter progress(options, static_cast<std::size_t>(window.height));
  parallel_for(static_cast<std::size_t>(window.height), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      auto primary = primary_row(world, camera, rays, window, options, y);
      std::vector<PixelLayers> means;
      for (int x = 0; x < window.width; ++x) {
        glm::dvec3 beauty(0.0);
        means.assign(traces.size(), {});
        for (int i = 0; i < options.samples_per_pixel; ++i) {
          const PrimarySample& sample = primary.next();
          const bool on_object = !sample.hit.missed() && !world.is_light(sample.hit);
          const int number = on_object ? number_of_object[sample.hit.geometry] : -1;
          if (number < 0) {
            beauty +=
                glm::dvec3(tracing::radiance(lit, sample.ray, sample.hit, limits, sample.stream, 0, 0.0F));
            continue;
          }
          const auto r = static_cast<std::size_t>(number);
          const Surface surface =
              tracing::surface_at(world.scene, world.rays, sample.hit, sample.ray.direction);
          const tracing::ScatteredLight scattered =
              tracing::scattered_light(lit, surface, limits, sample.stream, 0);
          const glm::vec3 body = surface.emission + scattered.body;
          const SpecularLayers specular =
              trace_specular(lit, without[r], surface, scattered.lobe, limits, sample.stream);
          const glm::vec3 value = body + surface.fresnel * specular.incident();
          beauty += glm::dvec3(value);
          SurfaceSamples& out = rows[r][y].samples;
          record_surface(out, world, surface, sample.hit.distance,
                         rays.direction_with_differentials(sample.point), pixel_number(window, y, x));
          record_light(out, body, specular);
          rows[r][y].beauty.push_back(value);
          means[r].add(surface, value, body, specular, out.position.back(), out.part.back());
        }
        for (std::size_t r = 0; r < traces.size(); ++r) {
          float* channels = traces[r].layers.at(x, static_cast<int>(y));
          for (int c = 0; c < 3; ++c) channels[c] = static_cast<float>(beauty[c] / options.samples_per_pixel);
          means[r].write(channels + 3, options.samples_per_pixel);
        }
      }
      progress.step();
    }
  });
  for (std::size_t r = 0; r < traces.size(); ++r) {
    traces[r].samples = concatenate(rows[r], window, options);
    traces[r].sample_beauty.reserve(traces[r].samples.size());
    for (const Row& row : rows[r]) {
      traces[r].sample_beauty.insert(traces[r].sample_beauty.end(), row.beauty.begin(), row.beauty.end());
    }
  }
  return traces;
}

SurfaceSamples Tracer::trace_visibility(const Camera& camera, int reflector,
                                        const TraceOptions& trace_options,
                                        std::span<const glm::vec2> places) const {
  const World& world = state_->lit.world;
  validate(camera);
  TraceOptions options = trace_options;
  if (!places.empty()) {
    check_places(places);
    options.samples_per_pixel = static_cast<int>(places.size());
  }
  tracing::validate(options);
  const PixelWindow window = tracing::window_in(options, camera.width, camera.height);
  check_reflector(world, camera, reflector);
  const CameraRays rays(camera);
  std::vector<Row> rows(static_cast<std::size_t>(window.height));
  parallel_for(rows.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      auto primary = primary_row(world, camera, rays, window, options, y, places);
      for (int x = 0; x < window.width; ++x) {
        for (int i = 0; i < options.samples_per_pixel; ++i) {
          const PrimarySample& sample = primary.next();
          if (!meets(sample.hit, reflector)) continue;
          const Surface surface =
              tracing::surface_at(world.scene, world.rays, sample.hit, sample.ray.direction);
          record_surface(rows[y].samples, world, surface, sample.hit.distance,
                         rays.direction_with_differentials(sample.point), pixel_number(window, y, x));
        }
      }
    }
  });
  return concatenate(rows, window, options);
}

}  // namespace mirrorbake
