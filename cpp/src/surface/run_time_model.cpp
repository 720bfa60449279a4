#include "mirrorbake/surface/run_time_model.hpp"

#include <array>
#include <string>
#include <utility>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

template <typename Enum, std::size_t n>
using Names = std::array<std::pair<std::string_view, Enum>, n>;

constexpr Names<LookupFilter, 4> kFilters{{{"nearest", LookupFilter::nearest},
                                           {"bilinear", LookupFilter::bilinear},
                                           {"trilinear", LookupFilter::trilinear},
                                           {"anisotropic", LookupFilter::anisotropic}}};
constexpr Names<CoordinateSource, 2> kCoordinates{
    {{"per_pixel", CoordinateSource::per_pixel}, {"per_vertex", CoordinateSource::per_vertex}}};
constexpr Names<FresnelSource, 3> kFresnel{
    {{"exact", FresnelSource::exact}, {"table", FresnelSource::table}, {"schlick", FresnelSource::schlick}}};

template <typename Enum, std::size_t n>
Enum parse(const Names<Enum, n>& names, const char* argument, std::string_view name) {
  std::string known;
  for (const auto& [text, value] : names) {
    if (text == name) return value;
    known += (known.empty() ? "" : ", ") + std::string(text);
  }
  throw InvalidArgument(argument, "'" + std::string(name) + "'", "one of " + known);
}

template <typename Enum, std::size_t n>
std::string_view name_in(const Names<Enum, n>& names, Enum value) {
  for (const auto& [text, known] : names) {
    if (known == value) return text;
  }
  return names.front().first;
}

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

LookupFilter parse_lookup_filter(std::string_view name) { return parse(kFilters, "filter", name); }
std::string_view name_of(LookupFilter filter) { return name_in(kFilters, filter); }
CoordinateSource parse_coordinate_source(std::string_view name) {
  return parse(kCoordinates, "coordinates", name);
}
std::string_view name_of(CoordinateSource source) { return name_in(kCoordinates, source); }
FresnelSource parse_fresnel_source(std::string_view name) { return parse(kFresnel, "fresnel", name); }
std::string_view name_of(FresnelSource source) { return name_in(kFresnel, source); }

RunTimeModel web_run_time() {
  // The rotated grid: every row and every column of a 4 × 4 grid has one lookup, so that edges near to horizontal and
  // vertical get four steps.
  return {.name = "Web",
          .places = {{0.375F, 0.125F}, {0.875F, 0.375F}, {0.125F, 0.625F}, {0.625F, 0.875F}},
          .footprint_scale = 0.5F,
          .texel_bits = 9};
}

RunTimeModel web1_run_time() {
  return {.name = "Web1", .places = grid(1), .footprint_scale = 1.0F, .texel_bits = 9};
}

RunTimeModel reference_run_time() {
  return {.name = "Reference", .places = grid(4), .footprint_scale = 0.25F, .texel_bits = 16};
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
  if (model.max_taps < 1 || model.max_taps > 16) {
    throw InvalidArgument("max_taps", std::to_string(model.max_taps), "1 to 16");
  }
  if (model.texel_bits != 32 && model.texel_bits != 16 && model.texel_bits != 9) {
    throw InvalidArgument("texel_bits", std::to_string(model.texel_bits), "32, 16 or 9");
  }
}

}  // namespace mirrorbake
