// mb-envmap info: projection, size, range and mean radiance of a map.

#include <algorithm>
#include <iostream>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "envmap_command.hpp"
#include "mirrorbake/envmap/envmap.hpp"

namespace mirrorbake::tool {
namespace {

void print_info(const Input& input, bool json) {
  const EnvMap map = input.read();
  std::vector<float> low(static_cast<std::size_t>(map.layout.channels),
                         std::numeric_limits<float>::infinity());
  std::vector<float> high(low.size(), -std::numeric_limits<float>::infinity());
  const std::span<const float> values = EnvMapView(map).level(0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t c = i % low.size();
    low[c] = std::min(low[c], values[i]);
    high[c] = std::max(high[c], values[i]);
  }
  std::vector<double> mean = integrate(map);
  const std::vector<double> angles =
      texel_solid_angles(map.layout.projection, map.layout.width, map.layout.height);
  double whole = 0.0;
  for (const double angle : angles) whole += angle;
  for (double& m : mean) m /= whole * face_count(map.layout.projection);
  const std::size_t bad = count_not_finite(map);
  if (json) {
    print({{"path", input.path},
           {"projection", to_string(map.layout.projection)},
           {"width", map.layout.width},
           {"height", map.layout.height},
           {"faces", face_count(map.layout.projection)},
           {"levels", map.layout.levels},
           {"channels", map.channels},
           {"min", shortest(low)},
           {"max", shortest(high)},
           {"mean_radiance", mean},
           {"not_finite", bad}});
    return;
  }
  std::cout << input.path << ": " << to_string(map.layout.projection) << ", "
            << face_count(map.layout.projection) << " face(s) of " << map.layout.width << " x "
            << map.layout.height << ", " << map.layout.levels << " level(s), " << map.layout.channels
            << " channel(s)\n";
  for (std::size_t c = 0; c < low.size(); ++c) {
    std::cout << "  " << (c < map.channels.size() ? map.channels[c] : std::to_string(c)) << ": " << low[c]
              << " to " << high[c] << ", mean radiance over the sphere " << mean[c] << '\n';
  }
  if (bad > 0) std::cout << "  " << bad << " values are NaN or infinite\n";
}

class Info final : public Command {
 public:
  explicit Info(CLI::App* app) : Command(app) {
    input_.add_options(*app);
    input_.add_details(*app);
  }

  void run(bool json) const override { print_info(input_, json); }

 private:
  Input input_;
};

}  // namespace

std::unique_ptr<Command> add_info(CLI::App& app) {
  return std::make_unique<Info>(
      app.add_subcommand("info", "Projection, size, range and mean radiance of a map"));
}

}  // namespace mirrorbake::tool
