#include "bilinear_mean.hpp"

#include <algorithm>

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

// Integrals over the parts of a polygon in cells, edge by edge. By Green's theorem the integral of f is that
// of F dy around the polygon, F(x, y) the integral of f from x to the right. Within the cell of a piece of an
// edge that one ends at the cell's side; beyond, it is that of all of a cell's width.
class EdgeWalk {
 public:
  EdgeWalk(BilinearMean::Cell* cells, int columns, int rows)
      : cells_(cells), columns_(columns), rows_(rows) {}

  void add_edge(glm::dvec2 from, glm::dvec2 to) {
    if (from.y == to.y) return;
    const bool down = from.y < to.y;
    const double sign = down ? 1.0 : -1.0;
    const glm::dvec2 a = down ? from : to;
    const glm::dvec2 b = down ? to : from;
    const double slope = (b.x - a.x) / (b.y - a.y);
    glm::dvec2 p = a;
    for (int row = static_cast<int>(a.y); p.y < b.y && row < rows_; ++row) {
      const bool last = row + 1 >= b.y;
      const glm::dvec2 end = last ? b : glm::dvec2(a.x + slope * (row + 1 - a.y), row + 1);
      add_in_row(row, p, end, sign);
      p = end;
    }
  }

 private:
  void add_in_row(int row, glm::dvec2 p, glm::dvec2 end, double sign) {
    const int step = p.x < end.x ? 1 : -1;
    int column = std::clamp(static_cast<int>(p.x), 0, columns_ - 1);
    const double y_per_x = (end.y - p.y) / (end.x != p.x ? end.x - p.x : 1.0);
    for (;;) {
      const double side = step > 0 ? column + 1 : column;
      const int next = column + step;
      if (!(step > 0 ? end.x > side : end.x < side) || next < 0 || next == columns_) break;
      const glm::dvec2 q(side, std::min(end.y, p.y + (side - p.x) * y_per_x));
      add_piece(row, column, p, q, sign);
      p = q;
      column = next;
    }
    add_piece(row, column, p, end, sign);
  }

  void add_piece(int row, int column, glm::dvec2 from, glm::dvec2 to, double sign) {
    const double dx = to.x - from.x;
    const double dy = to.y - from.y;
    const double x = 0.5 * (from.x + to.x) - column;
    const double y = 0.5 * (from.y + to.y) - row;
    const double x2 = 1.0 - x * x - dx * dx * (1.0 / 12.0);
    const double height = sign * dy;
    BilinearMean::Cell& cell = cells_[row * columns_ + column];
    cell.area += height * (1.0 - x);
    cell.x += 0.5 * height * x2;
    cell.y += height * (y * (1.0 - x) - dx * dy * (1.0 / 12.0));
    cell.xy += 0.5 * height * (y * x2 - x * dx * dy * (1.0 / 6.0));
    cell.beside += height;
    cell.beside_y += height * y;
  }

  BilinearMean::Cell* cells_;
  int columns_;
  int rows_;
};

}  // namespace

void BilinearMean::integrate(std::span<const glm::dvec2> corners, glm::dvec2 low, glm::dvec2 high) {
  Polygon polygon;
  polygon.count = corners.size();
  std::copy(corners.begin(), corners.end(), polygon.corners.begin());
  polygon = cut(polygon, 0, low.x, 1.0);
  polygon = cut(polygon, 0, high.x, -1.0);
  polygon = cut(polygon, 1, low.y, 1.0);
  polygon = cut(polygon, 1, high.y, -1.0);
  integrate(std::span<const glm::dvec2>(polygon.corners.data(), polygon.count));
}

void BilinearMean::integrate(std::span<const glm::dvec2> corners) {
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
  const int cell_columns = columns_ - 1;
  const int cell_rows = rows_ - 1;
  if (cell_columns == 1 && cell_rows == 1) {
    add_cell(0, 0, cell_of(corners));
  } else {
    cells_.assign(static_cast<std::size_t>(cell_columns) * static_cast<std::size_t>(cell_rows), {});
    // In texels from the centre of the first one.
    const glm::dvec2 origin(left_ + 0.5, top_ + 0.5);
    EdgeWalk walk(cells_.data(), cell_columns, cell_rows);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      walk.add_edge(corners[i] - origin, corners[i + 1 < corners.size() ? i + 1 : 0] - origin);
    }
    const Cell* cell = cells_.data();
    for (int row = 0; row < cell_rows; ++row) {
      double height = 0.0;
      double moment = 0.0;
      for (int column = 0; column < cell_columns; ++column, ++cell) {
        add_cell(column, row,
                 {cell->area + height, cell->x + 0.5 * height, cell->y + moment, cell->xy + 0.5 * moment});
        height += cell->beside;
        moment += cell->beside_y;
      }
    }
  }
  // The order of the corners decides the sign.
  if (area_ < 0.0) {
    for (double& weight : weights_) weight = -weight;
    area_ = -area_;
  }
}

// Moments about the first corner, which are then shifted to the corner of the cell.
BilinearMean::Cell BilinearMean::cell_of(std::span<const glm::dvec2> corners) const {
  Cell cell;
  glm::dvec2 a = corners[1] - corners[0];
  for (const glm::dvec2 corner : corners.subspan(2)) {
    const glm::dvec2 b = corner - corners[0];
    const double cross = a.x * b.y - b.x * a.y;
    cell.area += cross;
    cell.x += cross * (a.x + b.x);
    cell.y += cross * (a.y + b.y);
    cell.xy += cross * (a.x * (2.0 * a.y + b.y) + b.x * (a.y + 2.0 * b.y));
    a = b;
  }
  cell.area *= 0.5;
  cell.x *= 1.0 / 6.0;
  cell.y *= 1.0 / 6.0;
  const double x = corners[0].x - 0.5 - left_;
  const double y = corners[0].y - 0.5 - top_;
  cell.xy = cell.xy * (1.0 / 24.0) + x * cell.y + y * cell.x + x * y * cell.area;
  cell.x += x * cell.area;
  cell.y += y * cell.area;
  return cell;
}

void BilinearMean::add_cell(int column, int row, const Cell& cell) {
  double scale = 1.0;
  if (!row_weights_.empty()) {
    const int last = static_cast<int>(row_weights_.size()) - 1;
    const auto weight = [&](int i) { return row_weights_[static_cast<std::size_t>(std::clamp(i, 0, last))]; };
    scale = 0.5 * (weight(top_ + row) + weight(top_ + row + 1));
  }
  area_ += scale * cell.area;
  double* w = weights_.data() + row * columns_ + column;
  w[0] += scale * (cell.area - cell.x - cell.y + cell.xy);
  w[1] += scale * (cell.x - cell.xy);
  w[columns_] += scale * (cell.y - cell.xy);
  w[columns_ + 1] += scale * cell.xy;
}

}  // namespace mirrorbake
