#pragma once

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
/// symmetries take to each other it holds the first.
struct TapChunk {
  int face = 0;  ///< of the target
  std::vector<std::uint16_t> target_rows;
  std::vector<std::uint16_t> target_columns;
  std::vector<TapGroup> groups;  ///< of targets

  std::vector<std::uint8_t> faces;  ///< of taps, and their rows, columns and weights
  std::vector<std::uint16_t> rows;
  std::vector<std::uint16_t> columns;
  std::vector<float> weights;
  bool on_one_face = true;  ///< whether all `faces` are the same

  std::vector<TexelPlace> giants;  ///< targets of more taps than are worth keeping: IrregularTexels::stream()

  std::size_t bytes() const;
  void clear();
};

/// Whether a tile may have texels that are the first of those that symmetries take to each other.
bool may_have_first_texels(const Tile& tile, std::span<const SharedSymmetry> symmetries);

/// What a TapBuilder for this job looks up along lines.
LineTables line_tables(const ResampleJob& job);

/// Finds taps tile by tile. Positions and kinds of texels come from vectorised loops; then every texel's image
/// in the source, a quadrilateral, is laid over the texels of the source.
class TapBuilder {
 public:
  /// Keeps references to what it is given.
  TapBuilder(const ResampleJob& job, const LineTables& lines, std::span<const SharedSymmetry> symmetries);

  void build(const Tile& tile, TapChunk& chunk);

 private:
  struct PendingTap {
    std::uint16_t row;
    std::uint16_t column;
    std::uint8_t face;
    float weight;
  };
  struct PendingTarget {
    std::uint16_t row;
    std::uint16_t column;
    std::uint32_t taps;
  };

  std::size_t texel(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(tile_.columns) +
           static_cast<std::size_t>(column);
  }
  std::size_t corner(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(tile_.columns + 1) +
           static_cast<std::size_t>(column);
  }
  glm::dvec2 target_corner(int row, int column) const;
  Quad quad(int row, int column) const;

  bool select_first_texels(const Tile& tile);
  void find_corners();
  void classify();
  void add_by_center();
  void add_area(int row, int column);
  void add_mixed(int row, int column);
  void add_irregular(int row, int column, TapChunk& chunk);
  bool add_bilinear(int face, double x, double y);
  void add_tap(const TexelPlace& texel, double weight);
  void reserve_taps(std::size_t count);
  void end_target(int row, int column);
  void move_pending(TapChunk& chunk);
  void weigh(TapChunk& chunk) const;

  const ResampleJob& job_;
  const ResampleKernels& kernels_;
  const std::span<const SharedSymmetry> symmetries_;
  const StraightLimits limits_;
  LineLookup lookup_;
  IrregularTexels irregular_;
  Coverage coverage_;
  BilinearMean interpolated_;

  Tile tile_;
  std::vector<std::uint8_t> first_;  // of those that symmetries take to each other
  Positions positions_;              // of corners or centres
  std::vector<std::uint8_t> kinds_;
  std::vector<float> shares_;
  std::vector<Tap> covered_;
  std::vector<PendingTarget> targets_;
  std::vector<PendingTap> taps_;  // the first tap_count_
  std::size_t tap_count_ = 0;
  std::size_t target_begin_ = 0;
  std::vector<std::uint32_t> counts_, starts_;
  std::vector<std::size_t> tap_starts_;
};

}  // namespace mirrorbake
