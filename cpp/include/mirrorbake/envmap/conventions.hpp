#pragma once

#include <span>
#include <string>
#include <string_view>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/envmap/envmap.hpp"

/// Other programs' orientations of environment maps, by name (spec §0). Ours: a panorama looks along −Z in
/// its centre, +X to the right, +Y up; cube faces are oriented as in OpenGL.
///
/// | name       | panorama (latlong): centre, right of it, up | cube                                               |
/// |------------|---------------------------------------------|----------------------------------------------------|
/// | mirrorbake | −Z, +X, +Y                                  | OpenGL faces                                       |
/// | openexr    | +Z, −X, +Y (ImfEnvmap.h)                    | right-handed faces of ImfEnvmap.h                  |
/// | oiio       | +X, +Y, +Z: mirrored, Z is up (envlatl)     | none                                               |
/// | mitsuba    | +Z, −X, +Y (envmap emitter)                 | none                                               |
/// | threejs    | +X, +Z, +Y (equirectUv)                     | OpenGL faces, looked up with the direction's −x    |
/// | ktx2       | none                                        | OpenGL faces                                       |
///
/// OpenImageIO's Y-up panoramas (`oiio:updirection` = "y") are those of openexr.
namespace mirrorbake {

std::span<const std::string_view> convention_names();

/// Which way a map is taken between a convention and ours.
enum class ConventionWay { from_foreign, to_foreign };

template <>
struct EnumNames<ConventionWay> {
  static constexpr std::string_view what = "way";
  static constexpr auto names = enum_names("from_foreign", "to_foreign");
};

/// The map such that a lookup of (x, y, z) gives what the other program's lookup of (x, y, z) gives; +Y stays
/// +Y, even if the other program calls another axis up. The same texels in another order, exactly, if texels
/// fall on texels: always for cubes, for panoramas if the turn is about +Y and the width divisible by 4;
/// otherwise resampled. `name` as in the table. Throws InvalidArgument for a name that is not there or has no
/// such projection, and for a map of several levels.
EnvMap convert_convention(const EnvMapView& map, std::string_view name, ConventionWay way);

}  // namespace mirrorbake
