#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "command.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/scene/scene.hpp"
#include "mirrorbake/tracer/tracer.hpp"

/// What the commands of mb-trace have in common.
namespace mirrorbake::tool {

/// Whole numbers in `text`, separated by any of `separators`; nothing if it is anything else.
std::optional<std::vector<int>> parse_numbers(const std::string& text, std::string_view separators);

/// A scene with the views that it proposes.
struct Source {
  Scene scene;
  std::vector<std::pair<std::string, Camera>> cameras;
};

/// The scene, the view and the samples that every command takes.
struct Request {
  std::string path;
  std::string output;
  std::string indirect = "path";
  std::string sky;
  PanoramaOptions sky_options;
  std::string camera_name;
  std::vector<float> eye, target;
  std::optional<float> fov;
  std::string size = "512x512";
  std::string crop;
  std::string format = "automatic";
  int samples = 64;
  int depth = 8;
  std::uint64_t seed = 0;

  void add_options(CLI::App& app);

  /// The scene, with a light at least.
  Source load() const;

  Camera camera(const Source& source) const;
  TraceOptions trace_options() const;
  Tracer tracer(Source source, int focus = -1) const;

  void save(const Image& image) const { warn(save_image(output, image, parse_name<PixelFormat>(format))); }
  void warn(const SaveReport& report) const { warn_of_losses("mb-trace", output, report); }
};

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

std::unique_ptr<Command> add_beauty(CLI::App& app);
std::unique_ptr<Command> add_layers(CLI::App& app);
std::unique_ptr<Command> add_capture(CLI::App& app);

}  // namespace mirrorbake::tool
