#include "tap_builder.hpp"

#include <algorithm>
#include <cmath>

namespace mirrorbake {
namespace {

struct Range {
  int low;
  int high;
};

// Of a sum of multiples of a tile's rows and columns.
Range range(const Tile& tile, int per_row, int per_column, int offset) {
  const int row_a = per_row * tile.row;
  const int row_b = per_row * (tile.row + tile.rows - 1);
  const int column_a = per_column * tile.column;
  const int column_b = per_column * (tile.column + tile.columns - 1);
  return {std::min(row_a, row_b) + std::min(column_a, column_b) + offset,
          std::max(row_a, row_b) + std::max(column_a, column_b) + offset};
}

enum class Order { before, mixed, after };

// Whether a symmetry takes the texels of a tile to texels before themselves.
Order order_of_image(const Tile& tile, const TexelMap& map) {
  const FaceMap& to = map.faces[static_cast<std::size_t>(tile.face)];
  if (to.face != tile.face) return to.face < tile.face ? Order::before : Order::after;
  const Range rows = range(tile, to.row_per_row, to.row_per_column, to.row_offset);
  if (rows.high < tile.row) return Order::before;
  if (rows.low >= tile.row + tile.rows) return Order::after;
  if (to.row_per_row != 1 || to.row_offset != 0) return Order::mixed;
  Range columns = range(tile, to.column_per_row, to.column_per_column, to.column_offset);
  const int turns = columns.low < 0 ? 1 : columns.low >= map.width ? -1 : 0;
  columns.low += turns * map.width;
  columns.high += turns * map.width;
  if (columns.low < 0 || columns.high >= map.width) return Order::mixed;
  if (columns.high < tile.column) return Order::before;
  return columns.low >= tile.column + tile.columns ? Order::after : Order::mixed;
}

bool looks_at_centers(ResampleFilter filter) {
  return filter == ResampleFilter::bilinear || filter == ResampleFilter::nearest;
}

// Maps have at most 65536 rows and columns.
std::uint16_t narrow(int index) { return static_cast<std::uint16_t>(index); }

}  // namespace

LineTables line_tables(const ResampleJob& job) {
  const int width = job.target.width;
  return {job.target.projection,
          looks_at_centers(job.filter) ? center_coordinates(width) : side_coordinates(width)};
}

std::size_t TapChunk::bytes() const {
  return (target_rows.size() + target_columns.size() + rows.size() + columns.size()) * sizeof(std::uint16_t) +
         groups.size() * sizeof(TapGroup) + faces.size() + weights.size() * sizeof(float) +
         giants.size() * sizeof(TexelPlace);
}

void TapChunk::clear() {
  target_rows.clear();
  target_columns.clear();
  groups.clear();
  faces.clear();
  rows.clear();
  columns.clear();
  weights.clear();
  giants.clear();
  on_one_face = true;
}

bool may_have_first_texels(const Tile& tile, std::span<const SharedSymmetry> symmetries) {
  return std::none_of(symmetries.begin(), symmetries.end(), [&](const SharedSymmetry& symmetry) {
    return order_of_image(tile, symmetry.target) == Order::before;
  });
}

TapBuilder::TapBuilder(const ResampleJob& job, const LineTables& lines,
                       std::span<const SharedSymmetry> symmetries)
    : job_(job),
      kernels_(resample_kernels()),
      symmetries_(symmetries),
      limits_(straight_limits(job.source)),
      lookup_(job, lines),
      irregular_(job),
      interpolated_(job.row_weights()) {}

void TapBuilder::build(const Tile& tile, TapChunk& chunk) {
  chunk.clear();
  chunk.face = tile.face;
  if (!select_first_texels(tile)) return;
  if (looks_at_centers(job_.filter)) {
    add_by_center();
    move_pending(chunk);
    return;
  }
  find_corners();
  classify();
  for (int row = 0; row < tile_.rows; ++row) {
    for (int column = 0; column < tile_.columns; ++column) {
      if (kinds_[texel(row, column)] == kArea) add_area(row, column);
    }
  }
  move_pending(chunk);
  weigh(chunk);
  for (int row = 0; row < tile_.rows; ++row) {
    for (int column = 0; column < tile_.columns; ++column) {
      const std::uint8_t kind = kinds_[texel(row, column)];
      if (kind == kIrregular) {
        add_irregular(row, column, chunk);
      } else if (kind & kInterpolate) {
        add_mixed(row, column);
      }
    }
  }
  move_pending(chunk);
}

// Marks the texels that no symmetry takes to one before them, and sets the present tile to the rectangle
// around them.
bool TapBuilder::select_first_texels(const Tile& tile) {
  tile_ = tile;
  first_.assign(texel(tile.rows, 0), 1);
  for (const SharedSymmetry& symmetry : symmetries_) {
    const TexelMap& map = symmetry.target;
    const Order order = order_of_image(tile, map);
    if (order == Order::before) return false;
    if (order == Order::after) continue;
    for (int row = 0; row < tile.rows; ++row) {
      for (int column = 0; column < tile.columns; ++column) {
        const TexelPlace place{tile.face, tile.row + row, tile.column + column};
        const TexelPlace image = map(place);
        if (image.row < place.row || (image.row == place.row && image.column < place.column)) {
          first_[texel(row, column)] = 0;
        }
      }
    }
  }
  Range rows{tile.rows, -1};
  Range columns{tile.columns, -1};
  for (int row = 0; row < tile.rows; ++row) {
    for (int column = 0; column < tile.columns; ++column) {
      if (!first_[texel(row, column)]) continue;
      rows = {std::min(rows.low, row), row};
      columns = {std::min(columns.low, column), std::max(columns.high, column)};
    }
  }
  if (rows.high < 0) return false;
  const Tile inner{tile.face, tile.row + rows.low, tile.column + columns.low, rows.high - rows.low + 1,
                   columns.high - columns.low + 1};
  std::size_t to = 0;
  for (int row = rows.low; row <= rows.high; ++row) {
    for (int column = columns.low; column <= columns.high; ++column) {
      first_[to++] = first_[texel(row, column)];
    }
  }
  tile_ = inner;
  return true;
}

glm::dvec2 TapBuilder::target_corner(int row, int column) const {
  return {2.0 * (tile_.column + column) / job_.target.width - 1.0,
          1.0 - 2.0 * (tile_.row + row) / job_.target.height};
}

Quad TapBuilder::quad(int row, int column) const {
  const std::size_t a = corner(row, column);
  const std::size_t b = corner(row + 1, column);
  const std::vector<double>& x = positions_.x;
  const std::vector<double>& y = positions_.y;
  return {glm::dvec2(x[a], y[a]), {x[a + 1], y[a + 1]}, {x[b + 1], y[b + 1]}, {x[b], y[b]}};
}

void TapBuilder::find_corners() {
  positions_.resize(corner(tile_.rows + 1, 0));
  for (int row = 0; row <= tile_.rows; ++row) {
    lookup_.find(tile_.face, target_corner(row, 0).y, tile_.column,
                 static_cast<std::size_t>(tile_.columns) + 1, positions_, corner(row, 0));
  }
  if (!job_.is_periodic()) return;
  // A panorama's columns go on across its seam, so that neighbours are never half a turn apart.
  const double width = job_.width();
  const auto follow = [&](std::size_t i, std::size_t before) {
    const double step = positions_.x[i] - positions_.x[before];
    if (step > 0.5 * width || step < -0.5 * width) positions_.x[i] -= width * std::round(step / width);
  };
  for (int row = 0; row <= tile_.rows; ++row) {
    if (row > 0) follow(corner(row, 0), corner(row - 1, 0));
    for (int column = 1; column <= tile_.columns; ++column)
      follow(corner(row, column), corner(row, column - 1));
  }
}

void TapBuilder::classify() {
  const std::size_t columns = static_cast<std::size_t>(tile_.columns);
  kinds_.resize(texel(tile_.rows, 0));
  shares_.resize(kinds_.size());
  const ProjectionKind kind = job_.target.projection.kind;
  const bool round = kind != ProjectionKind::cube && kind != ProjectionKind::latlong;
  for (int row = 0; row < tile_.rows; ++row) {
    std::uint8_t* kinds = kinds_.data() + texel(row, 0);
    kernels_.classify(positions_.from(corner(row, 0)), positions_.from(corner(row + 1, 0)), columns, limits_,
                      job_.filter == ResampleFilter::automatic, kinds, shares_.data() + texel(row, 0));
    for (int column = 0; column < tile_.columns; ++column) {
      if (!first_[texel(row, column)]) {
        kinds[column] = 0;
      } else if (round && disc_extent(kind, target_corner(row, column), target_corner(row + 1, column + 1)) ==
                              DiscExtent::crosses_rim) {
        kinds[column] = kIrregular;
      }
    }
  }
}

void TapBuilder::add_by_center() {
  positions_.resize(static_cast<std::size_t>(tile_.columns));
  const auto add = [&](const TexelPlace& place, double weight) { add_tap(place, weight); };
  for (int row = 0; row < tile_.rows; ++row) {
    lookup_.find(tile_.face, row_center(tile_.row + row, job_.target.height), tile_.column,
                 static_cast<std::size_t>(tile_.columns), positions_, 0);
    for (int column = 0; column < tile_.columns; ++column) {
      if (!first_[texel(row, column)]) continue;
      const std::size_t i = static_cast<std::size_t>(column);
      const int face = positions_.face[i];
      if (face >= 0 && job_.filter == ResampleFilter::nearest) {
        add_tap({face, std::clamp(static_cast<int>(positions_.y[i]), 0, job_.height() - 1),
                 std::clamp(static_cast<int>(positions_.x[i]), 0, job_.width() - 1)},
                1.0);
      } else if (face >= 0 && !add_bilinear(face, positions_.x[i] - 0.5, positions_.y[i] - 0.5)) {
        emit_bilinear(job_.source, face, positions_.x[i], positions_.y[i], add);
      }
      end_target(row, column);
    }
  }
}

// Between the centres of four texels of one face, in texels from the first centre.
bool TapBuilder::add_bilinear(int face, double x, double y) {
  const int left = static_cast<int>(x);
  const int top = static_cast<int>(y);
  if (!(x >= 0.0) || !(y >= 0.0) || left + 1 >= job_.width() || top + 1 >= job_.height()) return false;
  const double fx = x - left;
  const double fy = y - top;
  reserve_taps(4);
  PendingTap* tap = taps_.data() + tap_count_;
  const auto add = [&](int row, int column, double weight) {
    *tap++ = {narrow(row), narrow(column), static_cast<std::uint8_t>(face), static_cast<float>(weight)};
  };
  add(top, left, (1.0 - fx) * (1.0 - fy));
  add(top, left + 1, fx * (1.0 - fy));
  add(top + 1, left, (1.0 - fx) * fy);
  add(top + 1, left + 1, fx * fy);
  tap_count_ += 4;
  return true;
}

void TapBuilder::add_tap(const TexelPlace& texel, double weight) {
  if (tap_count_ == taps_.size()) reserve_taps(1);
  taps_[tap_count_++] = {narrow(texel.row), narrow(texel.column), static_cast<std::uint8_t>(texel.face),
                         static_cast<float>(weight)};
}

void TapBuilder::reserve_taps(std::size_t count) {
  if (tap_count_ + count > taps_.size()) taps_.resize(2 * taps_.size() + count + 1024);
}

void TapBuilder::end_target(int row, int column) {
  targets_.push_back({narrow(tile_.row + row), narrow(tile_.column + column),
                      static_cast<std::uint32_t>(tap_count_ - target_begin_)});
  target_begin_ = tap_count_;
}

void TapBuilder::add_area(int row, int column) {
  const int face = positions_.face[corner(row, column)];
  coverage_.rasterize(quad(row, column));
  reserve_taps(coverage_.most_pixels());
  PendingTap* tap = taps_.data() + tap_count_;
  const int width = job_.width();
  const int height = job_.height();
  const bool periodic = job_.is_periodic();
  const double* weights = job_.weights.empty() ? nullptr : job_.weights.data();
  coverage_.for_each_pixel([&](int x, int y, double area) {
    if (y < 0 || y >= height) return;
    if (periodic) {
      if (x < 0) x += width;
      if (x >= width) x -= width;
      area *= weights[y];
    } else if (x < 0 || x >= width) {
      return;
    } else if (weights != nullptr) {
      area *= weights[static_cast<std::ptrdiff_t>(y) * width + x];
    }
    *tap++ = {narrow(y), narrow(x), static_cast<std::uint8_t>(face), static_cast<float>(area)};
  });
  tap_count_ = static_cast<std::size_t>(tap - taps_.data());
  if (tap_count_ == target_begin_) {
    // Far smaller than a texel of the source.
    const glm::dvec2 at = quad(row, column)[0];
    add_tap(place_at(job_.source, face, std::clamp(static_cast<int>(at.y), 0, job_.height() - 1),
                     std::clamp(static_cast<int>(at.x), 0, job_.width() - 1)),
            1.0);
  }
  end_target(row, column);
}

// Weights of the taps of the filter `area`, which move_pending() has moved first.
void TapBuilder::weigh(TapChunk& chunk) const {
  kernels_.multiply_density(job_.density, chunk.rows.data(), chunk.columns.data(), chunk.weights.size(),
                            chunk.weights.data());
  float* weights = chunk.weights.data();
  for (const TapGroup& group : chunk.groups) {
    for (std::uint32_t i = 0; i < group.targets; ++i, weights += group.taps) {
      double sum = 0.0;
      for (std::uint32_t k = 0; k < group.taps; ++k) sum += static_cast<double>(weights[k]);
      const double scale = 1.0 / sum;
      for (std::uint32_t k = 0; k < group.taps; ++k) {
        weights[k] = static_cast<float>(scale * static_cast<double>(weights[k]));
      }
    }
  }
}

void TapBuilder::add_mixed(int row, int column) {
  const int face = positions_.face[corner(row, column)];
  const Quad quad = this->quad(row, column);
  const double share = static_cast<double>(shares_[texel(row, column)]);
  interpolated_.integrate(quad);
  if (!(interpolated_.area() > 0.0)) {
    emit_bilinear(job_.source, face, quad[0].x, quad[0].y,
                  [&](const TexelPlace& place, double weight) { add_tap(place, weight); });
    return end_target(row, column);
  }
  interpolated_.scale(share / interpolated_.area());
  if (share < 1.0) {
    covered_.clear();
    double total = 0.0;
    coverage_.rasterize(quad);
    coverage_.for_each_pixel([&](int x, int y, double area) {
      if (y < 0 || y >= job_.height() || (!job_.is_periodic() && (x < 0 || x >= job_.width()))) return;
      area *= job_.weight(y, x);
      total += area;
      covered_.push_back({{face, y, x}, area});
    });
    for (const Tap& tap : covered_) {
      interpolated_.add(tap.texel.column, tap.texel.row, (1.0 - share) / total * tap.weight);
    }
  }
  if (interpolated_.is_within(job_.width(), job_.height())) {
    reserve_taps(interpolated_.most_texels());
    PendingTap* tap = taps_.data() + tap_count_;
    interpolated_.for_each_texel([&](int x, int y, double weight) {
      *tap++ = {narrow(y), narrow(x), static_cast<std::uint8_t>(face), static_cast<float>(weight)};
    });
    tap_count_ = static_cast<std::size_t>(tap - taps_.data());
    return end_target(row, column);
  }
  interpolated_.for_each_texel([&](int x, int y, double weight) {
    emit_texel(job_.source, face, y, x, weight,
               [&](const TexelPlace& place, double part) { add_tap(place, part); });
  });
  end_target(row, column);
}

void TapBuilder::add_irregular(int row, int column, TapChunk& chunk) {
  const auto taps =
      irregular_.find(tile_.face, target_corner(row, column), target_corner(row + 1, column + 1));
  if (!taps) {
    chunk.giants.push_back({tile_.face, tile_.row + row, tile_.column + column});
    return;
  }
  for (const Tap& tap : *taps) add_tap(tap.texel, tap.weight);
  end_target(row, column);
}

// In the order of the number of their taps, so that the loops over them run equally long for many at once.
void TapBuilder::move_pending(TapChunk& chunk) {
  std::uint32_t most = 0;
  for (const PendingTarget& target : targets_) most = std::max(most, target.taps);
  counts_.assign(static_cast<std::size_t>(most) + 1, 0);
  for (const PendingTarget& target : targets_) ++counts_[target.taps];
  starts_.assign(counts_.size(), 0);  // of targets
  std::size_t target_count = chunk.target_rows.size();
  for (std::size_t n = 0; n < counts_.size(); ++n) {
    starts_[n] = static_cast<std::uint32_t>(target_count);
    if (counts_[n] > 0) chunk.groups.push_back({static_cast<std::uint32_t>(n), counts_[n]});
    target_count += counts_[n];
  }
  // Of taps, by the group: where the next target's go.
  std::size_t tap_count = chunk.weights.size();
  std::vector<std::size_t>& tap_starts = tap_starts_;
  tap_starts.assign(counts_.size(), 0);
  for (std::size_t n = 0; n < counts_.size(); ++n) {
    tap_starts[n] = tap_count;
    tap_count += n * counts_[n];
  }
  chunk.target_rows.resize(target_count);
  chunk.target_columns.resize(target_count);
  chunk.faces.resize(tap_count);
  chunk.rows.resize(tap_count);
  chunk.columns.resize(tap_count);
  chunk.weights.resize(tap_count);
  const PendingTap* tap = taps_.data();
  for (const PendingTarget& target : targets_) {
    const std::size_t i = starts_[target.taps]++;
    chunk.target_rows[i] = target.row;
    chunk.target_columns[i] = target.column;
    std::size_t& to = tap_starts[target.taps];
    for (std::uint32_t k = 0; k < target.taps; ++k, ++tap, ++to) {
      chunk.rows[to] = tap->row;
      chunk.columns[to] = tap->column;
      chunk.faces[to] = tap->face;
      chunk.weights[to] = tap->weight;
      chunk.on_one_face = chunk.on_one_face && tap->face == taps_[0].face;
    }
  }
  if (tap_count_ > 0) {
    chunk.on_one_face = chunk.on_one_face && chunk.faces[0] == taps_[0].face;
  }
  targets_.clear();
  tap_count_ = 0;
  target_begin_ = 0;
}

}  // namespace mirrorbake
