// mb-trace: path-traced images of a scene, the segmented layers of its reflectors, and environment maps of
// it.

#include <CLI/CLI.hpp>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/scene/load.hpp"
#include "mirrorbake/scene/room.hpp"
#include "mirrorbake/scene/shapes.hpp"
#include "mirrorbake/shading/metals.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "tool.hpp"

namespace {

using namespace mirrorbake;        // NOLINT(google-build-using-namespace): one program, one namespace
using namespace mirrorbake::tool;  // NOLINT(google-build-using-namespace)

// CLI11 takes -1 for the largest number, and what is beyond that as well.
CLI::Validator whole_number() {
  return {[](const std::string& text) {
            std::uint64_t value = 0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
            const bool is_whole = error == std::errc() && end == text.data() + text.size();
            return is_whole ? std::string() : text + " is not a whole number from 0 to 18446744073709551615";
          },
          "UINT", "whole number"};
}

// Whole numbers in `text`, separated by any of `separators`; nothing if it is anything else.
std::optional<std::vector<int>> parse_numbers(const std::string& text, std::string_view separators) {
  std::vector<int> numbers;
  const char* place = text.data();
  const char* const end = place + text.size();
  while (true) {
    int number = 0;
    const auto [rest, error] = std::from_chars(place, end, number);
    if (error != std::errc()) return std::nullopt;
    numbers.push_back(number);
    if (rest == end) return numbers;
    if (separators.find(*rest) == std::string_view::npos) return std::nullopt;
    place = rest + 1;
  }
}

// A scene with the views that it proposes.
struct Source {
  Scene scene;
  std::vector<std::pair<std::string, Camera>> cameras;
};

// The built-in room with a chromium teapot on its table.
Source teapot_room() {
  Source source{make_room(), {}};
  Material chromium;
  chromium.name = "chromium";
  chromium.albedo = glm::vec3(0.0F);
  chromium.specular = true;
  chromium.fresnel = fit_metal(Metal::chromium).conductor;
  source.scene.materials.push_back(chromium);
  Object teapot;
  teapot.name = "teapot";
  teapot.mesh = make_teapot();
  teapot.material = static_cast<int>(source.scene.materials.size()) - 1;
  teapot.part_names = teapot_part_names();
  source.scene.objects.push_back(std::move(teapot));
  Camera camera;
  camera.eye = {0.15F, 0.22F, 0.42F};
  camera.target = {0.0F, 0.07F, 0.0F};
  source.cameras.emplace_back("front", camera);
  return source;
}

// Everything in view, a little from above.
Camera framing(const Scene& scene) {
  glm::vec3 low(std::numeric_limits<float>::max());
  glm::vec3 high(std::numeric_limits<float>::lowest());
  for (const Object& object : scene.objects) {
    const Bounds box = bounds(object.mesh);
    low = glm::min(low, box.min);
    high = glm::max(high, box.max);
  }
  Camera camera;
  camera.target = 0.5F * low + 0.5F * high;
  const float radius = 0.5F * glm::length(high - low);
  const float distance =
      radius / std::sin(0.5F * camera.vertical_fov_degrees * std::numbers::pi_v<float> / 180.0F);
  camera.eye = camera.target + distance * glm::normalize(glm::vec3(0.3F, 0.4F, 1.0F));
  return camera;
}

bool is_dark(const Scene& scene) {
  const bool glows =
      std::any_of(scene.materials.begin(), scene.materials.end(),
                  [](const Material& material) { return material.emission != glm::vec3(0.0F); });
  return !glows && !scene.environment && scene.rectangle_lights.empty() && scene.sphere_lights.empty() &&
         scene.point_lights.empty() && scene.directional_lights.empty() && scene.spot_lights.empty();
}

EnvironmentLight white_sky() {
  EnvironmentLight sky;
  sky.panorama = Image(8, 4, {"R", "G", "B"});
  std::fill(sky.panorama.pixels.begin(), sky.panorama.pixels.end(), 1.0F);
  return sky;
}

// Panoramas that were scaled down with a sharpening filter undershoot beside their lights.
Image load_sky(const std::string& path, const ImageChoice& choice) {
  Image panorama = load_panorama(path, choice);
  std::size_t negative = 0;
  for (float& value : panorama.pixels) {
    if (!std::isfinite(value)) throw FileError(path, "has values that are not finite, expected radiance");
    if (value >= 0.0F) continue;
    value = 0.0F;
    ++negative;
  }
  if (negative > 0) {
    std::cerr << "mb-trace: warning: " << path << ": " << negative << " negative values were taken as 0\n";
  }
  return panorama;
}

// What every command takes.
struct Request {
  std::string path;
  std::string output;
  std::string indirect = "path";
  std::string sky;
  ImageChoice sky_choice;
  std::string camera_name;
  std::vector<float> eye, target;
  std::optional<float> fov;
  std::string size = "512x512";
  std::string crop;
  std::string format = "automatic";
  int samples = 64;
  int depth = 8;
  std::uint64_t seed = 0;

  void add_options(CLI::App& app) {
    app.add_option("scene", path, "a .gltf, .glb or .obj file, or teapot-room")->required();
    app.add_option("-o,--output", output, "image to write, .exr for its channels")->required();
    app.add_option("--size", size, "pixels, WIDTHxHEIGHT")->capture_default_str();
    app.add_option("--crop", crop, "the part of the image to trace, WIDTHxHEIGHT+X+Y in pixels");
    app.add_option("--spp", samples, "samples per pixel")->capture_default_str()->check(CLI::Range(1, 65536));
    app.add_option("--depth", depth, "bounces after the first, specular and diffuse")
        ->capture_default_str()
        ->check(CLI::Range(0, 64));
    app.add_option("--seed", seed, "of the random numbers")->capture_default_str()->check(whole_number());
    app.add_option("--indirect", indirect,
                   "diffuse light by way of other surfaces: path (unbiased), cached (smooth) or none")
        ->capture_default_str()
        ->check(CLI::IsMember({"path", "cached", "none"}));
    app.add_option(
        "--sky", sky,
        "panorama that lights the scene, latitude-longitude or a cube's strip, cross or KTX2, instead of "
        "the scene's own");
    app.add_option("--layer", sky_choice.layer, "layer of an EXR sky (default: its only colours)");
    app.add_option("--part", sky_choice.part,
                   "part of an EXR sky, by name or number (default: the first with colours)");
    app.add_option("--camera", camera_name, "a camera of the scene, by name (default: its first)");
    app.add_option("--eye", eye, "x y z of the eye, metres")->type_size(3)->expected(1);
    app.add_option("--target", target, "x y z of the point in the image's middle, metres")
        ->type_size(3)
        ->expected(1);
    app.add_option("--fov", fov, "vertical field of view, degrees");
    app.add_option("--format", format, "pixels in the file: automatic, half, float32, uint8, uint16")
        ->capture_default_str();
  }

  Source load_source() const;
  Source load() const;

  Camera camera(const Source& source) const {
    Camera result;
    const auto& cameras = source.cameras;
    const auto named = std::find_if(cameras.begin(), cameras.end(),
                                    [&](const auto& camera) { return camera.first == camera_name; });
    if (!camera_name.empty() && named == cameras.end()) {
      std::string names;
      for (const auto& [name, unused] : cameras) names += (names.empty() ? "" : ", ") + name;
      throw InvalidArgument("--camera", camera_name,
                            names.empty() ? "no name: the scene has no cameras" : "one of " + names);
    }
    result = named != cameras.end() ? named->second
             : cameras.empty()      ? framing(source.scene)
                                    : cameras.front().second;
    if (!eye.empty()) result.eye = {eye[0], eye[1], eye[2]};
    if (!target.empty()) result.target = {target[0], target[1], target[2]};
    if (fov) result.vertical_fov_degrees = *fov;
    const auto pixels = parse_numbers(size, "x");
    if (!pixels || pixels->size() != 2) throw InvalidArgument("--size", size, "WIDTHxHEIGHT in pixels");
    result.width = (*pixels)[0];
    result.height = (*pixels)[1];
    return result;
  }

  TraceOptions trace_options() const {
    TraceOptions options;
    options.samples_per_pixel = samples;
    options.max_specular_depth = options.max_diffuse_depth = depth;
    options.seed = seed;
    if (!crop.empty()) {
      const auto numbers = parse_numbers(crop, "x+");
      if (!numbers || numbers->size() != 4 || (*numbers)[0] < 1 || (*numbers)[1] < 1) {
        throw InvalidArgument("--crop", crop, "WIDTHxHEIGHT+X+Y in pixels, one at least");
      }
      options.window = {(*numbers)[2], (*numbers)[3], (*numbers)[0], (*numbers)[1]};
    }
    // Only for someone who watches.
    if (isatty(STDERR_FILENO) != 0) {
      options.progress = [last = -1](double done) mutable {
        const int percent = static_cast<int>(100.0 * done);
        if (percent == last) return;
        last = percent;
        std::cerr << "\rmb-trace: " << percent << " %" << (percent == 100 ? "\n" : "") << std::flush;
      };
    }
    return options;
  }

  Tracer tracer(Source source) const {
    TracerOptions options;
    options.indirect = indirect == "path"     ? IndirectLight::path
                       : indirect == "cached" ? IndirectLight::cached
                                              : IndirectLight::none;
    options.seed = seed;
    return Tracer(std::move(source.scene), options);
  }

  void save(const Image& image) const { warn(save_image(output, image, parse_pixel_format(format))); }

  void warn(const SaveReport& report) const { warn_of_losses("mb-trace", output, report); }
};

Source Request::load() const {
  Source source = load_source();
  if (!sky.empty()) {
    source.scene.environment.emplace();
    source.scene.environment->panorama = load_sky(sky, sky_choice);
  } else if (is_dark(source.scene)) {
    std::cerr << "mb-trace: warning: " << path << ": no lights; a white sky of radiance 1 is added\n";
    source.scene.environment = white_sky();
  }
  return source;
}

Source Request::load_source() const {
  if (path == "teapot-room") return teapot_room();
  LoadedScene loaded = load_scene(path);
  for (const SceneWarning& warning : loaded.warnings) {
    std::cerr << "mb-trace: warning: " << path << ": " << warning.message;
    if (warning.count > 1) std::cerr << " (" << warning.count << " times)";
    std::cerr << '\n';
  }
  Source source{std::move(loaded.scene), {}};
  for (const SceneCamera& camera : loaded.cameras) {
    Camera view;
    view.eye = camera.eye;
    view.target = camera.eye + camera.direction;
    view.up = camera.up;
    view.vertical_fov_degrees = camera.vertical_fov_degrees;
    source.cameras.emplace_back(camera.name, view);
  }
  return source;
}

// The channels of several images of one size side by side, each image's with a prefix.
Image merge(const std::vector<std::pair<std::string, const Image*>>& images) {
  std::vector<std::string> names;
  for (const auto& [prefix, image] : images) {
    for (const std::string& channel : image->channels) names.push_back(prefix + channel);
  }
  Image merged(images.front().second->width, images.front().second->height, names);
  for (int y = 0; y < merged.height; ++y) {
    for (int x = 0; x < merged.width; ++x) {
      float* out = merged.at(x, y);
      for (const auto& [prefix, image] : images) {
        out = std::copy_n(image->at(x, y), image->channels.size(), out);
      }
    }
  }
  return merged;
}

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

struct Beauty {
  Request request;
  std::optional<float> noise;
  bool aovs = false;

  void run(bool json) const {
    const Stopwatch watch;
    check_image_path(request.output, parse_pixel_format(request.format));
    const TraceOptions options = request.trace_options();
    Source source = request.load();
    const Camera camera = request.camera(source);
    const Tracer tracer = request.tracer(std::move(source));
    BeautyTrace trace;
    if (noise) {
      trace = tracer.trace_beauty_to_noise(camera, *noise, options);
    } else {
      trace.image = tracer.trace_beauty(camera, options);
      trace.mean_samples_per_pixel = options.samples_per_pixel;
    }
    if (aovs) {
      const Image geometry = tracer.trace_geometry(camera, options);
      request.save(merge({{"", &trace.image}, {"", &geometry}}));
    } else {
      request.save(trace.image);
    }
    if (noise && trace.share_above > 0.0) {
      std::cerr << "mb-trace: warning: " << 100.0 * trace.share_above << " % of the tiles need more than "
                << options.samples_per_pixel << " samples per pixel for a noise of " << *noise << '\n';
    }
    if (!json) {
      if (noise) {
        std::cerr << "mb-trace: noise " << trace.noise << " after " << trace.mean_samples_per_pixel
                  << " samples per pixel\n";
      }
      return;
    }
    std::cout << "{\"output\": " << json_string(request.output) << ", \"width\": " << trace.image.width
              << ", \"height\": " << trace.image.height
              << ", \"samples_per_pixel\": " << trace.mean_samples_per_pixel << ", \"noise\": ";
    if (noise) {
      std::cout << trace.noise << ", \"tiles_above_noise\": " << trace.share_above;
    } else {
      std::cout << "null";
    }
    std::cout << ", \"seconds\": " << watch.seconds() << "}\n";
  }
};

struct Layers {
  Request request;
  std::vector<std::string> reflectors;

  // Numbers of the objects that are asked for, by name; of all specular ones without names.
  std::vector<int> objects(const Scene& scene) const {
    std::vector<int> numbers;
    std::string known;
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      const Object& object = scene.objects[i];
      if (!scene.materials[static_cast<std::size_t>(object.material)].specular) continue;
      known += (known.empty() ? "" : ", ") + object.name;
      if (reflectors.empty()) numbers.push_back(static_cast<int>(i));
    }
    for (const std::string& name : reflectors) {
      const auto found = std::find_if(scene.objects.begin(), scene.objects.end(),
                                      [&](const Object& object) { return object.name == name; });
      if (found == scene.objects.end()) {
        throw InvalidArgument("--reflector", name, "one of: " + known);
      }
      numbers.push_back(static_cast<int>(found - scene.objects.begin()));
    }
    if (numbers.empty()) throw FileError(request.path, "has no object with a specular material");
    return numbers;
  }

  // Leaves one at least.
  static void drop_unseen(std::vector<LayerTrace>& traces, std::vector<int>& numbers) {
    for (std::size_t i = traces.size(); i-- > 0 && traces.size() > 1;) {
      if (traces[i].samples.size() > 0) continue;
      traces.erase(traces.begin() + static_cast<std::ptrdiff_t>(i));
      numbers.erase(numbers.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }

  void run(bool json) const {
    const Stopwatch watch;
    check_image_path(request.output, parse_pixel_format(request.format));
    const TraceOptions options = request.trace_options();
    Source source = request.load();
    const Camera camera = request.camera(source);
    std::vector<int> numbers = objects(source.scene);
    const Tracer tracer = request.tracer(std::move(source));
    std::vector<LayerTrace> traces = tracer.trace_layers(camera, numbers, options);
    if (reflectors.empty()) drop_unseen(traces, numbers);

    // All traces hold the same beauty image: it stands once, before the layers.
    Image beauty(traces.front().layers.width, traces.front().layers.height, {"R", "G", "B"});
    std::vector<Image> layers;
    for (const LayerTrace& trace : traces) {
      Image& image = layers.emplace_back(
          beauty.width, beauty.height,
          std::vector<std::string>(trace.layers.channels.begin() + 3, trace.layers.channels.end()));
      for (int y = 0; y < beauty.height; ++y) {
        for (int x = 0; x < beauty.width; ++x) {
          const float* pixel = trace.layers.at(x, y);
          std::copy_n(pixel, 3, beauty.at(x, y));
          std::copy_n(pixel + 3, image.channels.size(), image.at(x, y));
        }
      }
    }
    std::vector<std::pair<std::string, const Image*>> parts{{"", &beauty}};
    for (std::size_t i = 0; i < layers.size(); ++i) {
      const std::string& name = tracer.scene().objects[static_cast<std::size_t>(numbers[i])].name;
      parts.emplace_back(layers.size() == 1 ? "" : name + ".", &layers[i]);
    }
    request.save(merge(parts));
    if (!json) return;
    std::cout << "{\"output\": " << json_string(request.output) << ", \"width\": " << beauty.width
              << ", \"height\": " << beauty.height << ", \"samples_per_pixel\": " << options.samples_per_pixel
              << ", \"reflectors\": [";
    for (std::size_t i = 0; i < traces.size(); ++i) {
      const std::string& name = tracer.scene().objects[static_cast<std::size_t>(numbers[i])].name;
      std::cout << (i ? ", " : "") << "{\"name\": " << json_string(name)
                << ", \"samples\": " << traces[i].samples.size() << "}";
    }
    std::cout << "], \"seconds\": " << watch.seconds() << "}\n";
  }
};

struct Capture {
  Request request;
  std::string projection = "cube";
  std::string layout = "automatic";
  std::vector<float> origin;
  std::vector<std::string> hidden;

  void add_options(CLI::App& app) {
    request.size = "256";
    request.add_options(app);
    app.get_option("--size")->description(
        "texels of a face, HEIGHT or WIDTHxHEIGHT; a latlong is twice as wide as high");
    for (const char* name : {"--crop", "--camera", "--eye", "--target", "--fov"}) {
      app.remove_option(app.get_option(name));
    }
    app.add_option(
           "--to", projection,
           "projection: cube, latlong, equal_area, dual_paraboloid, sphere_map, angular, fisheye:DEGREES")
        ->capture_default_str();
    app.add_option("--origin", origin, "x y z of the point to look from, metres (default: 0 0 0)")
        ->type_size(3)
        ->expected(1);
    app.add_option("--hide", hidden, "name of an object that rays pass through, may be given several times");
    app.add_option("--layout", layout,
                   "how faces share the image: strip, column, grid, cross, vertical_cross, files")
        ->capture_default_str();
  }

  std::vector<int> hidden_objects(const Scene& scene) const {
    std::vector<int> numbers;
    for (const std::string& name : hidden) {
      const auto found = std::find_if(scene.objects.begin(), scene.objects.end(),
                                      [&](const Object& object) { return object.name == name; });
      if (found == scene.objects.end()) {
        std::string known;
        for (const Object& object : scene.objects) known += (known.empty() ? "" : ", ") + object.name;
        throw InvalidArgument("--hide", name, "one of: " + known);
      }
      numbers.push_back(static_cast<int>(found - scene.objects.begin()));
    }
    return numbers;
  }

  EnvMapLayout map_layout() const {
    EnvMapLayout map;
    map.projection = parse_projection(projection);
    const auto sides = parse_numbers(request.size, "x");
    if (!sides || sides->size() > 2) {
      throw InvalidArgument("--size", request.size, "HEIGHT or WIDTHxHEIGHT in texels of a face");
    }
    map.height = sides->back();
    map.width = sides->size() == 2 ? sides->front() : map.height * natural_aspect(map.projection);
    validate(map);
    return map;
  }

  void run(bool json) const {
    const Stopwatch watch;
    const EnvMapLayout map = map_layout();
    const FaceLayout face_layout = parse_face_layout(layout);
    const PixelFormat format = parse_pixel_format(request.format);
    check_envmap_path(request.output, map.projection, face_layout, format);
    const Tracer tracer = request.tracer(request.load());
    const glm::vec3 from = origin.empty() ? glm::vec3(0.0F) : glm::vec3(origin[0], origin[1], origin[2]);
    const Image image = tracer.capture(from, map.projection, map.width, map.height,
                                       hidden_objects(tracer.scene()), request.trace_options());
    const SaveReport report =
        save_envmap(request.output, EnvMapView{map, image.pixels, image.channels}, face_layout, format);
    request.warn(report);
    if (!json) return;
    std::cout << "{\"output\": " << json_string(request.output)
              << ", \"projection\": " << json_string(to_string(map.projection))
              << ", \"width\": " << map.width << ", \"height\": " << map.height
              << ", \"samples_per_pixel\": " << request.samples << ", \"seconds\": " << watch.seconds()
              << "}\n";
  }
};

int run(int argc, char** argv) {
  CLI::App app("Path-traced images of a scene, layers of its reflectors, and environment maps of it.",
               "mb-trace");
  app.set_version_flag("--version", "mb-trace " MIRRORBAKE_VERSION);
  app.require_subcommand(1);
  app.fallthrough();
  int threads = 0;
  bool json = false;
  app.add_option("--threads", threads, "threads to use, 0 for all; the image does not depend on it")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  app.add_flag("--json", json, "print figures as JSON, one object per line");

  Beauty beauty;
  CLI::App* beauty_command = app.add_subcommand("beauty", "Radiance of everything: R, G, B");
  beauty.request.add_options(*beauty_command);
  beauty_command->add_option(
      "--noise", beauty.noise,
      "trace each tile until its relative standard error is this, in (0, 1]; --spp is then the "
      "most it takes, at least 16");
  beauty_command->add_flag("--aovs", beauty.aovs,
                           "coverage A, depth Z, normal, position, albedo and object number as well");

  Layers layers;
  CLI::App* layers_command = app.add_subcommand(
      "layers",
      "Coverage, diffuse, Fresnel, local and distant incident radiance, and geometry of reflectors");
  layers.request.add_options(*layers_command);
  layers_command->add_option(
      "--reflector", layers.reflectors,
      "name of an object, may be given several times (default: all specular objects in view); with "
      "several the channels start with the name");

  Capture capture;
  CLI::App* capture_command = app.add_subcommand(
      "capture", "What arrives at a point from all sides, as an environment map of any projection");
  capture.add_options(*capture_command);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const ThreadLimit limit(threads);
  set_exr_threads(thread_count());
  if (*beauty_command) beauty.run(json);
  if (*layers_command) layers.run(json);
  if (*capture_command) capture.run(json);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return mirrorbake::tool::exit_status("mb-trace", [&] { return run(argc, argv); });
}
