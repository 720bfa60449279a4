// mb-envmap convert and rotate: the same surroundings as another map.

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "envmap_command.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/envmap/conventions.hpp"
#include "mirrorbake/envmap/resample.hpp"

namespace mirrorbake::tool {
namespace {

// What convert and rotate have in common.
struct Conversion {
  Input input;
  Output output;
  std::string projection;
  std::string size;
  std::string filter = "automatic";
  std::string convention = "mirrorbake";
  float turn = 0.0F;
  std::vector<float> axis = {0.0F, 1.0F, 0.0F};
  float exposure = 0.0F;

  CLI::Option* add_turn(CLI::App& app) {
    app.add_option("--axis", axis, "x y z of the axis of --turn")->expected(3)->capture_default_str();
    app.add_option("--exposure", exposure, "stops by which radiance is raised")
        ->capture_default_str()
        ->check(exposure_range());
    return app
        .add_option("--turn", turn,
                    "degrees to turn the surroundings about the axis: about +Y from -Z towards +X")
        ->capture_default_str();
  }

  void run(bool json) const {
    if (!projection.empty()) output.check(parse_projection(projection));
    const EnvMap source = input.load();
    const Projection target = projection.empty() ? source.layout.projection : parse_projection(projection);
    if (projection.empty()) output.check(target);
    // About as many texels as the source has.
    const double texels = static_cast<double>(source.layout.level_texels(0)) / face_count(target);
    const int natural =
        std::max(1, static_cast<int>(std::lround(std::sqrt(texels / natural_aspect(target)))));
    const Size wanted = !size.empty()        ? parse_size(size, target)
                        : projection.empty() ? Size{source.layout.width, source.layout.height}
                                             : Size{natural * natural_aspect(target), natural};
    ResampleOptions options{parse_name<ResampleFilter>(filter)};
    options.source_from_target = rotation();
    const bool same = target == source.layout.projection && wanted.width == source.layout.width &&
                      wanted.height == source.layout.height && turn == 0.0F;
    EnvMap result = same ? source : resample(source, target, wanted.width, wanted.height, options);
    if (convention != "mirrorbake")
      result = convert_convention(result, convention, ConventionWay::to_foreign);
    if (exposure != 0.0F) {
      for (float& value : result.values) value *= std::exp2(exposure);
    }
    output.save(result, json);
  }

  // Of directions in the result to those in the input, by Rodrigues' formula: the surroundings turn clockwise
  // for somebody whom the axis points at, about +Y from −Z towards +X.
  glm::mat3 rotation() const {
    const glm::vec3 given(axis[0], axis[1], axis[2]);
    if (!std::isfinite(glm::length(given)) || !(glm::length(given) > 0.0F)) {
      throw InvalidArgument("--axis", text_of(given), "three finite numbers that are not all 0");
    }
    if (!std::isfinite(turn)) throw InvalidArgument("--turn", text_of(turn), "finite degrees");
    const glm::dvec3 a = glm::normalize(glm::dvec3(given));
    const double angle = glm::radians(static_cast<double>(turn));
    const glm::dmat3 cross(glm::dvec3(0, a.z, -a.y), glm::dvec3(-a.z, 0, a.x), glm::dvec3(a.y, -a.x, 0));
    return glm::mat3(glm::dmat3(1.0) + std::sin(angle) * cross + (1.0 - std::cos(angle)) * cross * cross);
  }
};

class Convert final : public Command {
 public:
  explicit Convert(CLI::App* app) : Command(app) {
    conversion_.input.add_options(*app);
    conversion_.input.add_details(*app);
    conversion_.output.add_options(*app);
    app->add_option("--to", conversion_.projection, "projection to make, as for --from")->required();
    app->add_option("--size", conversion_.size,
                    "texels of a face, HEIGHT or WIDTHxHEIGHT (default: as many texels as the input has)");
    app->add_option("--filter", conversion_.filter, "automatic, area, bilinear or nearest")
        ->capture_default_str();
    app->add_option("--to-convention", conversion_.convention,
                    "orientation to make, as for --from-convention")
        ->capture_default_str();
    conversion_.add_turn(*app);
  }

  void run(bool json) const override { conversion_.run(json); }

 private:
  Conversion conversion_;
};

class Rotate final : public Command {
 public:
  explicit Rotate(CLI::App* app) : Command(app) {
    conversion_.input.add_options(*app);
    conversion_.input.add_details(*app);
    conversion_.output.add_options(*app);
    conversion_.add_turn(*app)->required();
  }

  void run(bool json) const override { conversion_.run(json); }

 private:
  Conversion conversion_;
};

}  // namespace

std::unique_ptr<Command> add_convert(CLI::App& app) {
  return std::make_unique<Convert>(
      app.add_subcommand("convert", "Another projection, size, layout, orientation or format"));
}

std::unique_ptr<Command> add_rotate(CLI::App& app) {
  return std::make_unique<Rotate>(
      app.add_subcommand("rotate", "The same projection and size, turned about any axis"));
}

}  // namespace mirrorbake::tool
