#include "mirrorbake/proxy/hull.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

/// Points in a tree of boxes, halved along their longest side, to ask whether any lies in front of a plane:
/// of most planes the boxes of a few nodes tell.
class PointTree {
 public:
  explicit PointTree(std::span<const glm::vec3> points) : points_(points.begin(), points.end()) {
    add(0, points_.size());
  }

  double diagonal() const { return glm::length(nodes_[0].high - nodes_[0].low); }

  /// Whether normal · p > limit for a point p.
  bool any_beyond(const glm::dvec3& normal, double limit) const {
    std::array<std::size_t, kDeepest> open;
    std::size_t count = 0;
    open[count++] = 0;
    while (count > 0) {
      const Node& node = nodes_[open[--count]];
      const glm::dvec3 farthest = glm::max(normal * node.low, normal * node.high);
      if (!(farthest.x + farthest.y + farthest.z > limit)) continue;
      if (node.second != 0) {
        open[count++] = static_cast<std::size_t>(&node - nodes_.data()) + 1;
        open[count++] = node.second;
        continue;
      }
      const auto begin = points_.begin() + static_cast<std::ptrdiff_t>(node.begin);
      const auto end = points_.begin() + static_cast<std::ptrdiff_t>(node.end);
      if (std::any_of(begin, end, [&](const glm::dvec3& p) { return glm::dot(normal, p) > limit; }))
        return true;
    }
    return false;
  }

 private:
  static constexpr std::size_t kLeaf = 8;
  static constexpr std::size_t kDeepest = 64;  // halving leaves a leaf after 61 steps at most

  struct Node {
    glm::dvec3 low, high;
    std::size_t begin, end;
    std::size_t second;  // of the children; the first follows its parent; 0: a leaf
  };

  void add(std::size_t begin, std::size_t end) {
    Node node{points_[begin], points_[begin], begin, end, 0};
    for (std::size_t i = begin; i < end; ++i) {
      node.low = glm::min(node.low, points_[i]);
      node.high = glm::max(node.high, points_[i]);
    }
    const std::size_t number = nodes_.size();
    nodes_.push_back(node);
    if (end - begin <= kLeaf) return;
    const glm::dvec3 side = node.high - node.low;
    const int axis = side.x >= side.y && side.x >= side.z ? 0 : side.y >= side.z ? 1 : 2;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto first = points_.begin();
    std::nth_element(first + static_cast<std::ptrdiff_t>(begin), first + static_cast<std::ptrdiff_t>(middle),
                     first + static_cast<std::ptrdiff_t>(end),
                     [axis](const glm::dvec3& a, const glm::dvec3& b) { return a[axis] < b[axis]; });
    add(begin, middle);
    nodes_[number].second = nodes_.size();
    add(middle, end);
  }

  std::vector<glm::dvec3> points_;
  std::vector<Node> nodes_;
};

}  // namespace

std::vector<std::uint8_t> hull_triangles(std::span<const glm::vec3> positions,
                                         std::span<const glm::uvec3> triangles, double tolerance) {
  check_finite("positions", positions);
  check_at_least("tolerance", tolerance, 0.0);
  check_triangles(triangles, positions.size());
  std::vector<std::uint8_t> on_hull(triangles.size(), 0);
  if (triangles.empty()) return on_hull;

  const PointTree tree(positions);
  const double slack = tolerance * tree.diagonal();
  constexpr std::size_t kGrain = 256;
  parallel_for(triangles.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const glm::dvec3 a(positions[triangles[i].x]);
      const glm::dvec3 normal =
          glm::cross(glm::dvec3(positions[triangles[i].y]) - a, glm::dvec3(positions[triangles[i].z]) - a);
      const double length = glm::length(normal);
      if (!(length > 0)) continue;
      on_hull[i] = !tree.any_beyond(normal, glm::dot(normal, a) + slack * length);
    }
  });
  return on_hull;
}

}  // namespace mirrorbake
