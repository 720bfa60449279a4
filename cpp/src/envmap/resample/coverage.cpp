#include "coverage.hpp"

#include <algorithm>
#include <utility>

#include <glm/common.hpp>

namespace mirrorbake {
namespace {

double signed_area(std::span<const glm::dvec2> p) {
  double area = 0.0;
  for (std::size_t i = 1; i + 1 < p.size(); ++i) {
    const glm::dvec2 a = p[i] - p[0];
    const glm::dvec2 b = p[i + 1] - p[0];
    area += a.x * b.y - a.y * b.x;
  }
  return 0.5 * area;
}

}  // namespace

void Coverage::rasterize(std::span<const glm::dvec2> corners) {
  glm::dvec2 low = corners[0];
  glm::dvec2 high = low;
  for (const glm::dvec2 p : corners) low = glm::min(low, p), high = glm::max(high, p);
  left_ = floor_of(low.x);
  top_ = floor_of(low.y);
  width_ = floor_of(high.x) + 1 - left_;
  height_ = floor_of(high.y) + 1 - top_;
  cells_.assign(static_cast<std::size_t>(width_ + 1) * static_cast<std::size_t>(height_), 0.0);
  // Edges leave the area to their right: in pixel coordinates, y down, that is positive for downward edges.
  sign_ = signed_area(corners) > 0.0 ? -1.0 : 1.0;
  const glm::dvec2 origin(left_, top_);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    add_edge(corners[i] - origin, corners[i + 1 < corners.size() ? i + 1 : 0] - origin);
  }
}

void Coverage::add_edge(glm::dvec2 from, glm::dvec2 to) {
  if (from.y == to.y) return;
  double direction = 1.0;
  if (from.y > to.y) {
    std::swap(from, to);
    direction = -1.0;
  }
  const double slope = (to.x - from.x) / (to.y - from.y);
  double x = from.x;
  double y = from.y;
  for (int row = static_cast<int>(from.y); row < height_ && y < to.y; ++row) {
    const double next_y = std::min(row + 1.0, to.y);
    const double next_x = next_y == to.y ? to.x : from.x + slope * (next_y - from.y);
    const double height = direction * (next_y - y);
    double* line = cells_.data() + static_cast<std::ptrdiff_t>(row) * (width_ + 1);
    const double left = std::min(x, next_x);
    const double right = std::max(x, next_x);
    int column = std::min(static_cast<int>(left), width_ - 1);
    if (right <= column + 1) {
      const double share = 0.5 * (left + right) - column;
      line[column] += height * (1.0 - share);
      line[column + 1] += height * share;
    } else {
      const double height_per_x = height / (right - left);
      for (double a = left; a < right && column < width_; ++column) {
        const double b = std::min(column + 1.0, right);
        const double part = height_per_x * (b - a);
        const double share = 0.5 * (a + b) - column;
        line[column] += part * (1.0 - share);
        line[column + 1] += part * share;
        a = b;
      }
    }
    x = next_x;
    y = next_y;
  }
}

}  // namespace mirrorbake
