#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lobe_kernels.hpp"
#include "lobe_plan.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "source_texels.hpp"

/// The light of a map in the cells of a cube, and in cells of twice, four times … their width. Cells that are
/// bright beside the rest, by more than a point, are there in halves and quarters, too: their light is all
/// that a lobe shows at many times its width from them, and at its horizon.
namespace mirrorbake {

class MomentGrid {
 public:
  static constexpr int kLargest = 512;  ///< cells along a side of a face

  /// Of channels first_channel, +1 and +2 of the finest level, as far as they exist.
  MomentGrid(const EnvMapView& map, int first_channel, const SourceTexels& texels, int cells);

  int cells() const { return cells_; }
  const MomentNode* nodes() const { return nodes_.data(); }

  /// Appends the nodes to look at for all directions within a chord `radius` of `center`, none of cells
  /// smaller than those that a grid of `cells` has.
  void find(const LobePlan& plan, int cells, const float* center, float radius,
            std::vector<std::uint32_t>& list) const;

  /// Cells along a side of a face for nodes of at most that many radians.
  static int cells_for(double node_width);

 private:
  static constexpr std::uint32_t kNoChild = 0xffffffffU;
  // What decides whether four cells that share a parent are looked at, read together. Number q is of nodes
  // 4 q … 4 q + 3.
  struct Quad {
    float direction[3][4];
    float bound[4];
    float width[4];          ///< in radians
    std::uint32_t child[4];  ///< number of the quad of its parts
    bool bright[4];
  };

  void put(std::size_t at, const MomentNode& node, float width);
  void find_bright();
  bool is_bright(std::size_t at) const;
  void cut_bright(const EnvMapView& map, int first_channel, const SourceTexels& texels);

  int cells_;
  int levels_;
  std::vector<std::size_t> offsets_;  ///< of the levels, the finest first
  std::vector<MomentNode> nodes_;     ///< of the levels, and after them the parts of bright cells
  std::vector<Quad> quads_;
  std::array<float, 3> bright_{};  ///< radiance above which a channel counts as bright
};

}  // namespace mirrorbake
