#include "texel_blocks.hpp"

#include <algorithm>
#include <glm/geometric.hpp>

#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

constexpr int kSide = 4;
static_assert(kSide * kSide == kLeafTexels);

int divide_up(int value, int by) { return (value + by - 1) / by; }

std::size_t to_size(int value) { return static_cast<std::size_t>(value); }

}  // namespace

// Depth first; what is entered at a level puts its children on the stack.
class TexelBlocks::Walk {
 public:
  explicit Walk(const TexelBlocks& blocks) : blocks_(blocks) {
    for (int face = 0; face < blocks.faces_; ++face) {
      stack_[depth_++] = {static_cast<std::uint32_t>(blocks.levels_.size()) - 1,
                          static_cast<std::uint32_t>(face), 0, 0};
    }
  }
  bool next(Place& place) {
    if (depth_ == 0) return false;
    place = stack_[--depth_];
    return true;
  }
  void enter(const Place& p) {
    const Level& finer = blocks_.levels_[p.level - 1];
    for (std::uint32_t k = 0; k < 4; ++k) {
      const std::uint32_t row = 2 * p.row + k / 2;
      const std::uint32_t column = 2 * p.column + k % 2;
      if (row < static_cast<std::uint32_t>(finer.height) &&
          column < static_cast<std::uint32_t>(finer.width)) {
        stack_[depth_++] = {p.level - 1, p.face, row, column};
      }
    }
  }
  template <typename Visit>
  void texels(const Place& p, const Visit& visit) const {
    const int last_row = std::min(blocks_.height_, static_cast<int>(p.row + 1) * kSide);
    const int last_column = std::min(blocks_.width_, static_cast<int>(p.column + 1) * kSide);
    for (int row = static_cast<int>(p.row) * kSide; row < last_row; ++row) {
      const std::size_t line = (p.face * to_size(blocks_.height_) + to_size(row)) * to_size(blocks_.width_);
      for (int column = static_cast<int>(p.column) * kSide; column < last_column; ++column) {
        visit(line + to_size(column));
      }
    }
  }

 private:
  const TexelBlocks& blocks_;
  std::array<Place, 128> stack_{};
  std::size_t depth_ = 0;
};

TexelBlocks::TexelBlocks(const EnvMapLayout& layout, const SourceTexels& texels)
    : faces_(face_count(layout.projection)), width_(texels.width()), height_(texels.height()) {
  const std::size_t rows = to_size(faces_) * to_size(height_);
  directions_.resize(rows * to_size(width_));
  parallel_for(rows, 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t line = begin; line < end; ++line) {
      const int face = static_cast<int>(line / to_size(height_));
      const int row = static_cast<int>(line % to_size(height_));
      for (int column = 0; column < width_; ++column) {
        // Texels outside of the disc of a round map are nowhere.
        directions_[line * to_size(width_) + to_size(column)] =
            texels.solid_angle(row, column) > 0.0 ? glm::vec3(texels.direction(face, row, column))
                                                  : glm::vec3(0.0F);
      }
    }
  });
  int width = divide_up(width_, kSide);
  int height = divide_up(height_, kSide);
  for (;;) {
    Level level{width, height, std::vector<Block>(to_size(faces_) * to_size(width) * to_size(height)), {}};
    levels_.push_back(std::move(level));
    const std::size_t number = levels_.size() - 1;
    parallel_for(levels_.back().blocks.size(), 512, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) number == 0 ? bound_leaf(i) : bound_parent(number, i);
    });
    if (width == 1 && height == 1) break;
    width = divide_up(width, 2);
    height = divide_up(height, 2);
  }
}

void TexelBlocks::bound_leaf(std::size_t index) {
  Level& level = levels_[0];
  const Place place = place_of(0, index);
  const Walk walk(*this);
  glm::dvec3 sum(0.0);
  int count = 0;
  const auto exists = [&](std::size_t t) { return directions_[t] != glm::vec3(0.0F); };
  walk.texels(place, [&](std::size_t t) {
    if (!exists(t)) return;
    sum += glm::dvec3(directions_[t]);
    ++count;
  });
  if (count == 0) return;
  Block& block = level.blocks[index];
  block.middle = glm::vec3(sum / static_cast<double>(count));
  float reach = 0.0F;
  walk.texels(place, [&](std::size_t t) {
    if (exists(t)) reach = std::max(reach, glm::length(directions_[t] - block.middle));
  });
  block.reach = reach * 1.000001F + 1e-7F;
}

void TexelBlocks::bound_parent(std::size_t number, std::size_t index) {
  const Level& finer = levels_[number - 1];
  Level& level = levels_[number];
  const std::size_t line = index / to_size(level.width);
  const std::size_t face = line / to_size(level.height);
  const int row = static_cast<int>(line % to_size(level.height));
  const int column = static_cast<int>(index % to_size(level.width));
  std::array<const Block*, 4> children{};
  int count = 0;
  glm::dvec3 sum(0.0);
  for (int r = 2 * row; r < std::min(2 * row + 2, finer.height); ++r) {
    for (int c = 2 * column; c < std::min(2 * column + 2, finer.width); ++c) {
      const Block& child =
          finer.blocks[(face * to_size(finer.height) + to_size(r)) * to_size(finer.width) + to_size(c)];
      if (child.reach < 0.0F) continue;
      children[to_size(count++)] = &child;
      sum += glm::dvec3(child.middle);
    }
  }
  if (count == 0) return;
  Block& block = level.blocks[index];
  block.middle = glm::vec3(sum / static_cast<double>(count));
  float reach = 0.0F;
  for (int i = 0; i < count; ++i) {
    const Block& child = *children[to_size(i)];
    reach = std::max(reach, glm::length(child.middle - block.middle) + child.reach);
  }
  block.reach = reach * 1.000001F + 1e-7F;
}

void TexelBlocks::find_near(const glm::dvec3& r, double chord, std::vector<std::uint32_t>& found) const {
  Walk walk(*this);
  Place place{};
  while (walk.next(place)) {
    const Block& block = levels_[place.level].blocks[block_index(place)];
    if (block.reach < 0.0F) continue;
    if (glm::length(r - glm::dvec3(block.middle)) - static_cast<double>(block.reach) > chord) continue;
    if (place.level > 0) {
      walk.enter(place);
      continue;
    }
    walk.texels(place, [&](std::size_t t) {
      const glm::dvec3 along = r - glm::dvec3(directions_[t]);
      if (glm::dot(along, along) <= chord * chord) found.push_back(static_cast<std::uint32_t>(t));
    });
  }
}

void TexelBlocks::make_moments(const EnvMapView& map, int first_channel, const SourceTexels& texels) {
  const std::size_t channels = to_size(map.layout.channels);
  const std::size_t used = std::min<std::size_t>(3, channels - to_size(first_channel));
  leaves_.assign(levels_[0].blocks.size(), {});
  levels_[0].moments.assign(leaves_.size(), {});
  parallel_for(leaves_.size(), 128, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Place place = place_of(0, i);
      LightLeaf& leaf = leaves_[i];
      auto& moments = levels_[0].moments[i];
      for (std::size_t t = 0; t < kLeafTexels; ++t) {
        const int row = static_cast<int>(place.row) * kSide + static_cast<int>(t) / kSide;
        const int column = static_cast<int>(place.column) * kSide + static_cast<int>(t) % kSide;
        if (row >= height_ || column >= width_) continue;
        const double angle = texels.solid_angle(row, column);
        if (!(angle > 0.0)) continue;
        const glm::dvec3 d = texels.direction(static_cast<int>(place.face), row, column);
        const float* texel =
            map.values.data() + to_size(first_channel) +
            map.layout.index(0, static_cast<int>(place.face), row / texels.parts(), column / texels.parts());
        std::array<double, 4> light{0.0, 0.0, 0.0, angle};
        for (std::size_t c = 0; c < used; ++c) light[c] = angle * static_cast<double>(texel[c]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          leaf.direction[axis][t] = static_cast<float>(d[static_cast<int>(axis)]);
          for (std::size_t c = 0; c < 4; ++c) moments[axis][c] += light[c] * d[static_cast<int>(axis)];
        }
        for (std::size_t c = 0; c < 4; ++c) leaf.light[c][t] = static_cast<float>(light[c]);
      }
    }
  });
  for (std::uint32_t number = 1; number < levels_.size(); ++number) {
    Level& level = levels_[number];
    const Level& finer = levels_[number - 1];
    level.moments.assign(level.blocks.size(), {});
    parallel_for(level.blocks.size(), 512, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Place place = place_of(number, i);
        for (std::uint32_t k = 0; k < 4; ++k) {
          const Place child{number - 1, place.face, 2 * place.row + k / 2, 2 * place.column + k % 2};
          if (child.row >= static_cast<std::uint32_t>(finer.height) ||
              child.column >= static_cast<std::uint32_t>(finer.width)) {
            continue;
          }
          const auto& part = finer.moments[block_index(child)];
          for (std::size_t axis = 0; axis < 3; ++axis) {
            for (std::size_t c = 0; c < 4; ++c) level.moments[i][axis][c] += part[axis][c];
          }
        }
      }
    });
  }
}

std::array<double, 4> TexelBlocks::sum_cosines(const glm::dvec3& r,
                                               std::vector<std::uint32_t>& leaves) const {
  std::array<std::array<double, 4>, 3> moments{};
  leaves.clear();
  Walk walk(*this);
  Place place{};
  while (walk.next(place)) {
    const std::size_t index = block_index(place);
    const Level& level = levels_[place.level];
    const Block& block = level.blocks[index];
    if (block.reach < 0.0F) continue;
    const double depth = glm::dot(r, glm::dvec3(block.middle));
    const double reach = static_cast<double>(block.reach);
    if (depth <= -reach) continue;
    if (depth >= reach) {
      const auto& part = level.moments[index];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t c = 0; c < 4; ++c) moments[axis][c] += part[axis][c];
      }
    } else if (place.level > 0) {
      walk.enter(place);
    } else {
      leaves.push_back(static_cast<std::uint32_t>(index));
    }
  }
  std::array<double, 4> sums{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t c = 0; c < 4; ++c) sums[c] += r[static_cast<int>(axis)] * moments[axis][c];
  }
  const std::array<float, 3> toward{static_cast<float>(r.x), static_cast<float>(r.y),
                                    static_cast<float>(r.z)};
  cosine_loop()(leaves_.data(), leaves.data(), leaves.size(), toward.data(), sums.data());
  return sums;
}

}  // namespace mirrorbake
