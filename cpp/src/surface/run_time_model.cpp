#include "mirrorbake/surface/run_time_model.hpp"

#include <string>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

/// Centres of the cells of a grid of side² cells.
std::vector<glm::vec2> grid(int side) {
  std::vector<glm::vec2> places;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      places.push_back((glm::vec2(x, y) + 0.5F) / static_cast<float>(side));
    }
  }
  return places;
}

}  // namespace

RunTimeModel web_run_time() {
  // The rotated grid: every row and every column of a 4 × 4 grid has one lookup, so that edges near to
  // horizontal and vertical get four steps.
  return {.name = "Web",
          .places = {{0.375F, 0.125F}, {0.875F, 0.375F}, {0.125F, 0.625F}, {0.625F, 0.875F}},
          .footprint_scale = 0.5F};
}

RunTimeModel web1_run_time() { return {.name = "Web1", .places = grid(1), .footprint_scale = 1.0F}; }

RunTimeModel reference_run_time() {
  return {.name = "Reference", .places = grid(4), .footprint_scale = 0.25F};
}

RunTimeModel run_time_model(std::string_view name) {
  for (RunTimeModel model : {web_run_time(), web1_run_time(), reference_run_time()}) {
    if (model.name == name) return model;
  }
  throw InvalidArgument("run_time", "'" + std::string(name) + "'", "one of Web, Web1, Reference");
}

void validate(const RunTimeModel& model) {
  if (model.places.empty() || model.places.size() > 256) {
    throw InvalidArgument("places", std::to_string(model.places.size()) + " lookups", "1 to 256");
  }
  for (std::size_t i = 0; i < model.places.size(); ++i) {
    const glm::vec2 p = model.places[i];
    if (p.x >= 0.0F && p.y >= 0.0F && p.x < 1.0F && p.y < 1.0F) continue;
    throw InvalidArgument("places[" + std::to_string(i) + "]", text_of(p), "numbers in [0, 1)");
  }
  if (!(model.footprint_scale > 0.0F) || model.footprint_scale > 1024.0F) {
    throw InvalidArgument("footprint_scale", text_of(model.footprint_scale), "a number in (0, 1024]");
  }
  const bool taps = model.max_taps == 1 || (model.max_taps % 2 == 0 && model.max_taps > 0);
  if (!taps || model.max_taps > 16) {
    throw InvalidArgument("max_taps", std::to_string(model.max_taps), "1, or an even number up to 16");
  }
}

}  // namespace mirrorbake
