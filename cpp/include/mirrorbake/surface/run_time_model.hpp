#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "mirrorbake/envmap/reads.hpp"

/// How the renderer that will draw the maps reads them. A map is inferred for one run time: drawn by another
/// it can be worse than a map that was merely captured.
namespace mirrorbake {

struct RunTimeModel {
  std::string name;
  /// Where in a pixel the lookups lie, from its top left corner, in [0, 1): as many as a pixel has.
  std::vector<glm::vec2> places;
  /// Size of a lookup's footprint in pixels: differentials are multiplied by it. About 1/√(lookups per
  /// pixel), in (0, 1024].
  float footprint_scale = 1.0F;
  LookupFilter filter = LookupFilter::anisotropic;
  int max_taps = 4;  ///< of `anisotropic`: 1, or an even number up to 16

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
