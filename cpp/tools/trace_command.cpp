#include "trace_command.hpp"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/load.hpp"
#include "mirrorbake/scene/room.hpp"
#include "mirrorbake/scene/shapes.hpp"
#include "mirrorbake/shading/metals.hpp"

namespace mirrorbake::tool {
namespace {

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

Image load_sky(const std::string& path, const PanoramaOptions& options) {
  Panorama panorama = load_panorama(path, options);
  if (panorama.negative > 0) {
    std::cerr << "mb-trace: warning: " << path << ": " << panorama.negative
              << " negative values were taken as 0\n";
  }
  if (panorama.repaired > 0) {
    std::cerr << "mb-trace: warning: " << path << ": " << panorama.repaired
              << " values were NaN or infinite and are filled\n";
  }
  return std::move(panorama.image);
}

Source load_source(const std::string& path) {
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

}  // namespace

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

void Request::add_options(CLI::App& app) {
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
  app.add_option("--layer", sky_options.choice.layer, "layer of an EXR sky (default: its only colours)");
  app.add_option("--part", sky_options.choice.part,
                 "part of an EXR sky, by name or number (default: the first with colours)");
  app.add_flag("--repair", sky_options.repairs, "fill NaN and infinite values of the sky");
  app.add_option("--camera", camera_name, "a camera of the scene, by name (default: its first)");
  app.add_option("--eye", eye, "x y z of the eye, metres")->type_size(3)->expected(1);
  app.add_option("--target", target, "x y z of the point in the image's middle, metres")
      ->type_size(3)
      ->expected(1);
  app.add_option("--fov", fov, "vertical field of view, degrees");
  app.add_option("--format", format, "pixels in the file: automatic, half, float32, uint8, uint16")
      ->capture_default_str();
}

Source Request::load() const {
  Source source = load_source(path);
  if (!sky.empty()) {
    source.scene.environment.emplace();
    source.scene.environment->panorama = load_sky(sky, sky_options);
  } else if (is_dark(source.scene)) {
    std::cerr << "mb-trace: warning: " << path << ": no lights; a white sky of radiance 1 is added\n";
    source.scene.environment = white_sky();
  }
  return source;
}

Camera Request::camera(const Source& source) const {
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

TraceOptions Request::trace_options() const {
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

Tracer Request::tracer(Source source, int focus) const {
  TracerOptions options;
  options.indirect = parse_name<IndirectLight>(indirect);
  options.seed = seed;
  options.focus = focus;
  return Tracer(std::move(source.scene), options);
}

}  // namespace mirrorbake::tool
