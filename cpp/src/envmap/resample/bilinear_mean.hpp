#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

namespace mirrorbake {

/// The corners of a texel, in order around it, in texels of a face of the source.
using Quad = std::array<glm::dvec2, 4>;

/// Integrals over a quadrilateral of the bilinear interpolation of texels, exactly: the weights of the
/// texels. The plane is cut into cells, each with the centres of four texels for its corners. In a cell the
/// weights are products of u, v, 1 − u and 1 − v, so that the area, the two first moments and the mixed
/// second moment of the part of the quadrilateral in the cell are all that is needed.
///
/// Where rows of texels have different solid angles, the integral is one over solid angle, that of a cell the
/// mean of its rows: long images of texels around a pole need it.
class BilinearMean {
 public:
  /// Of the part of a polygon in a cell: integrals of 1, u, v and uv, and what its edges add to those of 1
  /// and v in the cells on their right.
  struct Cell {
    double area = 0.0;
    double x = 0.0;
    double y = 0.0;
    double xy = 0.0;
    double beside = 0.0;
    double beside_y = 0.0;
  };

  /// `row_weights`: solid angles of texels by row, which are referred to, or none if they are all alike.
  explicit BilinearMean(std::span<const double> row_weights) : row_weights_(row_weights) {}

  /// Takes a polygon that does not intersect itself, or the part of one of at most four corners between two
  /// columns and rows.
  void integrate(std::span<const glm::dvec2> corners);
  void integrate(std::span<const glm::dvec2> corners, glm::dvec2 low, glm::dvec2 high);

  /// Calls visit(column, row, weight) for the texels with weight; the weights add up to area(). Columns and
  /// rows may be one beyond the face.
  template <typename Visit>
  void for_each_texel(Visit&& visit) const {
    const double smallest = kSmallest * area_;
    std::size_t i = 0;
    for (int row = 0; row < rows_; ++row) {
      for (int column = 0; column < columns_; ++column, ++i) {
        if (weights_[i] > smallest) visit(left_ + column, top_ + row, weights_[i]);
      }
    }
  }

 private:
  static constexpr double kSmallest = 1e-9;  // weight, a rounding error

  Cell cell_of(std::span<const glm::dvec2> corners) const;
  void add_cell(int column, int row, const Cell& cell);

  const std::span<const double> row_weights_;
  std::vector<double> weights_;
  std::vector<Cell> cells_;
  int left_ = 0;
  int top_ = 0;
  int columns_ = 0;
  int rows_ = 0;
  double area_ = 0.0;
};

}  // namespace mirrorbake
