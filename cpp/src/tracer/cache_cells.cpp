#include "cache_cells.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <limits>
#include <map>
#include <utility>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "gather.hpp"
#include "world.hpp"

namespace mirrorbake::tracing {
namespace {

// Corners of a flat-shaded mesh share a node if their faces differ by less than acos(0.999) = 2.6°.
constexpr float kSameFace = 0.999F;
// A cell's longest edge is at most this part of its distance to the object in focus, with kReach of the
// diagonal of its box added: what a mirror shows of its surroundings is that much finer close by.
constexpr float kFineness = 0.1F;
constexpr float kReach = 0.06F;
// Along the longest side of its box: in so many steps it is known where the object is.
constexpr int kBlocks = 16;
// Quarters of quarters of a triangle, at most: a ground of two triangles a thousand times the object's size.
constexpr int kMostCuts = 14;
constexpr std::size_t kMostCells = std::size_t{1} << 17;

struct Box {
  glm::vec3 min{std::numeric_limits<float>::infinity()};
  glm::vec3 max{-std::numeric_limits<float>::infinity()};

  void add(std::initializer_list<glm::vec3> points) {
    for (const glm::vec3& p : points) {
      min = glm::min(min, p);
      max = glm::max(max, p);
    }
  }
  float distance(const Box& other) const {
    return glm::length(glm::max(glm::max(other.min - max, min - other.max), glm::vec3(0.0F)));
  }
};

}  // namespace

/// Cuts triangles near the object in focus.
class CacheCells::Refiner {
 public:
  Refiner(const World& world, int focus, CacheCells& cells)
      : world_(world), focus_(static_cast<std::uint32_t>(focus)), cells_(cells) {
    const std::span<const glm::vec3> p = world.rays.positions(focus);
    const std::vector<glm::uvec3>& triangles = world.scene.objects[focus_].mesh.triangles;
    for (const glm::uvec3& t : triangles) focus_box_.add({p[t.x], p[t.y], p[t.z]});
    const glm::vec3 size = focus_box_.max - focus_box_.min;
    reach_ = kReach * glm::length(size);
    const float per_metre = kBlocks / std::max({size.x, size.y, size.z});
    std::map<std::array<int, 3>, Box> blocks;
    for (const glm::uvec3& t : triangles) {
      Box box;
      box.add({p[t.x], p[t.y], p[t.z]});
      const glm::ivec3 block((0.5F * (box.min + box.max) - focus_box_.min) * per_metre);
      blocks[{block.x, block.y, block.z}].add({box.min, box.max});
    }
    for (const auto& [place, box] : blocks) focus_blocks_.push_back(box);
  }

  void cut_triangles() {
    // Breadth first, so that where the number of cells ends the cutting, it ends everywhere alike.
    std::vector<Task> tasks;
    for (std::uint32_t o = 0; o < cells_.nodes_of_corner_.size(); ++o) {
      if (o == focus_) continue;
      for (std::uint32_t t = 0; t < cells_.nodes_of_corner_[o].size() / 3; ++t) {
        const Cell whole{cells_.triangle_nodes(o, t), {{0.0F, 0.0F}, {1.0F, 0.0F}, {0.0F, 1.0F}}, kNone};
        if (!is_coarse(o, t, whole)) continue;
        std::vector<std::uint32_t>& root = cells_.root_[o];
        root.resize(cells_.nodes_of_corner_[o].size() / 3, kNone);
        root[t] = static_cast<std::uint32_t>(cells_.cells_.size());
        tasks.push_back({o, t, root[t]});
        cells_.cells_.push_back(whole);
      }
    }
    for (int cuts = 0; cuts < kMostCuts && !tasks.empty(); ++cuts) {
      std::vector<Task> next;
      for (const Task& task : tasks) {
        if (cells_.cells_.size() + 4 > kMostCells) return;
        cut(task);
        const std::uint32_t first = cells_.cells_[task.cell].first_part;
        for (std::uint32_t part = first; part < first + 4; ++part) {
          if (is_coarse(task.object, task.triangle, cells_.cells_[part])) {
            next.push_back({task.object, task.triangle, part});
          }
        }
      }
      tasks = std::move(next);
    }
  }

 private:
  struct Task {
    std::uint32_t object;
    std::uint32_t triangle;
    std::uint32_t cell;
  };

  bool is_coarse(std::uint32_t object, std::uint32_t triangle, const Cell& cell) const {
    const std::span<const glm::vec3> p = world_.rays.positions(static_cast<int>(object));
    const glm::uvec3 t = world_.scene.objects[object].mesh.triangles[triangle];
    const glm::vec3 a = tracing::interpolate(p, t, cell.weights[0]);
    const glm::vec3 b = tracing::interpolate(p, t, cell.weights[1]);
    const glm::vec3 c = tracing::interpolate(p, t, cell.weights[2]);
    Box box;
    box.add({a, b, c});
    const float longest = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
    const float near = longest / kFineness - reach_;
    return box.distance(focus_box_) < near &&
           std::any_of(focus_blocks_.begin(), focus_blocks_.end(),
                       [&](const Box& block) { return box.distance(block) < near; });
  }

  void cut(const Task& task) {
    const Cell whole = cells_.cells_[task.cell];
    const auto first = static_cast<std::uint32_t>(cells_.cells_.size());
    cells_.cells_[task.cell].first_part = first;
    // Opposite to each corner.
    std::uint32_t node[3];
    glm::vec2 weights[3];
    for (int k = 0; k < 3; ++k) {
      const int a = (k + 1) % 3;
      const int b = (k + 2) % 3;
      node[k] = middle(task.object, whole.nodes[a], whole.nodes[b]);
      weights[k] = 0.5F * (whole.weights[a] + whole.weights[b]);
    }
    for (int k = 0; k < 3; ++k) {
      const int a = (k + 1) % 3;
      const int b = (k + 2) % 3;
      Cell part;
      part.nodes[k] = whole.nodes[k];
      part.weights[k] = whole.weights[k];
      part.nodes[a] = node[b];
      part.weights[a] = weights[b];
      part.nodes[b] = node[a];
      part.weights[b] = weights[a];
      cells_.cells_.push_back(part);
    }
    cells_.cells_.push_back({{node[0], node[1], node[2]}, {weights[0], weights[1], weights[2]}, kNone});
  }

  /// Cells on both sides of an edge share the node in its middle.
  std::uint32_t middle(std::uint32_t object, std::uint32_t a, std::uint32_t b) {
    const auto [found, is_new] = middles_.try_emplace(std::minmax(a, b), cells_.nodes_);
    if (is_new) {
      ++cells_.nodes_;
      ++cells_.nodes_of_object_[object];
    }
    return found->second;
  }

  const World& world_;
  std::uint32_t focus_;
  CacheCells& cells_;
  Box focus_box_;
  std::vector<Box> focus_blocks_;
  float reach_ = 0.0F;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles_;
};

CacheCells::CacheCells(const World& world, int focus) {
  const std::size_t objects = world.scene.objects.size();
  nodes_of_corner_.resize(objects);
  nodes_of_object_.resize(objects, 0);
  root_.resize(objects);
  for (std::uint32_t o = 0; o < objects; ++o) add_object(world, o);
  if (focus >= 0) Refiner(world, focus, *this).cut_triangles();
  list_corners();
}

void CacheCells::add_object(const World& world, std::uint32_t o) {
  const Object& object = world.scene.objects[o];
  const std::vector<int> materials = materials_of(object);
  if (std::all_of(materials.begin(), materials.end(), [&](int material) {
        return world.scene.materials[static_cast<std::size_t>(material)].albedo == glm::vec3(0.0F);
      })) {
    return;
  }
  const TriangleMesh& mesh = object.mesh;
  std::vector<std::uint32_t>& node = nodes_of_corner_[o];
  const std::uint32_t before = nodes_;
  node.resize(3 * mesh.triangles.size(), kNone);
  if (!mesh.normals.empty()) {
    std::vector<std::uint32_t> node_of_vertex(mesh.positions.size(), kNone);
    for (std::size_t i = 0; i < node.size(); ++i) {
      std::uint32_t& n = node_of_vertex[mesh.triangles[i / 3][static_cast<int>(i % 3)]];
      if (n == kNone) n = nodes_++;
      node[i] = n;
    }
  } else {
    // A chain per vertex of the nodes made there so far, each with the face normal that it stands for.
    struct Entry {
      glm::vec3 normal;
      std::uint32_t node;
      std::uint32_t next;
    };
    std::vector<Entry> entries;
    std::vector<std::uint32_t> first(mesh.positions.size(), kNone);
    for (std::size_t i = 0; i < node.size(); ++i) {
      const auto triangle = static_cast<std::uint32_t>(i / 3);
      const glm::vec3 n = face_normal(world, o, triangle);
      std::uint32_t& head = first[mesh.triangles[triangle][static_cast<int>(i % 3)]];
      std::uint32_t e = head;
      while (e != kNone && glm::dot(entries[e].normal, n) < kSameFace) e = entries[e].next;
      if (e == kNone) {
        entries.push_back({n, nodes_++, head});
        e = head = static_cast<std::uint32_t>(entries.size() - 1);
      }
      node[i] = entries[e].node;
    }
  }
  nodes_of_object_[o] = nodes_ - before;
}

template <typename Visit>
void CacheCells::visit_cells(Visit visit) const {
  for (std::uint32_t o = 0; o < nodes_of_corner_.size(); ++o) {
    std::vector<std::uint32_t> open;
    for (std::uint32_t t = 0; t < nodes_of_corner_[o].size() / 3; ++t) {
      if (root_[o].empty() || root_[o][t] == kNone) {
        visit(o, t, kNone, triangle_nodes(o, t));
        continue;
      }
      open.push_back(root_[o][t]);
      while (!open.empty()) {
        const std::uint32_t cell = open.back();
        open.pop_back();
        const std::uint32_t first = cells_[cell].first_part;
        if (first == kNone) {
          visit(o, t, cell, cells_[cell].nodes);
        } else {
          open.insert(open.end(), {first, first + 1, first + 2, first + 3});
        }
      }
    }
  }
}

void CacheCells::list_corners() {
  first_corner_.assign(nodes_ + 1, 0);
  visit_cells([&](std::uint32_t, std::uint32_t, std::uint32_t, glm::uvec3 nodes) {
    for (int k = 0; k < 3; ++k) ++first_corner_[nodes[k] + 1];
  });
  for (std::size_t n = 0; n < nodes_; ++n) first_corner_[n + 1] += first_corner_[n];
  corners_.resize(first_corner_.back());
  std::vector<std::uint32_t> next(first_corner_.begin(), first_corner_.end() - 1);
  visit_cells([&](std::uint32_t object, std::uint32_t triangle, std::uint32_t cell, glm::uvec3 nodes) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      corners_[next[nodes[static_cast<int>(k)]]++] = {object, triangle, cell, k};
    }
  });
}

glm::vec3 CacheCells::interpolate_in_cells(const std::vector<glm::vec3>& values, std::uint32_t root,
                                           glm::vec2 weights) const {
  std::uint32_t cell = root;
  glm::vec3 w(1.0F - weights.x - weights.y, weights.x, weights.y);
  while (cells_[cell].first_part != kNone) {
    int part = 3;
    for (int k = 0; k < 3; ++k) {
      if (w[k] > 0.5F) part = k;
    }
    if (part == 3) {
      w = 1.0F - 2.0F * w;
    } else {
      const float near = w[part];
      w *= 2.0F;
      w[part] = 2.0F * near - 1.0F;
    }
    cell = cells_[cell].first_part + static_cast<std::uint32_t>(part);
  }
  return tracing::interpolate(values, cells_[cell].nodes, {w.y, w.z});
}

Surface CacheCells::surface_near(const World& world, const Corner& corner, glm::vec2 u,
                                 glm::vec3 towards) const {
  const glm::vec3 w = weights_near_corner(corner.corner, u);
  glm::vec2 weights(w.y, w.z);
  if (corner.cell != kNone) {
    const Cell& cell = cells_[corner.cell];
    weights = w.x * cell.weights[0] + w.y * cell.weights[1] + w.z * cell.weights[2];
  }
  return surface_of_triangle(world, corner.object, corner.triangle, weights, towards);
}

}  // namespace mirrorbake::tracing
