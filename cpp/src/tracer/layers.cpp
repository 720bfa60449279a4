#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>
#include <glm/vec3.hpp>

#include "camera_rays.hpp"
#include "integrator.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/interrupt.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "options.hpp"
#include "pixel_layers.hpp"
#include "primary_rays.hpp"
#include "progress.hpp"
#include "sample_rows.hpp"
#include "shell_rays.hpp"
#include "state.hpp"

namespace mirrorbake {
namespace {

using tracing::CameraRays;
using tracing::Hit;
using tracing::IncidentShells;
using tracing::LitWorld;
using tracing::PathLimits;
using tracing::PixelLayers;
using tracing::PrimaryRow;
using tracing::PrimarySample;
using tracing::Ray;
using tracing::Row;
using tracing::ShellRays;
using tracing::Surface;
using tracing::World;

bool meets(const Hit& hit, int object) { return !hit.missed() && static_cast<int>(hit.geometry) == object; }

void check_reflector(const World& world, const Camera& camera, int reflector) {
  const auto count = static_cast<int>(world.scene.objects.size());
  if (reflector < 0 || reflector >= count) {
    throw InvalidArgument("reflector", std::to_string(reflector),
                          "an object number below " + std::to_string(count));
  }
  const Object& object = world.scene.objects[static_cast<std::size_t>(reflector)];
  if (!is_specular(world.scene, object)) {
    throw InvalidArgument("reflector", "'" + object.name + "'", "an object with a specular material");
  }
  if (encloses(object.mesh, glm::dvec3(camera.eye))) {
    throw InvalidArgument("camera.eye", "inside object " + std::to_string(reflector),
                          "a point outside the reflector");
  }
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

/// One call of trace_layers.
class LayerTracer {
 public:
  LayerTracer(const LitWorld& lit, const Camera& camera, const PixelWindow& window,
              const TraceOptions& options, std::span<const int> reflectors)
      : lit_(lit),
        camera_(camera),
        rays_(camera),
        window_(window),
        options_(options),
        limits_{options.max_specular_depth, options.max_diffuse_depth},
        number_of_object_(lit.world.scene.objects.size(), -1),
        traces_(reflectors.size()),
        rows_(reflectors.size()) {
    for (std::size_t r = 0; r < reflectors.size(); ++r) {
      number_of_object_[static_cast<std::size_t>(reflectors[r])] = static_cast<int>(r);
      shell_rays_.emplace_back(lit.world, options.shells, reflectors[r]);
      traces_[r].layers = Image(window.width, window.height, tracing::layer_channels(options.shells));
      const std::size_t pixels =
          static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
      traces_[r].display_variance.resize(pixels);
      rows_[r].resize(static_cast<std::size_t>(window.height));
      for (Row& row : rows_[r]) {
        for (const ShellRule& shell : options.shells) row.samples.shells.push_back({shell.name, {}, {}});
      }
    }
  }

  /// The same number of samples everywhere.
  void trace();
  /// More samples where the reflectors are noisy.
  void trace_to_noise();

  std::vector<LayerTrace> take();

 private:
  using Pixels = std::vector<std::vector<PixelLayers>>;  // per reflector

  Pixels empty_pixels(std::size_t count) const {
    return Pixels(traces_.size(), std::vector<PixelLayers>(count, PixelLayers(options_.shells.size())));
  }

  /// A piece of an image row, in pixels of the image.
  struct Piece {
    int y = 0;
    int x = 0;
    int columns = 0;
    int first_sample = 0;
    int samples = 0;
  };
  void trace_piece(const Piece& piece, std::size_t first_pixel, Pixels& pixels);
  void add_sample(const PrimarySample& sample, int x, int y, std::size_t pixel, Pixels& pixels);
  void write(int x, int y, std::size_t pixel, const Pixels& pixels);
  int wanted_samples(const Pixels& pixels, const PixelWindow& area, int x, int y) const;
  bool in_window(int x, int y) const {
    return x >= window_.x && y >= window_.y && x < window_.x + window_.width &&
           y < window_.y + window_.height;
  }

  const LitWorld& lit_;
  const Camera& camera_;
  CameraRays rays_;
  PixelWindow window_;
  const TraceOptions& options_;
  PathLimits limits_;
  std::vector<int> number_of_object_;
  std::vector<ShellRays> shell_rays_;  // per reflector
  std::vector<LayerTrace> traces_;
  std::vector<std::vector<Row>> rows_;  // of the window, per reflector
  std::vector<std::uint32_t> pixel_samples_;
};

void LayerTracer::add_sample(const PrimarySample& sample, int x, int y, std::size_t pixel, Pixels& pixels) {
  const World& world = lit_.world;
  const bool on_object = !sample.hit.missed() && !world.is_light(sample.hit);
  const int number = on_object ? number_of_object_[sample.hit.geometry] : -1;
  if (number < 0) {
    const glm::vec3 value = tracing::radiance(lit_, sample.ray, sample.hit, limits_, sample.stream, 0, 0.0F);
    for (auto& of_reflector : pixels) of_reflector[pixel].add_other(value);
    return;
  }
  const auto r = static_cast<std::size_t>(number);
  const Surface surface = tracing::surface_at(world.scene, world.rays, sample.hit, sample.ray.direction);
  const tracing::ScatteredLight scattered =
      tracing::scattered_light(lit_, surface, limits_, sample.stream, 0);
  const glm::vec3 body = surface.emission + scattered.body;
  const IncidentShells incident = shell_rays_[r].trace(lit_, surface, scattered.lobe, limits_, sample.stream);
  const glm::vec3 value = body + surface.fresnel * incident.light();
  for (std::size_t other = 0; other < pixels.size(); ++other) {
    if (other != r) pixels[other][pixel].add_other(value);
  }
  const std::vector<std::uint16_t>& parts = world.scene.objects[sample.hit.geometry].mesh.parts;
  const std::uint16_t part = parts.empty() ? std::uint16_t{0} : parts[surface.triangle];
  pixels[r][pixel].add(surface, value, body, incident,
                       glm::dvec3(surface.position) + glm::dvec3(world.rays.origin()), part);
  if (!in_window(x, y)) return;
  Row& row = rows_[r][static_cast<std::size_t>(y - window_.y)];
  tracing::record_surface(row.samples, world, surface, sample.hit.distance,
                          rays_.direction_with_differentials(sample.point),
                          pixel_number(window_, static_cast<std::size_t>(y - window_.y), x - window_.x));
  tracing::record_light(row.samples, body, incident);
  row.beauty.push_back(value);
}

/// `first_pixel`: that of the piece's first pixel in `pixels`.
void LayerTracer::trace_piece(const Piece& piece, std::size_t first_pixel, Pixels& pixels) {
  const glm::vec3 eye = camera_.eye - lit_.world.rays.origin();
  const tracing::RowSegment segment{camera_.width,      piece.y,      piece.x, piece.columns,
                                    piece.first_sample, piece.samples};
  PrimaryRow primary(lit_.world.rays.all(), options_.seed, segment, [&](glm::vec2 point) {
    return Ray{eye, rays_.direction(point)};
  });
  for (int x = 0; x < piece.columns; ++x) {
    poll_interrupt();
    const std::size_t pixel = first_pixel + static_cast<std::size_t>(x);
    for (auto& of_reflector : pixels) of_reflector[pixel].plan(piece.first_sample + piece.samples);
    for (int i = 0; i < piece.samples; ++i) {
      add_sample(primary.next(), piece.x + x, piece.y, pixel, pixels);
    }
  }
}

void LayerTracer::write(int x, int y, std::size_t pixel, const Pixels& pixels) {
  for (std::size_t r = 0; r < traces_.size(); ++r) {
    pixels[r][pixel].write(traces_[r].layers.at(x - window_.x, y - window_.y));
    traces_[r]
        .display_variance[pixel_number(window_, static_cast<std::size_t>(y - window_.y), x - window_.x)] =
        static_cast<float>(pixels[r][pixel].display_variance());
  }
}

void LayerTracer::trace() {
  tracing::ProgressCounter progress(options_, static_cast<std::size_t>(window_.height));
  parallel_for(static_cast<std::size_t>(window_.height), 1, [&](std::size_t begin, std::size_t end) {
    for (auto y = window_.y + static_cast<int>(begin); y < window_.y + static_cast<int>(end); ++y) {
      Pixels pixels = empty_pixels(static_cast<std::size_t>(window_.width));
      trace_piece({y, window_.x, window_.width, 0, options_.samples_per_pixel}, 0, pixels);
      for (int x = 0; x < window_.width; ++x) write(window_.x + x, y, static_cast<std::size_t>(x), pixels);
      progress.step();
    }
  });
}

// By what the eight pixels around it vary by, never by its own samples: so their mean stays unbiased, and
// nothing that was traced is thrown away.
int LayerTracer::wanted_samples(const Pixels& pixels, const PixelWindow& area, int x, int y) const {
  double largest = 0.0;
  for (const auto& of_reflector : pixels) {
    double variance = 0.0;
    int count = 0;
    for (int j = std::max(y - 1, area.y); j <= std::min(y + 1, area.y + area.height - 1); ++j) {
      for (int i = std::max(x - 1, area.x); i <= std::min(x + 1, area.x + area.width - 1); ++i) {
        if (i == x && j == y) continue;
        const PixelLayers& near =
            of_reflector[pixel_number(area, static_cast<std::size_t>(j - area.y), i - area.x)];
        if (near.covered() == 0) continue;
        variance += near.display_variance();
        ++count;
      }
    }
    if (count > 0) largest = std::max(largest, variance / count);
  }
  const double limit = static_cast<double>(options_.noise) * static_cast<double>(options_.noise);
  int samples = options_.samples_per_pixel;
  while (largest * options_.samples_per_pixel > limit * samples &&
         2 * samples <= options_.most_samples_per_pixel) {
    samples *= 2;
  }
  return samples;
}

void LayerTracer::trace_to_noise() {
  // One pixel more all around, so that a window has the samples of the whole image.
  PixelWindow area;
  area.x = std::max(0, window_.x - 1);
  area.y = std::max(0, window_.y - 1);
  area.width = std::min(camera_.width, window_.x + window_.width + 1) - area.x;
  area.height = std::min(camera_.height, window_.y + window_.height + 1) - area.y;
  const auto width = static_cast<std::size_t>(area.width);
  const auto height = static_cast<std::size_t>(area.height);
  Pixels pixels = empty_pixels(width * height);
  tracing::ProgressCounter progress(options_, height + static_cast<std::size_t>(window_.height));
  parallel_for(height, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      trace_piece({area.y + static_cast<int>(row), area.x, area.width, 0, options_.samples_per_pixel},
                  row * width, pixels);
      progress.step();
    }
  });
  pixel_samples_.resize(static_cast<std::size_t>(window_.width) * static_cast<std::size_t>(window_.height));
  for (int y = 0; y < window_.height; ++y) {
    for (int x = 0; x < window_.width; ++x) {
      pixel_samples_[pixel_number(window_, static_cast<std::size_t>(y), x)] =
          static_cast<std::uint32_t>(wanted_samples(pixels, area, window_.x + x, window_.y + y));
    }
  }
  parallel_for(static_cast<std::size_t>(window_.height), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      const int y = window_.y + static_cast<int>(row);
      for (int x = window_.x; x < window_.x + window_.width; ++x) {
        const auto samples = static_cast<int>(pixel_samples_[pixel_number(window_, row, x - window_.x)]);
        const int first = options_.samples_per_pixel;
        const std::size_t pixel = pixel_number(area, static_cast<std::size_t>(y - area.y), x - area.x);
        if (samples > first) trace_piece({y, x, 1, first, samples - first}, pixel, pixels);
        write(x, y, pixel, pixels);
      }
      for (auto& rows : rows_) tracing::sort_by_pixel(rows[row]);
      progress.step();
    }
  });
}

std::vector<LayerTrace> LayerTracer::take() {
  for (std::size_t r = 0; r < traces_.size(); ++r) {
    traces_[r].samples = tracing::concatenate(rows_[r], window_, options_, lit_.world.rays.origin());
    traces_[r].samples.pixel_samples = pixel_samples_;
    traces_[r].sample_beauty.reserve(traces_[r].samples.size());
    for (const Row& row : rows_[r]) {
      traces_[r].sample_beauty.insert(traces_[r].sample_beauty.end(), row.beauty.begin(), row.beauty.end());
    }
  }
  return std::move(traces_);
}

}  // namespace

LayerTrace Tracer::trace_layers(const Camera& camera, int reflector, const TraceOptions& options) const {
  return std::move(trace_layers(camera, {&reflector, 1}, options).front());
}

std::vector<LayerTrace> Tracer::trace_layers(const Camera& camera, std::span<const int> reflectors,
                                             const TraceOptions& options) const {
  const World& world = state_->lit.world;
  validate(camera);
  tracing::validate(options);
  const PixelWindow window = tracing::window_in(options, camera.width, camera.height);
  check_shells(options.shells, world.scene.objects.size());
  std::vector<bool> seen(world.scene.objects.size(), false);
  for (int reflector : reflectors) {
    check_reflector(world, camera, reflector);
    const auto number = static_cast<std::size_t>(reflector);
    if (seen[number]) {
      throw InvalidArgument("reflectors", "object " + std::to_string(reflector) + " twice",
                            "different objects");
    }
    seen[number] = true;
  }
  LayerTracer tracer(state_->lit, camera, window, options, reflectors);
  if (options.noise > 0.0F) {
    tracer.trace_to_noise();
  } else {
    tracer.trace();
  }
  return tracer.take();
}

SurfaceSamples Tracer::trace_visibility(const Camera& camera, int reflector,
                                        const TraceOptions& trace_options,
                                        std::span<const glm::vec2> places) const {
  const World& world = state_->lit.world;
  validate(camera);
  TraceOptions options = trace_options;
  // Where the samples lie has no noise that could decide on their number.
  options.noise = 0.0F;
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
          tracing::record_surface(rows[y].samples, world, surface, sample.hit.distance,
                                  rays.direction_with_differentials(sample.point),
                                  pixel_number(window, y, x));
        }
      }
    }
  });
  return tracing::concatenate(rows, window, options, world.rays.origin());
}

}  // namespace mirrorbake
