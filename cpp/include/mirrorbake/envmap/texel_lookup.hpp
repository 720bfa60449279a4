#pragma once

#include <cstddef>
#include <span>

#include "mirrorbake/envmap/envmap.hpp"

/// Texels by their place in the plane of a face, on it or beyond it.
namespace mirrorbake {

/// Index (of the first value) of the texel at (row, column) of a face, either of which may be outside: then
/// it is the texel whose area holds the direction that lies there when the projection is continued, i.e. a
/// texel of the neighbouring face, hemisphere or side. Where nothing lies beyond, as with the sphere map, the
/// edge is repeated.
std::size_t texel_at(const EnvMapLayout& layout, int level, int face, int row, int column);

/// Bilinear interpolation at (column, row), in texels from the top left corner of the face, so that centres
/// are at halves; seamless by texel_at, and at a corner of a cube, where three texels meet, the fourth is
/// their mean, as graphics hardware does. Writes map.layout.channels values.
void interpolate(const EnvMapView& map, int level, int face, double column, double row,
                 std::span<double> result);

}  // namespace mirrorbake
