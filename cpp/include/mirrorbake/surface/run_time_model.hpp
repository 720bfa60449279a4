#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

/// How the renderer that will draw the maps reads them. A map is inferred for one run time: drawn by another it can be
/// worse than a map that was merely captured.
namespace mirrorbake {

/// What a lookup reads of the map. `nearest` and `bilinear` read the finest level; `trilinear` the two levels next
/// to its level of detail; `anisotropic` several trilinear taps along the longer differential (ReadFilter).
enum class LookupFilter { nearest, bilinear, trilinear, anisotropic };

/// Whether every pixel computes its texture coordinates, or every vertex does and pixels interpolate ([PEM] §4; spec G6).
enum class CoordinateSource { per_pixel, per_vertex };

/// Where a pixel's Fresnel reflectance comes from (spec F6).
enum class FresnelSource { exact, table, schlick };

LookupFilter parse_lookup_filter(std::string_view name);
std::string_view name_of(LookupFilter filter);
CoordinateSource parse_coordinate_source(std::string_view name);
std::string_view name_of(CoordinateSource source);
FresnelSource parse_fresnel_source(std::string_view name);
std::string_view name_of(FresnelSource source);

struct RunTimeModel {
  std::string name;
  /// Where in a pixel the lookups lie, from its top left corner, in [0, 1): as many as a pixel has.
  std::vector<glm::vec2> places;
  /// Size of a lookup's footprint in pixels: differentials are multiplied by it. About 1/√(lookups per pixel), in (0, 1024].
  float footprint_scale = 1.0F;
  LookupFilter filter = LookupFilter::anisotropic;
  int max_taps = 4;  ///< of `anisotropic`, 1…16
  CoordinateSource coordinates = CoordinateSource::per_pixel;
  FresnelSource fresnel = FresnelSource::exact;
  int texel_bits = 16;  ///< of a channel in the texture format: 32, 16 (half), 9 (shared exponent, RGB9E5)

  bool operator==(const RunTimeModel&) const = default;
};

/// What the web page draws: four lookups per pixel on a rotated grid, footprint ½, up to four taps.
RunTimeModel web_run_time();

/// One lookup in the middle of the pixel, up to four taps.
RunTimeModel web1_run_time();

/// Sixteen lookups, footprint ¼, up to four taps: slow and sharp.
RunTimeModel reference_run_time();

/// One of the above by its name: `Web`, `Web1` or `Reference`. Throws InvalidArgument for another.
RunTimeModel run_time_model(std::string_view name);

/// Throws InvalidArgument, naming the field, for a value out of the range that stands beside it.
void validate(const RunTimeModel& model);

}  // namespace mirrorbake
