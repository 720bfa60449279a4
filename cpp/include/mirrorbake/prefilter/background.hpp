#pragma once

#include <span>
#include <string_view>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/envmap/envmap.hpp"

/// World projections as backgrounds: what a camera that turns, but does not move, sees of a map ([WP]).
namespace mirrorbake {

/// Cameras look along −Z with +X to the right and +Y up. `perspective`: a plane. `fisheye`: equidistant, of
/// 180 degrees for Omnimax.
enum class Lens { perspective, fisheye };

template <>
struct EnumNames<Lens> {
  static constexpr std::string_view what = "lens";
  static constexpr auto names = enum_names("perspective", "fisheye");
};

/// Directions of the middles of width × height pixels, the top row first; NaN beyond the disc of a fisheye,
/// whose diameter is the shorter side. `field_of_view` in degrees: of `perspective` that of the height, below
/// 180; of `fisheye` that of the diameter, up to 360. Throws InvalidArgument.
std::vector<glm::dvec3> lens_directions(Lens lens, int width, int height, double field_of_view);

/// The camera turns about one axis while the shutter is open.
struct BackgroundOptions {
  glm::dmat3 world_from_camera{1.0};      ///< rotation, as the shutter opens
  glm::dmat3 world_from_camera_end{1.0};  ///< rotation, as it closes
  int steps = 1;                          ///< pieces of every pixel's path, 1…1024
};

/// Values of width × height pixels: means over every pixel and along its own path, by EWA over the levels of
/// the map. Directions that are NaN give 0. Throws InvalidArgument for other lengths, fewer than 2 × 2
/// pixels, matrices that are no rotations, and a turn of 180°, which has no way.
std::vector<float> background(const EnvMapView& map, std::span<const glm::dvec3> directions, int width,
                              int height, const BackgroundOptions& options = {});

}  // namespace mirrorbake
