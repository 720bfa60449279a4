// mb-trace layers: the segmented layers of reflectors.

#include <algorithm>
#include <cstddef>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/surface/lookup_image.hpp"
#include "mirrorbake/surface/run_time_model.hpp"
#include "trace_command.hpp"

namespace mirrorbake::tool {
namespace {

class Layers final : public Command {
 public:
  explicit Layers(CLI::App* app) : Command(app) {
    request_.add_options(*app);
    app->add_option(
        "--reflector", reflectors_,
        "name of an object, may be given several times (default: all specular objects in view); with "
        "several the channels start with the name");
    app->add_option(
        "--lookups", run_time_,
        "write as well where the lookups of this run time meet the reflectors, for mb-infer: Web, "
        "Web1 or Reference; the pixels are then float32");
  }

  void run(bool json) const override {
    const Stopwatch watch;
    PixelFormat format = parse_name<PixelFormat>(request_.format);
    if (!run_time_.empty() && format == PixelFormat::automatic) format = PixelFormat::float32;
    check_image_path(request_.output, format);
    const RunTimeModel run_time = run_time_.empty() ? RunTimeModel{} : run_time_model(run_time_);
    const TraceOptions options = request_.trace_options();
    Source source = request_.load();
    const Camera camera = request_.camera(source);
    std::vector<int> numbers = objects(source.scene);
    const Tracer tracer = request_.tracer(std::move(source), numbers.size() == 1 ? numbers.front() : -1);
    std::vector<LayerTrace> traces = tracer.trace_layers(camera, numbers, options);
    if (reflectors_.empty()) drop_unseen(traces, numbers);

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
    std::vector<Image> lookups;
    lookups.reserve(layers.size());  // of which parts keep addresses
    for (std::size_t i = 0; i < layers.size() && !run_time_.empty(); ++i) {
      const SurfaceSamples met = tracer.trace_visibility(camera, numbers[i], options, run_time.places);
      lookups.push_back(lookup_image(met, static_cast<int>(run_time.places.size())));
      parts.emplace_back(parts[i + 1].first, &lookups.back());
    }
    request_.warn(save_image(request_.output, merge(parts), format));
    if (!json) return;
    Json reflectors = Json::array();
    for (std::size_t i = 0; i < traces.size(); ++i) {
      const std::string& name = tracer.scene().objects[static_cast<std::size_t>(numbers[i])].name;
      reflectors.push_back({{"name", name}, {"samples", traces[i].samples.size()}});
    }
    print({{"output", request_.output},
           {"width", beauty.width},
           {"height", beauty.height},
           {"samples_per_pixel", options.samples_per_pixel},
           {"reflectors", reflectors},
           {"seconds", watch.seconds()}});
  }

 private:
  // Numbers of the objects that are asked for, by name; of all specular ones without names.
  std::vector<int> objects(const Scene& scene) const {
    std::vector<int> numbers;
    std::string known;
    for (std::size_t i = 0; i < scene.objects.size(); ++i) {
      const Object& object = scene.objects[i];
      if (!scene.materials[static_cast<std::size_t>(object.material)].specular) continue;
      known += (known.empty() ? "" : ", ") + object.name;
      if (reflectors_.empty()) numbers.push_back(static_cast<int>(i));
    }
    for (const std::string& name : reflectors_) {
      const auto found = std::find_if(scene.objects.begin(), scene.objects.end(),
                                      [&](const Object& object) { return object.name == name; });
      if (found == scene.objects.end()) {
        throw InvalidArgument("--reflector", name, "one of: " + known);
      }
      numbers.push_back(static_cast<int>(found - scene.objects.begin()));
    }
    if (numbers.empty()) throw FileError(request_.path, "has no object with a specular material");
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

  Request request_;
  std::vector<std::string> reflectors_;
  std::string run_time_;
};

}  // namespace

std::unique_ptr<Command> add_layers(CLI::App& app) {
  return std::make_unique<Layers>(app.add_subcommand(
      "layers",
      "Coverage, diffuse, Fresnel, local and distant incident radiance, and geometry of reflectors"));
}

}  // namespace mirrorbake::tool
