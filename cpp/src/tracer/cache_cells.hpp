#pragma once

#include <cstdint>
#include <span>
#include <vector>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "barycentric.hpp"
#include "mirrorbake/scene/scene.hpp"
#include "surface.hpp"

namespace mirrorbake::tracing {

struct World;

/// Cells of all diffuse surfaces, between whose corners the irradiance cache interpolates: triangles, and
/// near the object in focus halves of triangles, again and again. The corners of cells are the cache's nodes:
/// one per vertex, or per face that meets there where faces are flat.
class CacheCells {
 public:
  /// One of the cells that meet at a node.
  struct Corner {
    std::uint32_t object;
    std::uint32_t triangle;
    std::uint32_t cell;    ///< kNone: the whole triangle
    std::uint32_t corner;  ///< 0…2
  };
  static constexpr std::uint32_t kNone = ~0U;

  CacheCells() = default;
  /// `focus`: number of an object, or less than 0 for none.
  CacheCells(const World& world, int focus);

  std::size_t node_count() const { return first_corner_.empty() ? 0 : first_corner_.size() - 1; }
  /// All nodes, in an order that goes from one to a close one nearly everywhere: along the curve that halving
  /// triangles draws on them.
  const std::vector<std::uint32_t>& along_curve() const { return along_curve_; }
  /// Of an object, those at its vertices.
  std::size_t vertex_nodes(std::uint32_t object) const { return vertex_nodes_[object]; }
  bool is_vertex(std::size_t node) const { return node < first_cut_; }
  std::span<const Corner> corners(std::size_t node) const {
    return {corners_.data() + first_corner_[node], corners_.data() + first_corner_[node + 1]};
  }
  glm::uvec3 nodes(const Corner& corner) const {
    return corner.cell == kNone ? triangle_nodes(corner.object, corner.triangle) : cells_[corner.cell].nodes;
  }

  /// Calls visit(node) for the corners of all cells that meet at a node: for itself and for each neighbour
  /// once per cell.
  template <typename Visit>
  void visit_around(std::size_t node, Visit visit) const {
    for (const Corner& corner : corners(node)) {
      const glm::uvec3 around = nodes(corner);
      for (int k = 0; k < 3; ++k) visit(around[k]);
    }
  }

  glm::vec3 position(const World& world, std::size_t node) const;

  /// Of `values` per node; 0 on objects without diffuse reflection.
  glm::vec3 interpolate(const std::vector<glm::vec3>& values, const Surface& surface) const {
    const auto object = static_cast<std::size_t>(surface.object);
    if (nodes_of_corner_[object].empty()) return glm::vec3(0.0F);
    if (!root_[object].empty()) {
      const std::uint32_t root = root_[object][surface.triangle];
      if (root != kNone) return interpolate_in_cells(values, root, surface.barycentric);
    }
    return tracing::interpolate(values, triangle_nodes(static_cast<std::uint32_t>(object), surface.triangle),
                                surface.barycentric);
  }

  /// A random point of the cell near its corner, seen from the side of `towards`. `u` in [0,1)².
  Surface surface_near(const World& world, const Corner& corner, glm::vec2 u, glm::vec3 towards) const;

 private:
  /// A triangle that is cut, or a part of one.
  struct Cell {
    glm::uvec3 nodes{0};
    glm::vec2 weights[3];              ///< of the triangle's second and third vertex, at the corners
    std::uint32_t first_part = kNone;  ///< of two: that with the corner after `apex`
    std::uint8_t apex = 0;             ///< the corner that the cut goes through
  };
  class Refiner;

  glm::uvec3 triangle_nodes(std::uint32_t object, std::uint32_t triangle) const {
    const std::uint32_t* node = &nodes_of_corner_[object][3 * std::size_t{triangle}];
    return {node[0], node[1], node[2]};
  }
  glm::vec3 interpolate_in_cells(const std::vector<glm::vec3>& values, std::uint32_t root,
                                 glm::vec2 weights) const;
  /// Nodes at the vertices of an object.
  void add_object(const World& world, std::uint32_t object);
  /// The cells that meet at each node.
  void list_corners();
  template <typename Visit>
  void visit_cells(Visit visit) const;

  std::uint32_t nodes_ = 0;
  std::uint32_t first_cut_ = 0;              ///< the first node that is no vertex
  std::vector<std::uint32_t> vertex_nodes_;  ///< per object
  /// Three per triangle, per object; empty for objects without diffuse reflection.
  std::vector<std::vector<std::uint32_t>> nodes_of_corner_;
  /// The cell of each triangle, kNone for most, per object; empty for objects of which no triangle is cut.
  std::vector<std::vector<std::uint32_t>> root_;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> along_curve_;
  /// Corners of each node: corners_[first_corner_[node]] … corners_[first_corner_[node + 1]].
  std::vector<std::uint32_t> first_corner_;
  std::vector<Corner> corners_;
};

}  // namespace mirrorbake::tracing
