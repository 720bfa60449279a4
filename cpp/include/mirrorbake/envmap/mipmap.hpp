#pragma once

#include <string_view>
#include <vector>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/envmap/envmap.hpp"

namespace mirrorbake {

/// How a coarser level is made (spec E3). `box`: the plain mean of 2×2 texels of one face, as graphics
/// hardware generates mips. `solid_angle`: their mean weighted by solid angle ([EMT] §2.4), which keeps the
/// mean radiance over the sphere. `seamless`: the same, and then the texels along an edge of the cube take
/// the mean of both sides, at a corner of all three: faces meet in equal values, so that filtering within
/// faces shows no seam ([AEM] figure 4), and the mean radiance is still kept, since texels that mirror each
/// other in an edge have the same solid angle. For projections other than the cube it is `solid_angle`.
enum class MipFilter { box, solid_angle, seamless };

template <>
struct EnumNames<MipFilter> {
  static constexpr std::string_view what = "filter";
  static constexpr auto names = enum_names("box", "solid_angle", "seamless");
};

/// All levels down to 1×1 from the finest level of `map`. Where a side is odd, the last texel covers three;
/// the weighted filters then rescale the channels of the level that are not negative by the factor that
/// restores their mean. Throws InvalidArgument.
EnvMap build_mips(const EnvMapView& map, MipFilter filter);

/// Largest difference, over all channels, of two neighbouring texels on different sides of an edge of a cube
/// (or of the seam of a panorama), and of two neighbouring texels of one face: what is visible where a
/// renderer filters each face by itself.
struct SeamReport {
  float across = 0.0F;
  float inside = 0.0F;
};

SeamReport measure_seam(const EnvMapView& map, int level);

/// The faces of a level with a border of `border` texels on every side (spec E4), replicated from where they
/// lie on the neighbouring face, hemisphere or side: faces × (height + 2 border) × (width + 2 border) ×
/// channels. Throws InvalidArgument for a border below 0 or wider than the face.
std::vector<float> add_border(const EnvMapView& map, int level, int border);

}  // namespace mirrorbake
