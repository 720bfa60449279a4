// mb-envmap background: what a camera sees of a map that surrounds it.

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "envmap_command.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/envmap/mipmap.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/prefilter/background.hpp"

namespace mirrorbake::tool {
namespace {

// Of a camera that looks along `look`, its up towards +Y, or towards +Z where it looks straight up and −Z
// where it looks straight down; then rolled counter-clockwise.
glm::dmat3 rotation_of(const char* option, const std::vector<double>& look, double roll) {
  const glm::dvec3 given(look[0], look[1], look[2]);
  const double length = glm::length(given);
  if (!std::isfinite(length) || !(length > 0.0)) {
    throw InvalidArgument(option, text_of(given), "three finite numbers that are not all 0");
  }
  if (!std::isfinite(roll)) throw InvalidArgument("--roll", text_of(roll), "finite degrees");
  const glm::dvec3 back = -given / length;
  const glm::dvec3 toward = std::abs(back.y) < 0.9999 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, -back.y);
  const glm::dvec3 right = glm::normalize(glm::cross(toward, back));
  const glm::dvec3 up = glm::cross(back, right);
  const double angle = glm::radians(roll);
  return {std::cos(angle) * right + std::sin(angle) * up, std::cos(angle) * up - std::sin(angle) * right,
          back};
}

class Background final : public Command {
 public:
  explicit Background(CLI::App* app) : Command(app) {
    input_.add_options(*app);
    input_.add_details(*app);
    app->add_option("-o,--output", path_, "image to write; the extension decides the format")->required();
    app->add_option("--format", format_, "pixels in the file: automatic, half, float32, uint8, uint16")
        ->capture_default_str();
    app->add_option("--lens", lens_, "perspective, or fisheye, which is equidistant")
        ->capture_default_str()
        ->check(CLI::IsMember({"perspective", "fisheye"}));
    app->add_option(
        "--fov", field_of_view_,
        "degrees: of a perspective the height's (default 45), of a fisheye the disc's (default 180)");
    app->add_option("--size", size_, "pixels, HEIGHT or WIDTHxHEIGHT")->capture_default_str();
    app->add_option("--look", look_, "x y z of where the camera looks")->expected(3)->capture_default_str();
    app->add_option("--roll", roll_, "degrees that it is turned about that, counter-clockwise")
        ->capture_default_str();
    app->add_option("--end-look", end_look_, "where it looks as the shutter closes")->expected(3);
    app->add_option("--end-roll", end_roll_, "its roll as the shutter closes");
    app->add_option("--steps", steps_, "pieces into which the way is cut, where it turns")
        ->capture_default_str();
  }

  void run(bool json) const override {
    const Lens lens = parse_name<Lens>(lens_);
    const Size size = parse_size(size_, {ProjectionKind::cube});
    const PixelFormat format = parse_name<PixelFormat>(format_);
    check_image_path(path_, format);
    const std::vector<glm::dvec3> directions = lens_directions(
        lens, size.width, size.height, field_of_view_.value_or(lens == Lens::fisheye ? 180.0 : 45.0));
    BackgroundOptions options;
    options.world_from_camera = rotation_of("--look", look_, roll_);
    options.world_from_camera_end =
        rotation_of("--end-look", end_look_.empty() ? look_ : end_look_, end_roll_.value_or(roll_));
    const bool moves = !end_look_.empty() || end_roll_.has_value();
    options.steps = moves ? steps_ : 1;
    EnvMap map = input_.load();
    if (map.layout.levels == 1) map = build_mips(map, MipFilter::seamless);
    Image picture(size.width, size.height, map.channels);
    picture.pixels = background(map, directions, size.width, size.height, options);
    const SaveReport report = save_image(path_, picture, format);
    warn_of_losses("mb-envmap", path_, report);
    if (json) {
      print({{"output", path_},
             {"width", size.width},
             {"height", size.height},
             {"clamped_to_half", report.clamped_to_half},
             {"clipped", report.clipped}});
    }
  }

 private:
  Input input_;
  std::string path_;
  std::string format_ = "automatic";
  std::string lens_ = "perspective";
  std::optional<double> field_of_view_;
  std::string size_ = "640x360";
  std::vector<double> look_ = {0.0, 0.0, -1.0};
  double roll_ = 0.0;
  std::vector<double> end_look_;
  std::optional<double> end_roll_;
  int steps_ = 8;
};

}  // namespace

std::unique_ptr<Command> add_background(CLI::App& app) {
  return std::make_unique<Background>(app.add_subcommand(
      "background", "A picture of what a camera sees of a map, standing still or turning"));
}

}  // namespace mirrorbake::tool
