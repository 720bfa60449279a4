#pragma once

#include <CLI/CLI.hpp>

#include <charconv>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "command.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/conventions.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/envmap/repair.hpp"

/// What the commands of mb-envmap have in common.
namespace mirrorbake::tool {

/// What every command that reads a map takes.
struct Input {
  std::string path;
  std::string projection;
  std::string layout = "automatic";
  std::string convention = "mirrorbake";
  ImageChoice choice;
  bool repairs = false;

  void add_options(CLI::App& app, const std::string& name = "input") {
    app.add_option(name, path,
                   "EXR, HDR, TIFF, PNG, JPEG, KTX2 or DDS; {} in the name stands for px, nx, py, ny, pz, nz")
        ->required();
  }
  void add_details(CLI::App& app, const std::string& whose = "the input") {
    app.add_option(
        "--from", projection,
        "projection of " + whose + ": " + projection_names() + " (default: by the shape of the image)");
    app.add_option("--from-layout", layout,
                   "how faces share the image: strip, column, grid, cross, vertical_cross")
        ->capture_default_str();
    app.add_option("--from-convention", convention,
                   "orientation of " + whose + ": mirrorbake, openexr, oiio, mitsuba, threejs, ktx2")
        ->capture_default_str();
    app.add_option("--layer", choice.layer, "layer of an EXR file (default: all channels)");
    app.add_option("--part", choice.part,
                   "part of an EXR file, by name or number (default: the first with colours)");
    app.add_flag("--repair", repairs, "fill NaN and infinite values from their surroundings");
  }
  /// With a warning of values that are not finite.
  EnvMap load() const {
    EnvMap map = read();
    if (const std::size_t bad = count_not_finite(map); bad > 0) {
      std::cerr << "mb-envmap: warning: " << path << ": " << bad
                << " values are NaN or infinite; --repair fills them\n";
    }
    return map;
  }
  EnvMap read() const {
    std::optional<Projection> given;
    if (!projection.empty()) given = parse_projection(projection);
    EnvMap map = load_envmap(path, given, parse_name<FaceLayout>(layout, "layout"), {}, choice);
    const std::size_t filled = repairs ? repair_not_finite(path, map) : 0;
    if (filled > 0) {
      std::cerr << "mb-envmap: " << path << ": " << filled << " values were NaN or infinite and are filled\n";
    }
    return convention == "mirrorbake" ? map
                                      : convert_convention(map, convention, ConventionWay::from_foreign);
  }
};

struct Output {
  std::string path;
  std::string layout = "automatic";
  std::string format = "automatic";

  void add_options(CLI::App& app) {
    app.add_option("-o,--output", path, "file to write; the extension decides the format")->required();
    app.add_option("--layout", layout,
                   "how faces share the image: strip, column, grid, cross, vertical_cross, files")
        ->capture_default_str();
    app.add_option("--format", format, "pixels in the file: automatic, half, float32, uint8, uint16")
        ->capture_default_str();
  }
  // Before the work.
  void check(const Projection& projection) const {
    check_envmap_path(path, projection, parse_name<FaceLayout>(layout, "layout"),
                      parse_name<PixelFormat>(format));
  }
  void save(const EnvMapView& map, bool json) const {
    const SaveReport report =
        save_envmap(path, map, parse_name<FaceLayout>(layout, "layout"), parse_name<PixelFormat>(format));
    warn_of_losses("mb-envmap", path, report);
    if (!json) return;
    print({{"output", path},
           {"projection", to_string(map.layout.projection)},
           {"width", map.layout.width},
           {"height", map.layout.height},
           {"levels", map.layout.levels},
           {"clamped_to_half", report.clamped_to_half},
           {"clipped", report.clipped}});
  }
};

/// Of --exposure, in stops: NaN passes the range of CLI11.
inline CLI::Validator exposure_range() {
  return CLI::Validator(
      [](const std::string& text) {
        double stops = 0.0;
        const char* end = text.data() + text.size();
        const char* digits = text.data() + (text.starts_with('+') && !text.starts_with("+-") ? 1 : 0);
        const auto [rest, error] = std::from_chars(digits, end, stops);
        return error == std::errc() && rest == end && stops >= -20.0 && stops <= 20.0
                   ? std::string()
                   : text + " is not within -20 to 20 stops";
      },
      "STOPS in [-20 - 20]");
}

struct Size {
  int width = 0;
  int height = 0;
};

/// "256" or "512x256".
inline Size parse_size(const std::string& text, const Projection& projection) {
  Size size;
  const char* end = text.data() + text.size();
  auto [rest, error] = std::from_chars(text.data(), end, size.width);
  if (error == std::errc() && rest == end) {
    size.height = size.width;
    if (natural_aspect(projection) == 2) size.width *= 2;
    return size;
  }
  if (error == std::errc() && *rest == 'x') {
    const auto second = std::from_chars(rest + 1, end, size.height);
    if (second.ec == std::errc() && second.ptr == end) return size;
  }
  throw InvalidArgument("--size", text, "HEIGHT or WIDTHxHEIGHT in texels of a face");
}

std::unique_ptr<Command> add_info(CLI::App& app);
std::unique_ptr<Command> add_convert(CLI::App& app);
std::unique_ptr<Command> add_rotate(CLI::App& app);
std::unique_ptr<Command> add_mips(CLI::App& app);
std::unique_ptr<Command> add_border(CLI::App& app);
std::unique_ptr<Command> add_sample(CLI::App& app);
std::unique_ptr<Command> add_compare(CLI::App& app);
std::unique_ptr<Command> add_prefilter(CLI::App& app);
std::unique_ptr<Command> add_preview(CLI::App& app);
std::unique_ptr<Command> add_background(CLI::App& app);

}  // namespace mirrorbake::tool
