#pragma once

#include <string_view>

#include <glm/mat3x3.hpp>

#include "mirrorbake/envmap/envmap.hpp"

/// From any projection to any other (spec P7).
namespace mirrorbake {

/// How a texel of the new map is made from those of the old one. `area`: the mean over the texel's area on
/// the sphere of the source, whose texels are areas of constant radiance: exact for straight texel edges, and
/// it conserves flux (first-order conservative remapping; Jones, Monthly Weather Review 127, 1999).
/// `bilinear`: interpolation at the centre of the texel. `nearest`: the texel that its centre lies in.
/// `automatic`: `area` where a texel covers at least one of the source, bilinear interpolation in its middle
/// where it is at most three quarters as long (as wide, of long ones around a pole), and a blend in between.
/// What interpolates keeps flux as well as its source is smooth; `area` keeps it everywhere.
enum class ResampleFilter { automatic, area, bilinear, nearest };

ResampleFilter parse_resample_filter(std::string_view name);

struct ResampleOptions {
  ResampleFilter filter = ResampleFilter::automatic;
  glm::mat3 source_from_target{1.0F};  ///< rotation or reflection of directions, orthonormal to 1e-4
};

/// The finest level of `source` in another projection and size, as a map of one level. What the source does
/// not cover (a fisheye of less than 360°) is 0. Texels of round maps outside of the unit disc hold what lies
/// beyond the rim. Same bits on any number of threads. Throws InvalidArgument for layouts or matrices that
/// are not valid.
EnvMap resample(const EnvMapView& source, const Projection& target, int width, int height,
                const ResampleOptions& options = {});

}  // namespace mirrorbake
