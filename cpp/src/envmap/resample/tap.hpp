#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "mirrorbake/envmap/texel_lookup.hpp"
#include "symmetry.hpp"

namespace mirrorbake {

/// A texel of the source and its part in one of the target.
struct Tap {
  TexelPlace texel;
  double weight = 0.0;
};

/// texel_at() for a map of one level and one channel, as a place.
inline TexelPlace place_at(const EnvMapLayout& layout, int face, int row, int column) {
  if (layout.projection.kind == ProjectionKind::latlong) {
    // Beyond a pole lies what is half a turn away.
    const bool beyond = row < 0 || row >= layout.height;
    if (row < 0) row = -1 - row;
    if (row >= layout.height) row = 2 * layout.height - 1 - row;
    column = (column + (beyond ? layout.width / 2 : 0)) % layout.width;
    return {face, row, column < 0 ? column + layout.width : column};
  }
  const std::size_t index = texel_at(layout, 0, face, row, column);
  const std::size_t line = index / static_cast<std::size_t>(layout.width);
  const std::size_t height = static_cast<std::size_t>(layout.height);
  return {static_cast<int>(line / height), static_cast<int>(line % height),
          static_cast<int>(index % static_cast<std::size_t>(layout.width))};
}

/// Calls emit(place, weight) for a texel that may lie one beyond the face. Beyond a corner of a cube there is
/// none: its neighbours around the corner get a third each, as in interpolate().
template <typename Emit>
void emit_texel(const EnvMapLayout& layout, int face, int row, int column, double weight, Emit&& emit) {
  const bool outside_row = row < 0 || row >= layout.height;
  const bool outside_column = column < 0 || column >= layout.width;
  if (!outside_row && !outside_column) {
    emit(TexelPlace{face, row, column}, weight);
  } else if (outside_row && outside_column && layout.projection.kind == ProjectionKind::cube) {
    const int last = layout.height - 1;
    const int inner_row = row < 0 ? 0 : last;
    const int inner_column = column < 0 ? 0 : last;
    emit(TexelPlace{face, inner_row, inner_column}, weight / 3.0);
    emit(place_at(layout, face, inner_row, column), weight / 3.0);
    emit(place_at(layout, face, row, inner_column), weight / 3.0);
  } else {
    emit(place_at(layout, face, row, column), weight);
  }
}

/// The taps of bilinear interpolation at (x, y), in texels from the top left corner of a face.
template <typename Emit>
void emit_bilinear(const EnvMapLayout& layout, int face, double x, double y, Emit&& emit) {
  const int left = static_cast<int>(std::floor(x - 0.5));
  const int top = static_cast<int>(std::floor(y - 0.5));
  const double fx = x - 0.5 - left;
  const double fy = y - 0.5 - top;
  emit_texel(layout, face, top, left, (1.0 - fx) * (1.0 - fy), emit);
  emit_texel(layout, face, top, left + 1, fx * (1.0 - fy), emit);
  emit_texel(layout, face, top + 1, left, (1.0 - fx) * fy, emit);
  emit_texel(layout, face, top + 1, left + 1, fx * fy, emit);
}

}  // namespace mirrorbake
