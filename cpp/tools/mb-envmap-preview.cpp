// mb-envmap preview: a map as a picture for a display.

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "envmap_command.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/envmap/resample.hpp"

namespace mirrorbake::tool {
namespace {

// Khronos PBR Neutral Tone Mapper, specification 1.0, as mirrorbake.tone has it.
glm::vec3 neutral(glm::vec3 color) {
  constexpr float kFresnel = 0.04F;
  constexpr float kStart = 0.8F - kFresnel;
  constexpr float kDesaturation = 0.15F;
  const float low = std::min(color.x, std::min(color.y, color.z));
  color -= low < 2.0F * kFresnel ? low - low * low / (4.0F * kFresnel) : kFresnel;
  const float peak = std::max(color.x, std::max(color.y, color.z));
  if (peak <= kStart) return color;
  const float room = 1.0F - kStart;
  const float new_peak = 1.0F - room * room / (peak + room - kStart);
  const float fade = 1.0F - 1.0F / (kDesaturation * (peak - new_peak) + 1.0F);
  return glm::mix(color * (new_peak / peak), glm::vec3(new_peak), fade);
}

class Preview final : public Command {
 public:
  explicit Preview(CLI::App* app) : Command(app) {
    input_.add_options(*app);
    input_.add_details(*app);
    output_.add_options(*app);
    app->add_option("--to", projection_, "projection of the picture, as for --from")->capture_default_str();
    app->add_option("--size", size_, "pixels of a face, HEIGHT or WIDTHxHEIGHT")->capture_default_str();
    app->add_option("--exposure", exposure_, "stops by which radiance is raised")
        ->capture_default_str()
        ->check(exposure_range());
    app->add_option("--tone-map", tone_, "tone mapping: neutral, or none, which clips")
        ->capture_default_str()
        ->check(CLI::IsMember({"neutral", "none"}));
  }

  void run(bool json) const override {
    const Projection target = parse_projection(projection_);
    const Size size = parse_size(size_, target);
    output_.check(target);
    const EnvMap source = input_.load();
    const int channels = source.layout.channels;
    if (channels != 1 && channels != 3 && channels != 4) {
      throw FileError(input_.path,
                      "has " + std::to_string(channels) + " channels, expected grey, RGB or RGBA");
    }
    const EnvMap seen = resample(source, target, size.width, size.height);
    EnvMap picture = make_envmap({target, size.width, size.height, 1, 3});
    const float scale = std::exp2(exposure_);
    const std::size_t step = static_cast<std::size_t>(channels);
    for (std::size_t from = 0, to = 0; from < seen.values.size(); from += step, to += 3) {
      glm::vec3 color(0.0F);
      for (int c = 0; c < 3; ++c) {
        const float value = scale * seen.values[from + (channels == 1 ? 0U : static_cast<std::size_t>(c))];
        // NaN and what is below 0 are black, as on a display.
        color[c] = value > 0.0F ? std::min(value, 1e30F) : 0.0F;
      }
      if (tone_ == "neutral") color = neutral(color);
      for (int c = 0; c < 3; ++c) picture.values[to + static_cast<std::size_t>(c)] = std::min(color[c], 1.0F);
    }
    output_.save(picture, json);
  }

 private:
  Input input_;
  Output output_;
  std::string projection_ = "latlong";
  std::string size_ = "512";
  std::string tone_ = "neutral";
  float exposure_ = 0.0F;
};

}  // namespace

std::unique_ptr<Command> add_preview(CLI::App& app) {
  return std::make_unique<Preview>(app.add_subcommand("preview", "A tone-mapped picture of a map"));
}

}  // namespace mirrorbake::tool
