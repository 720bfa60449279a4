#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "irregular_texels.hpp"
#include "line_lookup.hpp"
#include "resample_job.hpp"
#include "symmetry.hpp"

namespace mirrorbake {

/// A rectangle of texels of one face of the target.
struct Tile {
  int face = 0;
  int row = 0;
  int column = 0;
  int rows = 0;
  int columns = 0;
};

/// What texels of the target are made from: sums of weights times texels of the source. Of the texels that
/// symmetries take to each other it holds the first. Most are made from a rectangle of texels of one face, a
/// block; others from a list of taps, such as those across the edges of faces.
struct TapChunk {
  struct Blocks {
    std::vector<BlockGroup> groups;  ///< of targets, by face
    std::vector<std::uint16_t> target_rows;
    std::vector<std::uint16_t> target_columns;
    std::vector<std::uint16_t> rows;  ///< of the first texel, and its column, on the face
    std::vector<std::uint16_t> columns;
    std::vector<float> weights;  ///< row by row
    int left = 0;                ///< columns of all blocks, which go on across the seam of a panorama
    int right = 0;
  };
  struct Lists {
    std::vector<std::uint16_t> target_rows;
    std::vector<std::uint16_t> target_columns;
    std::vector<std::uint32_t> counts;
    std::vector<std::uint8_t> faces;  ///< of taps, and their rows, columns and weights
    std::vector<std::uint16_t> rows;
    std::vector<std::uint16_t> columns;
    std::vector<float> weights;
  };

  int face = 0;  ///< of the target
  Blocks blocks;
  Lists lists;
  std::vector<FaceTexel> giants;  ///< targets of more taps than are worth keeping: IrregularTexels::stream()

  std::size_t bytes() const;
  void clear();
};

/// Whether a tile may have texels that are the first of those that symmetries take to each other.
bool may_have_first_texels(const Tile& tile, std::span<const SharedSymmetry> symmetries);

/// What a TapBuilder for this job looks up along lines: corners of texels, their centres, or both.
struct TexelLines {
  explicit TexelLines(const ResampleJob& job);

  LineTables corners;
  LineTables centers;
};

/// Finds taps tile by tile. Positions and kinds of texels come from vectorised loops; then every texel's
/// image in the source, a quadrilateral, is laid over the texels of the source.
class TapBuilder {
 public:
  /// Keeps references to what it is given.
  TapBuilder(const ResampleJob& job, const TexelLines& lines, std::span<const SharedSymmetry> symmetries);

  void build(const Tile& tile, TapChunk& chunk);

 private:
  struct Block {
    std::uint32_t texel;
    std::uint16_t row;    // of the tile
    std::uint16_t shape;  // its place in shapes_
  };

  // Texels have the number of their corner above left.
  std::size_t corner(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(tile_.columns + 1) +
           static_cast<std::size_t>(column);
  }
  glm::dvec2 target_corner(int row, int column) const;
  Quad quad(std::size_t texel) const;
  BoxArrays boxes_from(std::size_t texel) {
    return {left_.data() + texel, top_.data() + texel, box_shapes_.data() + texel};
  }

  bool select_first_texels(const Tile& tile);
  void find_corners();
  void classify();
  void fade_interpolation(int row);
  void look_at_centers();
  void find_centers(int row);
  void look_at_center(std::size_t texel);
  bool may_reach_beyond_rim() const;
  bool is_beyond_rim(int row, int column) const;
  void find_blocks(TapChunk& chunk);
  void sort_blocks(TapChunk::Blocks& blocks);
  void weigh_blocks(TapChunk::Blocks& blocks);
  void interpolate_at_centers(std::span<const std::uint32_t> texels, float* weights) const;
  void add_list(int row, int column, TapChunk& chunk);

  const ResampleJob& job_;
  const ResampleKernels& kernels_;
  const std::span<const SharedSymmetry> symmetries_;
  const StraightLimits limits_;
  LineLookup corner_lookup_;
  LineLookup center_lookup_;
  IrregularTexels irregular_;

  Tile tile_;
  std::vector<std::uint8_t> first_;  // of those that symmetries take to each other
  Positions positions_;              // of corners
  Positions centers_;
  std::vector<std::uint8_t> kinds_;
  std::vector<float> shares_;
  std::vector<std::int32_t> left_, top_;
  std::vector<std::uint32_t> box_shapes_;
  std::vector<std::uint32_t> shapes_;           // that occur
  std::vector<std::uint32_t> counts_, starts_;  // of blocks, by shape
  std::array<std::uint16_t, 256> guesses_{};    // of places in shapes_
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> sorted_;  // texels, by shape
};

}  // namespace mirrorbake
