#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lobe_kernels.hpp"
#include "lobe_plan.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "source_texels.hpp"

/// The light of a map in the cells of a cube, and in cells of twice, four times … their width.
namespace mirrorbake {

class MomentGrid {
 public:
  static constexpr int kLargest = 512;  ///< cells along a side of a face

  /// Of channels first_channel, +1 and +2 of the finest level, as far as they exist.
  MomentGrid(const EnvMapView& map, int first_channel, const SourceTexels& texels, int cells);

  int cells() const { return cells_; }
  const MomentNode* nodes() const { return nodes_.data(); }

  /// Appends the nodes to look at for all directions within a chord `radius` of `center`, none of cells
  /// smaller than those of a grid of `cells`.
  void find(const LobePlan& plan, int cells, const float* center, float radius,
            std::vector<std::uint32_t>& list) const;

  /// Cells along a side of a face for nodes of at most that many radians.
  static int cells_for(double node_width);

 private:
  // What decides whether four cells that share a parent are looked at, read together.
  struct Quad {
    float direction[3][4];
    float bound[4];
    float width[4];  ///< in radians
  };
  void fill_quads(const std::vector<std::vector<float>>& widths);

  // Cells of a level lie face by face and in each along a Z, so that those of cell i are 4 i … 4 i + 3.
  int cells_;
  int levels_;
  std::vector<std::size_t> offsets_;  ///< of the levels, the finest first
  std::vector<MomentNode> nodes_;
  std::vector<Quad> quads_;  ///< of every four nodes, without the coarsest level
};

}  // namespace mirrorbake
