#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include <glm/vec3.hpp>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/envmap/envmap.hpp"

namespace mirrorbake {

/// How a map is read (spec E2). `nearest` and `bilinear` read the finest level. `trilinear` interpolates
/// between the two levels whose texels are next in size to the longer differential, as graphics hardware
/// does. `ewa` is the elliptical weighted average on two adjacent levels: [WP] "hybrid texture filtering",
/// after Heckbert, Fundamentals of Texture Mapping and Image Warping, 1989. All but `nearest` read across
/// edges and corners of faces.
enum class SampleFilter { nearest, bilinear, trilinear, ewa };

template <>
struct EnumNames<SampleFilter> {
  static constexpr std::string_view what = "filter";
  static constexpr auto names = enum_names("nearest", "bilinear", "trilinear", "ewa");
};

struct SampleOptions {
  SampleFilter filter = SampleFilter::bilinear;
  double max_anisotropy = 16.0;  ///< of `ewa`: longer ellipses are widened to this ratio, ≥ 1
  /// Added to the level of detail that follows from the differentials: they grow by the factor 2^bias. Of
  /// `trilinear` and `ewa`; −64…64.
  double bias = 0.0;
  /// Instead of differentials the level of detail itself, one for every direction or one for all, of
  /// `trilinear` alone; levels that do not exist count as the nearest one that does.
  std::span<const float> level = {};
};

/// Values of the map in many directions of any length > 0: directions.size() × channels numbers. `ddx` and
/// `ddy` are the differentials of the directions over a pixel, in the directions' own length; `ewa` needs
/// them, and `trilinear` unless levels are given; the others take empty spans. Directions that are not finite
/// or zero, or that the map does not cover, give 0; differentials that are not finite count as infinitely
/// long. Returns the number of directions that were not finite or zero. Throws InvalidArgument if lengths
/// disagree, options contradict each other or are out of range, or the map is not valid.
std::size_t sample(const EnvMapView& map, std::span<const glm::vec3> directions,
                   std::span<const glm::vec3> ddx, std::span<const glm::vec3> ddy,
                   const SampleOptions& options, std::span<float> values);

}  // namespace mirrorbake
