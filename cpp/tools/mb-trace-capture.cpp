// mb-trace capture: what arrives at a point from all sides, as an environment map.

#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "trace_command.hpp"

namespace mirrorbake::tool {
namespace {

class Capture final : public Command {
 public:
  explicit Capture(CLI::App* app) : Command(app) {
    request_.size = "256";
    request_.add_options(*app);
    app->get_option("--size")->description(
        "texels of a face, HEIGHT or WIDTHxHEIGHT; a latlong is twice as wide as high");
    for (const char* name : {"--crop", "--camera", "--eye", "--target", "--fov"}) {
      app->remove_option(app->get_option(name));
    }
    app->add_option("--to", projection_, "projection: " + projection_names())->capture_default_str();
    app->add_option("--origin", origin_, "x y z of the point to look from, metres (default: 0 0 0)")
        ->type_size(3)
        ->expected(1);
    app->add_option("--hide", hidden_,
                    "name of an object that rays pass through, may be given several times");
    app->add_option("--layout", layout_,
                    "how faces share the image: strip, column, grid, cross, vertical_cross, files")
        ->capture_default_str();
  }

  void run(bool json) const override {
    const Stopwatch watch;
    const EnvMapLayout map = map_layout();
    const FaceLayout face_layout = parse_name<FaceLayout>(layout_, "layout");
    const PixelFormat format = parse_name<PixelFormat>(request_.format);
    check_envmap_path(request_.output, map.projection, face_layout, format);
    const Tracer tracer = request_.tracer(request_.load());
    const glm::vec3 from = origin_.empty() ? glm::vec3(0.0F) : glm::vec3(origin_[0], origin_[1], origin_[2]);
    const Image image = tracer.capture(from, map.projection, map.width, map.height,
                                       hidden_objects(tracer.scene()), request_.trace_options());
    const SaveReport report =
        save_envmap(request_.output, EnvMapView{map, image.pixels, image.channels}, face_layout, format);
    request_.warn(report);
    if (!json) return;
    print({{"output", request_.output},
           {"projection", to_string(map.projection)},
           {"width", map.width},
           {"height", map.height},
           {"samples_per_pixel", request_.samples},
           {"seconds", watch.seconds()}});
  }

 private:
  std::vector<int> hidden_objects(const Scene& scene) const {
    std::vector<int> numbers;
    for (const std::string& name : hidden_) {
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
    map.projection = parse_projection(projection_);
    const auto sides = parse_numbers(request_.size, "x");
    if (!sides || sides->size() > 2) {
      throw InvalidArgument("--size", request_.size, "HEIGHT or WIDTHxHEIGHT in texels of a face");
    }
    map.height = sides->back();
    map.width = sides->size() == 2 ? sides->front() : map.height * natural_aspect(map.projection);
    validate(map);
    return map;
  }

  Request request_;
  std::string projection_ = "cube";
  std::string layout_ = "automatic";
  std::vector<float> origin_;
  std::vector<std::string> hidden_;
};

}  // namespace

std::unique_ptr<Command> add_capture(CLI::App& app) {
  return std::make_unique<Capture>(app.add_subcommand(
      "capture", "What arrives at a point from all sides, as an environment map of any projection"));
}

}  // namespace mirrorbake::tool
