// mb-infer: environment maps, inferred from views of a reflector whose layers are in files.

#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <iostream>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "command.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/inference/layer_images.hpp"

namespace mirrorbake::tool {
namespace {

constexpr const char* kShapes =
    "NAME=infinite, sphere:X,Y,Z,R, box:X,Y,Z,HX,HY,HZ, ellipsoid:X,Y,Z,RX,RY,RZ or hemisphere:X,Y,Z,R, and "
    "@X,Y,Z for the map's origin";

std::optional<std::vector<float>> parse_floats(std::string_view text) {
  std::vector<float> numbers;
  while (true) {
    float number = 0.0F;
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc()) return std::nullopt;
    numbers.push_back(number);
    text.remove_prefix(static_cast<std::size_t>(rest - text.data()));
    if (text.empty()) return numbers;
    if (text.front() != ',') return std::nullopt;
    text.remove_prefix(1);
  }
}

// `numbers`: the shape's, its centre first.
std::optional<Proxy> proxy_of(std::string_view shape, std::span<const float> numbers) {
  if (numbers.empty()) return proxy_from_numbers(shape, glm::vec3(0.0F), {});
  if (numbers.size() < 4) return std::nullopt;
  const glm::vec3 centre(numbers[0], numbers[1], numbers[2]);
  const std::span<const float> extents = numbers.subspan(3);
  if (shape != "sphere") return proxy_from_numbers(shape, centre, extents);
  if (extents.size() != 1) return std::nullopt;
  return proxy_from_numbers("ellipsoid", centre, std::vector<float>(3, extents[0]));
}

LayerShell parse_shell(const std::string& text) {
  const auto refuse = [&] { return InvalidArgument("--shell", text, kShapes); };
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) throw refuse();
  std::string_view rest = std::string_view(text).substr(equals + 1);
  std::optional<std::vector<float>> origin;
  if (const std::size_t at = rest.find('@'); at != std::string_view::npos) {
    origin = parse_floats(rest.substr(at + 1));
    if (!origin || origin->size() != 3) throw refuse();
    rest = rest.substr(0, at);
  }
  std::optional<std::vector<float>> numbers{std::in_place};
  std::string_view shape = rest;
  if (const std::size_t colon = rest.find(':'); colon != std::string_view::npos) {
    shape = rest.substr(0, colon);
    numbers = parse_floats(rest.substr(colon + 1));
  }
  std::optional<Proxy> proxy = numbers ? proxy_of(shape, *numbers) : std::nullopt;
  if (!proxy) throw refuse();
  if (origin) proxy->origin = {(*origin)[0], (*origin)[1], (*origin)[2]};
  try {
    validate(*proxy);
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(std::string("--shell ") + text + ": " + error.what());
  }
  return {text.substr(0, equals), *proxy};
}

struct Request {
  std::vector<std::string> inputs;
  std::string output;
  std::string reflector;
  std::vector<std::string> shells;
  std::string projection = "cube";
  int size = 128;
  std::string run_time = "Web";
  bool per_part = false;
  std::string format = "automatic";
  DisplayFitOptions fit;

  void add_options(CLI::App& app);
  LayerInferenceOptions options() const;
  std::vector<LayerImage> load() const;
  void check_output() const;
  std::vector<std::string> save(const LayerInference& inference) const;

 private:
  Projection target() const { return parse_projection(projection); }
  EnvMapView view(const InferredMap& map) const;
  std::string path_of(const InferredMap& map) const;
};

void Request::add_options(CLI::App& app) {
  app.add_option("layers", inputs, "views: images of mb-trace layers --lookups")->required();
  app.add_option(
         "-o,--output", output,
         "maps with all their levels: .exr with a layer per map, or .ktx2 or .dds; {} in the path stands "
         "for the name of a map, which then has a file of its own")
      ->required();
  app.add_option("--reflector", reflector, "name that its channels start with, where a view has several");
  app.add_option("--shell", shells,
                 std::string("where a shell's map lies, repeatable, front to back: ") + kShapes +
                     " (default: all at infinity)");
  std::vector<std::string> projections;
  for (const MapProjection& known : map_projections()) {
    projections.push_back(to_string(mirrorbake::Projection{.kind = known.projection}));
  }
  app.add_option("--to", projection, "projection of the maps")
      ->capture_default_str()
      ->check(CLI::IsMember(projections));
  app.add_option("--size", size, "texels along a side of a face, a power of two")->capture_default_str();
  app.add_option("--run-time", run_time, "what will draw the maps: Web, Web1 or Reference")
      ->capture_default_str();
  app.add_flag("--maps-per-part", per_part, "maps of its own for every part of the reflector");
  app.add_option("--smoothness", fit.solve.smoothness, "weight of differences between neighbouring texels")
      ->capture_default_str();
  app.add_option("--level-agreement", fit.solve.level_agreement, "weight of differences between levels")
      ->capture_default_str();
  app.add_option("--layer-weight", fit.layer_weight, "weight of the layers' own rows beside the pixels'")
      ->capture_default_str();
  app.add_option("--passes", fit.passes, "how often the pixels' weights are taken from the image of the maps")
      ->capture_default_str();
  app.add_option("--tolerance", fit.solve.tolerance, "share of the first gradient at which a solve ends")
      ->capture_default_str();
  app.add_option("--iterations", fit.solve.max_iterations, "after which a solve ends, at most")
      ->capture_default_str();
  app.add_option("--format", format, "pixels in the files: automatic (half), half or float32")
      ->capture_default_str();
}

LayerInferenceOptions Request::options() const {
  LayerInferenceOptions result;
  for (const std::string& shell : shells) result.shells.push_back(parse_shell(shell));
  result.map = TexelTopology::of(
      *std::ranges::find(map_projections(), target().kind, &MapProjection::projection), size);
  result.run_time = run_time_model(run_time);
  result.sharing = per_part ? MapSharing::per_part : MapSharing::all_parts;
  result.fit = fit;
  result.reflector = reflector;
  return result;
}

std::vector<LayerImage> Request::load() const {
  std::vector<LayerImage> images;
  for (const std::string& path : inputs) images.push_back({path, load_image(path)});
  return images;
}

void Request::check_output() const {
  const PixelFormat pixels = parse_name<PixelFormat>(format);
  if (stores_levels(output)) {
    check_envmap_path(path_of({"map", false, {}}), target(), FaceLayout::automatic, pixels);
  } else {
    check_levels_path(path_of({"map", false, {}}), pixels);
  }
}

std::string Request::path_of(const InferredMap& map) const {
  std::string path = output;
  if (const std::size_t mark = path.find("{}"); mark != std::string::npos) path.replace(mark, 2, map.name);
  return path;
}

EnvMapView Request::view(const InferredMap& map) const {
  EnvMapLayout layout;
  layout.projection = target();
  layout.width = layout.height = size;
  layout.levels = full_level_count(size, size);
  layout.channels = map.has_alpha ? 4 : 3;
  return {layout, map.texels};
}

// Every level's images side by side, the channels of each named by its map.
std::vector<Image> join_layers(const std::vector<std::string>& names,
                               const std::vector<std::vector<Image>>& levels) {
  std::vector<Image> joined;
  for (std::size_t l = 0; l < levels.front().size(); ++l) {
    std::vector<std::pair<std::string, const Image*>> parts;
    for (std::size_t m = 0; m < levels.size(); ++m) parts.emplace_back(names[m], &levels[m][l]);
    joined.push_back(merge(parts));
  }
  return joined;
}

// The paths of the files.
std::vector<std::string> Request::save(const LayerInference& inference) const {
  const bool apart = output.find("{}") != std::string::npos;
  const PixelFormat pixels = parse_name<PixelFormat>(format);
  if (!apart && stores_levels(output) && inference.maps.size() > 1) {
    throw InvalidArgument(
        "--output", output,
        "{} in the path, for the names of " + std::to_string(inference.maps.size()) + " maps");
  }
  std::vector<std::string> written;
  std::vector<std::vector<Image>> levels;
  std::vector<std::string> names;
  const auto flush = [&](const std::string& path) {
    warn_of_losses("mb-infer", path, save_levels(path, join_layers(names, levels), pixels));
    written.push_back(path);
    levels.clear();
    names.clear();
  };
  for (const InferredMap& map : inference.maps) {
    const EnvMapView maps = view(map);
    if (stores_levels(output)) {
      warn_of_losses("mb-infer", path_of(map),
                     save_envmap(path_of(map), maps, FaceLayout::automatic, pixels));
      written.push_back(path_of(map));
      continue;
    }
    names.push_back(apart ? "" : map.name + ".");
    std::vector<Image>& images = levels.emplace_back();
    for (int level = 0; level < maps.layout.levels; ++level) {
      images.push_back(pack_faces(maps, level, FaceLayout::column));
      images.back().channels = default_channels(maps.layout.channels);
    }
    if (apart) flush(path_of(map));
  }
  if (!levels.empty()) flush(output);
  return written;
}

void report(const LayerInference& inference, const std::vector<std::string>& written, bool json) {
  const SolveReport& solve = inference.report;
  if (inference.rejected > 0) {
    std::cerr << "mb-infer: warning: " << inference.rejected
              << " pixels were left out, since their light is not finite\n";
  }
  if (!solve.converged) {
    std::cerr << "mb-infer: warning: not converged after " << solve.iterations
              << " iterations, the gradient is " << text_of(solve.relative_gradient)
              << " of the first: raise --iterations or --tolerance\n";
  }
  if (!json) {
    std::cout << "residual " << text_of(solve.rms_error) << ", " << solve.iterations << " iterations, "
              << (solve.converged ? "converged" : "not converged") << ", " << solve.unknowns
              << " texels seen by " << inference.pixels << " pixels\n";
    return;
  }
  Json maps = Json::array();
  for (const auto& map : inference.maps) maps.push_back(map.name);
  print({{"outputs", written},
         {"maps", maps},
         {"residual", solve.rms_error},
         {"iterations", solve.iterations},
         {"rounds", solve.rounds},
         {"converged", solve.converged},
         {"relative_gradient", solve.relative_gradient},
         {"texels", solve.unknowns},
         {"pixels", inference.pixels},
         {"rejected", inference.rejected}});
}

int run(int argc, char** argv) {
  CLI::App app("Environment maps, inferred from views of a reflector whose layers are in files.", "mb-infer");
  Request request;
  request.add_options(app);
  return run_parsed(app, "print the report as a JSON object", argc, argv, [&](bool json) {
    const LayerInferenceOptions options = request.options();
    request.check_output();
    const LayerInference inference = infer_from_layers(request.load(), options);
    report(inference, request.save(inference), json);
  });
}

}  // namespace
}  // namespace mirrorbake::tool

int main(int argc, char** argv) {
  return mirrorbake::tool::exit_status("mb-infer", [&] { return mirrorbake::tool::run(argc, argv); });
}
