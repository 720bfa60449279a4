#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "lobe_kernels.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "source_texels.hpp"

/// The texels of a map in blocks of 4 × 4, those in blocks of 2 × 2 blocks, and so on, to find the texels
/// about a direction or on both sides of a great circle.
namespace mirrorbake {

class TexelBlocks {
 public:
  TexelBlocks(const EnvMapLayout& layout, const SourceTexels& texels);

  /// Appends the numbers of all texels (faces, rows, columns) whose middle lies within a chord of the unit
  /// vector r.
  void find_near(const glm::dvec3& r, double chord, std::vector<std::uint32_t>& found) const;

  /// Σ Ω L l over the texels of every block, of up to three channels, and Σ Ω l in the fourth: for
  /// sum_cosines().
  void make_moments(const EnvMapView& map, int first_channel, const SourceTexels& texels);

  /// Σ Ω L max(0, r·l) over all texels, and Σ Ω max(0, r·l) in the fourth place. Of blocks before the great
  /// circle about r only the first moment counts, those behind it do not; along it every texel is looked at.
  /// `leaves` is working memory.
  std::array<double, 4> sum_cosines(const glm::dvec3& r, std::vector<std::uint32_t>& leaves) const;

  const glm::vec3& direction(std::size_t texel) const { return directions_[texel]; }

 private:
  struct Block {
    glm::vec3 middle{0.0F};
    float reach = -1.0F;  ///< distance from `middle` of its farthest texel; below 0: it has none
  };
  struct Level {
    int width = 0;  ///< blocks of a face
    int height = 0;
    std::vector<Block> blocks;
    std::vector<std::array<std::array<double, 4>, 3>> moments;
  };
  struct Place {
    std::uint32_t level;
    std::uint32_t face;
    std::uint32_t row;
    std::uint32_t column;
  };
  class Walk;

  std::size_t block_index(const Place& p) const {
    const Level& level = levels_[p.level];
    return (static_cast<std::size_t>(p.face) * static_cast<std::size_t>(level.height) + p.row) *
               static_cast<std::size_t>(level.width) +
           p.column;
  }
  Place place_of(std::uint32_t number, std::size_t index) const {
    const Level& level = levels_[number];
    const std::size_t line = index / static_cast<std::size_t>(level.width);
    return {number, static_cast<std::uint32_t>(line / static_cast<std::size_t>(level.height)),
            static_cast<std::uint32_t>(line % static_cast<std::size_t>(level.height)),
            static_cast<std::uint32_t>(index % static_cast<std::size_t>(level.width))};
  }
  void bound_leaf(std::size_t index);
  void bound_parent(std::size_t level, std::size_t index);

  int faces_;
  int width_;  ///< of a face, in texels
  int height_;
  std::vector<glm::vec3> directions_;
  std::vector<LightLeaf> leaves_;  ///< of the blocks of the first level
  std::vector<Level> levels_;      ///< of 4 × 4 texels first
};

}  // namespace mirrorbake
