#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

namespace mirrorbake {

/// std::floor, which is a call where the instruction set does not have it.
inline int floor_of(double v) {
  const int i = static_cast<int>(v);
  return static_cast<double>(i) > v ? i - 1 : i;
}

/// Which part of every pixel a polygon covers, exactly. Every edge leaves in each pixel row it crosses the
/// signed area to its right, as two entries per crossed pixel, whose running sum along the row is the
/// coverage (the accumulation buffer of anti-aliased font rasterisers). Neighbouring polygons share their
/// edges, so that what one covers less, the other covers more: nothing is lost or counted twice.
class Coverage {
 public:
  /// Rasterises a polygon given in pixel units, x to the right, y down. It must not intersect itself.
  void rasterize(std::span<const glm::dvec2> corners);

  /// Calls visit(column, row, area) for every pixel of which more than a rounding error is covered; columns
  /// and rows may be negative or beyond the image.
  template <typename Visit>
  void for_each_pixel(Visit&& visit) const {
    for (int row = 0; row < height_; ++row) {
      const double* line = cells_.data() + static_cast<std::ptrdiff_t>(row) * (width_ + 1);
      double area = 0.0;
      for (int column = 0; column < width_; ++column) {
        area += line[column];
        if (sign_ * area > kSmallest) visit(left_ + column, top_ + row, sign_ * area);
      }
    }
  }

 private:
  static constexpr double kSmallest = 1e-9;

  void add_edge(glm::dvec2 from, glm::dvec2 to);

  std::vector<double> cells_;
  int left_ = 0;
  int top_ = 0;
  int width_ = 0;
  int height_ = 0;
  double sign_ = 1.0;
};

}  // namespace mirrorbake
