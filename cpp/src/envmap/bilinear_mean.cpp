#include "bilinear_mean.hpp"

#include <algorithm>
#include <utility>

#include "coverage.hpp"

namespace mirrorbake {
namespace {

struct Polygon {
  std::array<glm::dvec2, 32> corners;  // a quadrilateral cut four times has at most 20
  std::size_t count = 0;
};

// What lies above (side 1) or below (−1) a limit along an axis; Sutherland and Hodgman, CACM 17(1), 1974.
Polygon cut(const Polygon& from, int axis, double limit, double side) {
  Polygon to;
  if (from.count == 0) return to;
  glm::dvec2 before = from.corners[from.count - 1];
  double depth_before = side * (before[axis] - limit);
  for (std::size_t i = 0; i < from.count; ++i) {
    const glm::dvec2 corner = from.corners[i];
    const double depth = side * (corner[axis] - limit);
    if ((depth > 0.0 && depth_before < 0.0) || (depth < 0.0 && depth_before > 0.0)) {
      glm::dvec2 crossing = before + depth_before / (depth_before - depth) * (corner - before);
      crossing[axis] = limit;
      to.corners[to.count++] = crossing;
    }
    if (depth >= 0.0) to.corners[to.count++] = corner;
    before = corner;
    depth_before = depth;
  }
  return to;
}

}  // namespace

void BilinearMean::integrate(const Quad& quad, glm::dvec2 low, glm::dvec2 high) {
  Polygon polygon;
  polygon.count = 4;
  std::copy(quad.begin(), quad.end(), polygon.corners.begin());
  polygon = cut(polygon, 0, low.x, 1.0);
  polygon = cut(polygon, 0, high.x, -1.0);
  polygon = cut(polygon, 1, low.y, 1.0);
  polygon = cut(polygon, 1, high.y, -1.0);
  integrate_polygon({polygon.corners.data(), polygon.count});
}

void BilinearMean::integrate_polygon(std::span<const glm::dvec2> corners) {
  area_ = 0.0;
  columns_ = rows_ = 0;
  if (corners.size() < 3) return;
  glm::dvec2 low = corners[0];
  glm::dvec2 high = low;
  for (const glm::dvec2 p : corners.subspan(1)) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  left_ = floor_of(low.x - 0.5);
  top_ = floor_of(low.y - 0.5);
  columns_ = floor_of(high.x - 0.5) - left_ + 2;
  rows_ = floor_of(high.y - 0.5) - top_ + 2;
  weights_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0.0);
  if (columns_ == 2 && rows_ == 2) return integrate_in_cell(corners);
  beside_.assign(weights_.size(), {});
  // In texels from the centre of the first one.
  const glm::dvec2 origin(left_ + 0.5, top_ + 0.5);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    add_edge(corners[i] - origin, corners[i + 1 < corners.size() ? i + 1 : 0] - origin);
  }
  if (columns_ > 2) {
    for (int row = 0; row + 1 < rows_; ++row) {
      Beside sum;
      for (int column = 1; column + 1 < columns_; ++column) {
        const Beside& left = beside_[static_cast<std::size_t>(row * columns_ + column - 1)];
        sum.height += left.height;
        sum.moment += left.moment;
        add_moments(column, row, sum.height, 0.5 * sum.height, sum.moment, 0.5 * sum.moment);
      }
    }
  }
  // The order of the corners decides the sign.
  if (area_ < 0.0) scale(-1.0);
}

// Moments about the first corner, by Green's theorem, which are then shifted to the corner of the cell.
void BilinearMean::integrate_in_cell(std::span<const glm::dvec2> corners) {
  double area = 0.0;
  double x = 0.0;
  double y = 0.0;
  double xy = 0.0;
  glm::dvec2 a = corners[1] - corners[0];
  for (const glm::dvec2 corner : corners.subspan(2)) {
    const glm::dvec2 b = corner - corners[0];
    const double cross = a.x * b.y - b.x * a.y;
    area += cross;
    x += cross * (a.x + b.x);
    y += cross * (a.y + b.y);
    xy += cross * (a.x * (2.0 * a.y + b.y) + b.x * (a.y + 2.0 * b.y));
    a = b;
  }
  area *= 0.5;
  x *= 1.0 / 6.0;
  y *= 1.0 / 6.0;
  const double from_x = corners[0].x - 0.5 - left_;
  const double from_y = corners[0].y - 0.5 - top_;
  xy = xy * (1.0 / 24.0) + from_x * y + from_y * x + from_x * from_y * area;
  add_moments(0, 0, area, x + from_x * area, y + from_y * area, xy);
  if (area_ < 0.0) scale(-1.0);
}

void BilinearMean::add_edge(glm::dvec2 from, glm::dvec2 to) {
  if (from.y == to.y) return;
  const bool down = from.y < to.y;
  const glm::dvec2 a = down ? from : to;
  const glm::dvec2 b = down ? to : from;
  const double slope = (b.x - a.x) / (b.y - a.y);
  glm::dvec2 p = a;
  for (int row = static_cast<int>(a.y); p.y < b.y && row + 1 < rows_; ++row) {
    const bool last = row + 1 >= b.y;
    const glm::dvec2 end = last ? b : glm::dvec2(a.x + slope * (row + 1 - a.y), row + 1);
    // Through the columns of this row.
    const double step = p.x < end.x ? 1.0 : -1.0;
    int column = std::clamp(static_cast<int>(p.x), 0, columns_ - 2);
    while (p.y < end.y) {
      const double side = step > 0.0 ? column + 1 : column;
      const bool leaves = step > 0.0 ? end.x > side : end.x < side;
      const int next = column + static_cast<int>(step);
      glm::dvec2 q = end;
      if (leaves && next >= 0 && next + 1 < columns_) q = {side, p.y + (side - p.x) / slope};
      q.y = std::min(q.y, end.y);
      if (down) {
        add_piece(column, row, p, q);
      } else {
        add_piece(column, row, q, p);
      }
      if (q.x == end.x && q.y == end.y) break;
      p = q;
      column = next;
    }
    p = end;
  }
}

// By Green's theorem the integral of f over a polygon is that of F dy around it, F(x, y) the integral of f from
// x to the right. Within the cell of the piece that ends at the cell's side; beyond it, it is that of all
// of the cell's width.
void BilinearMean::add_piece(int column, int row, glm::dvec2 from, glm::dvec2 to) {
  const double dx = to.x - from.x;
  const double dy = to.y - from.y;
  const double x = 0.5 * (from.x + to.x) - column;
  const double y = 0.5 * (from.y + to.y) - row;
  const double x2 = x * x + dx * dx / 12.0;
  add_moments(column, row, dy * (1.0 - x), 0.5 * dy * (1.0 - x2), dy * (y * (1.0 - x) - dx * dy / 12.0),
              0.5 * dy * (y * (1.0 - x2) - x * dx * dy / 6.0));
  Beside& beside = beside_[static_cast<std::size_t>(row * columns_ + column)];
  beside.height += dy;
  beside.moment += dy * y;
}

void BilinearMean::add_moments(int column, int row, double area, double x, double y, double xy) {
  if (!row_weights_.empty()) {
    const int last = static_cast<int>(row_weights_.size()) - 1;
    const auto weight = [&](int i) { return row_weights_[static_cast<std::size_t>(std::clamp(i, 0, last))]; };
    const double scale = 0.5 * (weight(top_ + row) + weight(top_ + row + 1));
    area *= scale;
    x *= scale;
    y *= scale;
    xy *= scale;
  }
  area_ += area;
  double* w = weights_.data() + row * columns_ + column;
  w[0] += area - x - y + xy;
  w[1] += x - xy;
  w[columns_] += y - xy;
  w[columns_ + 1] += xy;
}

}  // namespace mirrorbake
