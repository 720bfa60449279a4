#include "coverage.hpp"

#include <algorithm>
#include <utility>

namespace mirrorbake {
namespace {

double signed_area(const std::array<glm::dvec2, 4>& p) {
  return 0.5 * ((p[2].x - p[0].x) * (p[3].y - p[1].y) - (p[3].x - p[1].x) * (p[2].y - p[0].y));
}

}  // namespace

void Coverage::rasterize(const std::array<glm::dvec2, 4>& p) {
  left_ = floor_of(std::min(std::min(p[0].x, p[1].x), std::min(p[2].x, p[3].x)));
  top_ = floor_of(std::min(std::min(p[0].y, p[1].y), std::min(p[2].y, p[3].y)));
  width_ = floor_of(std::max(std::max(p[0].x, p[1].x), std::max(p[2].x, p[3].x))) + 1 - left_;
  height_ = floor_of(std::max(std::max(p[0].y, p[1].y), std::max(p[2].y, p[3].y))) + 1 - top_;
  cells_.assign(static_cast<std::size_t>(width_ + 1) * static_cast<std::size_t>(height_), 0.0);
  // Edges leave the area to their right: in pixel coordinates, y down, that is positive for downward edges.
  sign_ = signed_area(p) > 0.0 ? -1.0 : 1.0;
  const glm::dvec2 origin(left_, top_);
  for (std::size_t i = 0; i < 4; ++i) add_edge(p[i] - origin, p[(i + 1) % 4] - origin);
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
