// mb-envmap sample: values of a map in given directions.

#include <cmath>
#include <iostream>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "envmap_command.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/envmap/mipmap.hpp"
#include "mirrorbake/envmap/sampling.hpp"

namespace mirrorbake::tool {
namespace {

// The differentials of a square pixel that `degrees` of directions wide is, about a direction.
std::pair<glm::vec3, glm::vec3> pixel_around(glm::vec3 direction, float degrees) {
  const glm::vec3 axis =
      std::abs(direction.y) < std::abs(direction.x) ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
  const float width = 2.0F * std::tan(glm::radians(0.5F * degrees)) * glm::length(direction);
  const glm::vec3 across = width * glm::normalize(glm::cross(direction, axis));
  return {across, width * glm::normalize(glm::cross(direction, across))};
}

void print_samples(EnvMap map, const std::vector<std::vector<float>>& directions, SampleFilter filter,
                   float footprint, bool json) {
  std::vector<glm::vec3> d;
  for (const std::vector<float>& v : directions) {
    if (v.size() != 3) {
      throw InvalidArgument("--direction", std::to_string(v.size()) + " numbers",
                            "three numbers; repeat the option for more directions");
    }
    d.emplace_back(v[0], v[1], v[2]);
  }
  if (!std::isfinite(footprint)) throw InvalidArgument("--footprint", text_of(footprint), "0 to 179 degrees");
  std::vector<glm::vec3> ddx(d.size(), glm::vec3(0.0F));
  std::vector<glm::vec3> ddy = ddx;
  if (filter == SampleFilter::trilinear || filter == SampleFilter::ewa) {
    if (map.layout.levels == 1) map = build_mips(map, MipFilter::seamless);
    for (std::size_t i = 0; i < d.size(); ++i) std::tie(ddx[i], ddy[i]) = pixel_around(d[i], footprint);
  }
  const std::size_t channels = static_cast<std::size_t>(map.layout.channels);
  std::vector<float> values(d.size() * channels);
  if (sample(map, d, ddx, ddy, {filter}, values) > 0) {
    throw InvalidArgument("--direction", "NaN, infinite or zero", "a finite vector of a length above 0");
  }
  for (std::size_t i = 0; i < d.size(); ++i) {
    const std::vector<float> texel(values.begin() + static_cast<std::ptrdiff_t>(i * channels),
                                   values.begin() + static_cast<std::ptrdiff_t>((i + 1) * channels));
    if (json) {
      print({{"direction", shortest(directions[i])}, {"value", shortest(texel)}});
    } else {
      for (std::size_t c = 0; c < channels; ++c) std::cout << (c ? " " : "") << text_of(texel[c]);
      std::cout << '\n';
    }
  }
}

class Sample final : public Command {
 public:
  explicit Sample(CLI::App* app) : Command(app) {
    input_.add_options(*app);
    input_.add_details(*app);
    app->add_option("--direction", directions_, "x y z, may be given several times")
        ->required()
        ->type_size(3);
    app->add_option("--filter", filter_,
                    "How the map is read; the last two use its levels, made if it has one")
        ->capture_default_str()
        ->check(CLI::IsMember({"nearest", "bilinear", "trilinear", "ewa"}));
    app->add_option("--footprint", footprint_, "trilinear and ewa: degrees that are averaged")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 179.0));
  }

  void run(bool json) const override {
    print_samples(input_.load(), directions_, parse_name<SampleFilter>(filter_), footprint_, json);
  }

 private:
  Input input_;
  std::vector<std::vector<float>> directions_;
  std::string filter_ = "bilinear";
  float footprint_ = 1.0F;
};

}  // namespace

std::unique_ptr<Command> add_sample(CLI::App& app) {
  return std::make_unique<Sample>(app.add_subcommand("sample", "Values of a map in given directions"));
}

}  // namespace mirrorbake::tool
