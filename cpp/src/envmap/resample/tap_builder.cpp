#include "tap_builder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/projection/traits.hpp"

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

// Whether there are texels beyond a rim that may be interpolated.
bool goes_on_beyond_rim(ProjectionKind kind) {
  const Rim rim = traits(kind).rim;
  return rim == Rim::direction || rim == Rim::boundary;
}

// Maps have at most 65536 rows and columns.
std::uint16_t narrow(int index) { return static_cast<std::uint16_t>(index); }

}  // namespace

TexelLines::TexelLines(const ResampleJob& job)
    : corners(job.target.projection,
              looks_at_centers(job.filter) ? std::vector<double>() : side_coordinates(job.target.width)),
      centers(job.target.projection,
              looks_at_centers(job.filter) || goes_on_beyond_rim(job.target.projection.kind)
                  ? center_coordinates(job.target.width)
                  : std::vector<double>()) {}

std::size_t TapChunk::bytes() const {
  const auto size = [](const auto& vector) { return vector.size() * sizeof(vector[0]); };
  return size(blocks.groups) + size(blocks.target_rows) + size(blocks.target_columns) + size(blocks.rows) +
         size(blocks.columns) + size(blocks.weights) + size(lists.target_rows) + size(lists.target_columns) +
         size(lists.counts) + size(lists.faces) + size(lists.rows) + size(lists.columns) +
         size(lists.weights) + size(giants);
}

void TapChunk::clear() {
  const auto empty = [](auto&... vectors) { (vectors.clear(), ...); };
  empty(blocks.groups, blocks.target_rows, blocks.target_columns, blocks.rows, blocks.columns, blocks.weights,
        lists.target_rows, lists.target_columns, lists.counts, lists.faces, lists.rows, lists.columns,
        lists.weights, giants);
}

bool may_have_first_texels(const Tile& tile, std::span<const SharedSymmetry> symmetries) {
  return std::none_of(symmetries.begin(), symmetries.end(), [&](const SharedSymmetry& symmetry) {
    return order_of_image(tile, symmetry.target) == Order::before;
  });
}

TapBuilder::TapBuilder(const ResampleJob& job, const TexelLines& lines,
                       std::span<const SharedSymmetry> symmetries)
    : job_(job),
      kernels_(resample_kernels()),
      symmetries_(symmetries),
      limits_(straight_limits(job.source, job.target)),
      corner_lookup_(job, lines.corners),
      center_lookup_(job, lines.centers),
      irregular_(job) {}

void TapBuilder::build(const Tile& tile, TapChunk& chunk) {
  chunk.clear();
  chunk.face = tile.face;
  if (!select_first_texels(tile)) return;
  const std::size_t size = corner(tile_.rows + 1, 0);
  kinds_.resize(size);
  shares_.resize(size);
  left_.resize(size);
  top_.resize(size);
  box_shapes_.resize(size);
  centers_.resize(size);
  if (looks_at_centers(job_.filter)) {
    look_at_centers();
  } else {
    positions_.resize(size);
    find_corners();
    classify();
  }
  find_blocks(chunk);
  sort_blocks(chunk.blocks);
  weigh_blocks(chunk.blocks);
}

// Marks the texels that no symmetry takes to one before them, and sets the present tile to the rectangle
// around them.
bool TapBuilder::select_first_texels(const Tile& tile) {
  tile_ = tile;
  first_.assign(static_cast<std::size_t>(tile.rows) * static_cast<std::size_t>(tile.columns), 1);
  const auto texel = [&](int row, int column) {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(tile.columns) +
           static_cast<std::size_t>(column);
  };
  bool all_are_first = true;
  for (const SharedSymmetry& symmetry : symmetries_.subspan(1)) {  // but for the identity
    const TexelMap& map = symmetry.target;
    const Order order = order_of_image(tile, map);
    if (order == Order::before) return false;
    if (order == Order::after) continue;
    all_are_first = false;
    const FaceMap& to = map.faces[static_cast<std::size_t>(tile.face)];
    std::uint8_t* first = first_.data();
    for (int row = tile.row; row < tile.row + tile.rows; ++row) {
      const int row_image = to.row_per_row * row + to.row_offset;
      const int column_image = to.column_per_row * row + to.column_offset;
      for (int column = tile.column; column < tile.column + tile.columns; ++column, ++first) {
        const int r = row_image + to.row_per_column * column;
        int c = column_image + to.column_per_column * column;
        c += c < 0 ? map.width : 0;
        c -= c >= map.width ? map.width : 0;
        *first &= static_cast<std::uint8_t>((r > row) | ((r == row) & (c >= column)));
      }
    }
  }
  if (all_are_first) return true;
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

Quad TapBuilder::quad(std::size_t texel) const {
  const std::size_t a = texel;
  const std::size_t b = texel + corner(1, 0);
  const std::vector<double>& x = positions_.x;
  const std::vector<double>& y = positions_.y;
  return {glm::dvec2(x[a], y[a]), {x[a + 1], y[a + 1]}, {x[b + 1], y[b + 1]}, {x[b], y[b]}};
}

void TapBuilder::find_corners() {
  for (int row = 0; row <= tile_.rows; ++row) {
    corner_lookup_.find(tile_.face, target_corner(row, 0).y, tile_.column,
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
  const FaceSize face{job_.width(), job_.height(), job_.is_periodic()};
  const ProjectionKind kind = job_.target.projection.kind;
  const bool on_rim = disc_extent(kind, target_corner(0, 0), target_corner(tile_.rows, tile_.columns)) ==
                      DiscExtent::crosses_rim;
  const bool may_be_beyond = may_reach_beyond_rim();
  for (int row = 0; row < tile_.rows; ++row) {
    const std::size_t first = corner(row, 0);
    const PositionArrays above = positions_.from(first);
    const PositionArrays below = positions_.from(corner(row + 1, 0));
    kernels_.classify(above, below, columns, limits_, job_.filter == ResampleFilter::automatic,
                      kinds_.data() + first, shares_.data() + first);
    for (int column = 0; column < tile_.columns && on_rim; ++column) {
      if (disc_extent(kind, target_corner(row, column), target_corner(row + 1, column + 1)) ==
          DiscExtent::crosses_rim) {
        kinds_[corner(row, column)] = kIrregular;
      }
    }
    if (traits(job_.projection().kind).rim == Rim::singular) fade_interpolation(row);
    kernels_.find_boxes(above, below, kinds_.data() + first, columns, face, boxes_from(first));
    if (!may_be_beyond) continue;
    find_centers(row);
    for (int column = 0; column < tile_.columns; ++column) {
      if (is_beyond_rim(row, column)) look_at_center(corner(row, column));
    }
  }
}

void TapBuilder::fade_interpolation(int row) {
  for (std::size_t i = corner(row, 0); i < corner(row, tile_.columns); ++i) {
    if (kinds_[i] == kIrregular || shares_[i] == 0.0F) continue;
    const Quad image = quad(i);
    const glm::dvec2 middle = 0.25 * (image[0] + image[1] + image[2] + image[3]);
    shares_[i] *= static_cast<float>(interpolable(job_.source, middle));
    if (shares_[i] < 1.0F) kinds_[i] = shares_[i] > 0.0F ? kBlend : kArea;
  }
}

// Texels beyond the rim have no solid angle; those that lookups along the rim read are made like all others.
bool TapBuilder::is_beyond_rim(int row, int column) const {
  const glm::dvec2 a = glm::abs(target_corner(row, column));
  const glm::dvec2 b = glm::abs(target_corner(row + 1, column + 1));
  return glm::length(glm::min(a, b)) > 1.0 + 4.0 / job_.target.width;
}

bool TapBuilder::may_reach_beyond_rim() const {
  if (!goes_on_beyond_rim(job_.target.projection.kind)) return false;
  return glm::length(glm::max(glm::abs(target_corner(0, 0)),
                              glm::abs(target_corner(tile_.rows, tile_.columns)))) > 1.0;
}

void TapBuilder::look_at_centers() {
  for (int row = 0; row < tile_.rows; ++row) {
    find_centers(row);
    for (std::size_t i = corner(row, 0); i < corner(row, tile_.columns); ++i) look_at_center(i);
  }
}

void TapBuilder::find_centers(int row) {
  center_lookup_.find(tile_.face, row_center(tile_.row + row, job_.target.height), tile_.column,
                      static_cast<std::size_t>(tile_.columns), centers_, corner(row, 0));
}

// Makes a texel from those around its centre, or from that at its centre.
void TapBuilder::look_at_center(std::size_t texel) {
  kinds_[texel] = kAtCenter;
  const double x = centers_.x[texel];
  const double y = centers_.y[texel];
  const bool nearest = job_.filter == ResampleFilter::nearest;
  const int size = nearest ? 1 : 2;
  const int left = nearest ? std::min(static_cast<int>(x), job_.width() - 1) : floor_of(x - 0.5);
  const int top = nearest ? std::min(static_cast<int>(y), job_.height() - 1) : floor_of(y - 0.5);
  const bool beside = left < 0 || left + size > job_.width();
  const bool fits = centers_.face[texel] >= 0 && top >= 0 && top + size <= job_.height() &&
                    size <= job_.width() && (job_.is_periodic() || !beside);
  const std::uint32_t length = static_cast<std::uint32_t>(size);
  left_[texel] = left;
  top_[texel] = top;
  box_shapes_[texel] = fits ? pack({length, length, centers_.face[texel], kAtCenter}) : 0U;
}

void TapBuilder::find_blocks(TapChunk& chunk) {
  shapes_.clear();
  counts_.clear();
  blocks_.clear();
  const std::uint8_t* first = first_.data();
  for (int row = 0; row < tile_.rows; ++row) {
    for (int column = 0; column < tile_.columns; ++column) {
      if (!*first++) continue;
      const std::size_t i = corner(row, column);
      const std::uint32_t shape = box_shapes_[i];
      if (shape == 0) {
        add_list(row, column, chunk);
        continue;
      }
      // Shapes by a few of their bits, if no other one has them.
      std::uint16_t& guess = guesses_[(shape ^ shape >> 7U ^ shape >> 20U) % guesses_.size()];
      if (guess >= shapes_.size() || shapes_[guess] != shape) {
        const auto known = std::find(shapes_.begin(), shapes_.end(), shape);
        guess = narrow(static_cast<int>(known - shapes_.begin()));
        if (known == shapes_.end()) {
          shapes_.push_back(shape);
          counts_.push_back(0);
        }
      }
      const std::uint16_t k = guess;
      ++counts_[k];
      blocks_.push_back({static_cast<std::uint32_t>(i), narrow(row), k});
    }
  }
}

void TapBuilder::sort_blocks(TapChunk::Blocks& blocks) {
  std::uint32_t start = 0;
  starts_.clear();
  for (const std::uint32_t count : counts_) {
    starts_.push_back(start);
    start += count;
  }
  for (auto* values : {&blocks.rows, &blocks.columns, &blocks.target_rows, &blocks.target_columns}) {
    values->resize(blocks_.size());
  }
  sorted_.resize(blocks_.size());
  blocks.left = std::numeric_limits<int>::max();
  blocks.right = std::numeric_limits<int>::min();
  for (const Block& block : blocks_) {
    const std::size_t to = starts_[block.shape]++;
    const std::uint32_t i = block.texel;
    const int left = left_[i];
    blocks.left = std::min(blocks.left, left);
    blocks.right = std::max(blocks.right, left + static_cast<int>(unpack(shapes_[block.shape]).columns));
    const int turn = left < 0 ? job_.width() : left >= job_.width() ? -job_.width() : 0;
    sorted_[to] = i;
    blocks.rows[to] = narrow(top_[i]);
    blocks.columns[to] = narrow(left + turn);
    blocks.target_rows[to] = narrow(tile_.row + block.row);
    blocks.target_columns[to] = narrow(tile_.column + static_cast<int>(i - corner(block.row, 0)));
  }
}

void TapBuilder::weigh_blocks(TapChunk::Blocks& blocks) {
  std::size_t taps = 0;
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    const BoxShape shape = unpack(shapes_[k]);
    taps += static_cast<std::size_t>(shape.rows) * shape.columns * counts_[k];
    blocks.groups.push_back({shape.face, shape.rows, shape.columns, counts_[k]});
  }
  blocks.weights.resize(taps);
  const TileImages tile{positions_.from(0), corner(1, 0), shares_.data()};
  const TexelWeights source = job_.texel_weights();
  float* weights = blocks.weights.data();
  const std::uint32_t* texels = sorted_.data();
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    const BoxShape shape = unpack(shapes_[k]);
    if (shape.kind == kAtCenter) {
      interpolate_at_centers({texels, counts_[k]}, weights);
    } else {
      kernels_.find_weights(tile, boxes_from(0), source, shape, texels, counts_[k], weights);
    }
    texels += counts_[k];
    weights += static_cast<std::size_t>(shape.rows) * shape.columns * counts_[k];
  }
}

void TapBuilder::interpolate_at_centers(std::span<const std::uint32_t> texels, float* weights) const {
  for (const std::uint32_t i : texels) {
    if (job_.filter == ResampleFilter::nearest) {
      *weights++ = 1.0F;
      continue;
    }
    const double x = centers_.x[i] - 0.5 - left_[i];
    const double y = centers_.y[i] - 0.5 - top_[i];
    for (const double down : {1.0 - y, y}) {
      *weights++ = static_cast<float>((1.0 - x) * down);
      *weights++ = static_cast<float>(x * down);
    }
  }
}

void TapBuilder::add_list(int row, int column, TapChunk& chunk) {
  const std::size_t i = corner(row, column);
  TapChunk::Lists& lists = chunk.lists;
  const std::size_t before = lists.weights.size();
  const auto add = [&](const FaceTexel& texel, double weight) {
    lists.faces.push_back(static_cast<std::uint8_t>(texel.face));
    lists.rows.push_back(narrow(texel.row));
    lists.columns.push_back(narrow(texel.column));
    lists.weights.push_back(static_cast<float>(weight));
  };
  if (kinds_[i] == kAtCenter) {
    const int face = centers_.face[i];
    if (face >= 0) emit_bilinear(job_.source, face, centers_.x[i], centers_.y[i], add);
  } else {
    const auto taps =
        kinds_[i] == kIrregular
            ? irregular_.find(tile_.face, target_corner(row, column), target_corner(row + 1, column + 1))
            : irregular_.find_straight(positions_.face[i], quad(i), static_cast<double>(shares_[i]));
    if (!taps) {
      chunk.giants.push_back({tile_.face, tile_.row + row, tile_.column + column});
      return;
    }
    for (const Tap& tap : *taps) add(tap.texel, tap.weight);
  }
  lists.target_rows.push_back(narrow(tile_.row + row));
  lists.target_columns.push_back(narrow(tile_.column + column));
  lists.counts.push_back(static_cast<std::uint32_t>(lists.weights.size() - before));
}

}  // namespace mirrorbake
