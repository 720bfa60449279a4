#pragma once

#include <array>
#include <vector>

#include "mirrorbake/core/bilinear.hpp"
#include "mirrorbake/envmap/texel_lookup.hpp"
#include "symmetry.hpp"

namespace mirrorbake {

/// A texel of the source and its part in one of the target.
struct Tap {
  FaceTexel texel;
  double weight = 0.0;
};

/// continued() on the finest level, without its trigonometry where that is known.
inline FaceTexel place_at(const EnvMapLayout& layout, int face, int row, int column) {
  if (is_panorama(layout.projection.kind)) {
    // Beyond a pole lies what is half a turn away.
    const bool beyond = row < 0 || row >= layout.height;
    if (row < 0) row = -1 - row;
    if (row >= layout.height) row = 2 * layout.height - 1 - row;
    column = (column + (beyond ? layout.width / 2 : 0)) % layout.width;
    return {face, row, column < 0 ? column + layout.width : column};
  }
  return continued(layout.projection, layout.width, layout.height, {face, row, column});
}

/// Calls emit(place, weight) for a texel that may lie one beyond the face. Beyond a corner of a cube there is
/// none: its neighbours around the corner get a third each, as in add_face_bilinear().
template <typename Emit>
void emit_texel(const EnvMapLayout& layout, int face, int row, int column, double weight, Emit&& emit) {
  const bool outside_row = row < 0 || row >= layout.height;
  const bool outside_column = column < 0 || column >= layout.width;
  if (!outside_row && !outside_column) {
    emit(FaceTexel{face, row, column}, weight);
  } else if (outside_row && outside_column && layout.projection.kind == ProjectionKind::cube) {
    const int last = layout.height - 1;
    const int inner_row = row < 0 ? 0 : last;
    const int inner_column = column < 0 ? 0 : last;
    emit(FaceTexel{face, inner_row, inner_column}, weight / 3.0);
    emit(place_at(layout, face, inner_row, column), weight / 3.0);
    emit(place_at(layout, face, row, inner_column), weight / 3.0);
  } else {
    emit(place_at(layout, face, row, column), weight);
  }
}

/// The taps of bilinear interpolation at (x, y), in texels from the top left corner of a face.
template <typename Emit>
void emit_bilinear(const EnvMapLayout& layout, int face, double x, double y, Emit&& emit) {
  const BilinearCell<double> cell = bilinear_cell(x, y);
  const std::array<double, 4> weights = cell.weights();
  for (int i = 0; i < 4; ++i) {
    emit_texel(layout, face, cell.row + i / 2, cell.column + i % 2, weights[static_cast<std::size_t>(i)],
               emit);
  }
}

}  // namespace mirrorbake
