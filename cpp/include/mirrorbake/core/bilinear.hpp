#pragma once

#include <array>

/// The one definition of bilinear interpolation: which four texels lie around a point, and their weights.
/// What lies beyond the edge of an image (another face, the edge again, the other side) is up to whoever
/// reads.
namespace mirrorbake {

template <typename T>
struct BilinearCell {
  int column = 0;  ///< of the two left texels, −1 for a point left of the first centre
  int row = 0;     ///< of the two upper ones
  T x = 0;         ///< where the point lies between their centres, from the left to the right one, in [0, 1)
  T y = 0;         ///< from the upper to the lower one

  /// Of top left, top right, bottom left, bottom right. They sum to 1.
  std::array<T, 4> weights() const { return {(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y}; }

  /// The interpolated value of four, in the same order.
  template <typename V>
  V mix(const V& top_left, const V& top_right, const V& bottom_left, const V& bottom_right) const {
    return (1 - y) * ((1 - x) * top_left + x * top_right) + y * ((1 - x) * bottom_left + x * bottom_right);
  }

  bool inside(int width, int height) const {
    return column >= 0 && row >= 0 && column + 1 < width && row + 1 < height;
  }
};

/// The cell around a point, in texels from the image's top left corner: centres are at halves. The
/// coordinates must fit an int.
template <typename T>
BilinearCell<T> bilinear_cell(T x, T y) {
  const auto floor = [](T value) {
    const int whole = static_cast<int>(value);
    return whole - (value < static_cast<T>(whole) ? 1 : 0);
  };
  const T across = x - T(0.5);
  const T down = y - T(0.5);
  const int column = floor(across);
  const int row = floor(down);
  return {column, row, across - static_cast<T>(column), down - static_cast<T>(row)};
}

}  // namespace mirrorbake
