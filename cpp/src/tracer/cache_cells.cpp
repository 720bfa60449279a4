#include "cache_cells.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <limits>
#include <map>
#include <queue>
#include <tuple>
#include <utility>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "gather.hpp"
#include "mirrorbake/core/interrupt.hpp"
#include "sample_stream.hpp"
#include "triangle_sampler.hpp"
#include "world.hpp"

namespace mirrorbake::tracing {
namespace {

// Corners of a flat-shaded mesh share a node if their faces differ by less than acos(0.999) = 2.6°.
constexpr float kSameFace = 0.999F;
// A cell's longest edge is at most this part of its distance to the object in focus, with kReach of the
// diagonal of its box added: what a mirror shows of its surroundings is that much finer close by.
constexpr float kFineness = 0.07F;
constexpr float kReach = 0.12F;
// Along the longest side of its box: in so many steps it is known where the object is.
constexpr int kBlocks = 16;
// What the object cannot see ends at cells as many times as wide.
constexpr float kWidthIfHidden = 3.0F;
// Halves of halves of a triangle, at most: a ground of two triangles a thousand times the object's size.
constexpr int kMostCuts = 28;
constexpr std::size_t kMostCells = std::size_t{1} << 18;
// Where light may change at a step cells are as fine as this,
constexpr float kFinenessOfSteps = 0.05F;
// which is where what a corner sees is as many times closer than what another one sees. By so many rays it
// is known what is close to a corner and whether a cell is hidden.
constexpr float kStep = 3.0F;
constexpr std::uint32_t kLooks = 16;
constexpr std::size_t kMostCellsOfSteps = std::size_t{1} << 17;
constexpr float kUnknown = -1.0F;

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

float longest_edge(const std::array<glm::vec3, 3>& p) {
  return std::max({glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
}

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
    std::vector<TriangleSampler::Triangle> all;
    std::vector<double> areas;
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      all.push_back({focus_, t});
      areas.push_back(triangle_area(p, triangles[t]));
    }
    points_of_focus_ = TriangleSampler(std::move(all), areas);
  }

  void cut_triangles() {
    cut_while([&](const Task& task, const Cell& cell) { return excess_width(task, cell); }, kMostCells);
    cut_while([&](const Task& task, const Cell& cell) { return excess_width_at_step(task, cell); },
              kMostCells + kMostCellsOfSteps);
  }

 private:
  struct Task {
    std::uint32_t object;
    std::uint32_t triangle;
    std::uint32_t cell;  ///< kNone: the whole triangle
    int cuts = 0;        ///< that have made it in this round
    float excess = 0.0F;

    /// The widest are cut first, so that where the number of cells ends the cutting, it ends alike
    /// everywhere.
    bool operator<(const Task& other) const {
      return excess != other.excess
                 ? excess < other.excess
                 : std::tie(object, triangle, cell) > std::tie(other.object, other.triangle, other.cell);
    }
  };

  /// `excess`: of a cell, how many times it is wider than it should be; it is cut where that is more than 1.
  template <typename Excess>
  void cut_while(const Excess& excess, std::size_t most_cells) {
    std::vector<Task> first;
    cells_.visit_cells([&](std::uint32_t object, std::uint32_t triangle, std::uint32_t cell, glm::uvec3) {
      Task task{object, triangle, cell};
      if (object == focus_) return;
      task.excess = excess(task, cell_of(task));
      if (task.excess > 1.0F) first.push_back(task);
    });
    std::priority_queue<Task> tasks({}, std::move(first));
    while (!tasks.empty() && cells_.cells_.size() + 3 <= most_cells) {
      const Task task = tasks.top();
      tasks.pop();
      const std::uint32_t first_part = cut(task);
      if (task.cuts + 1 == kMostCuts) continue;
      for (std::uint32_t part = first_part; part < first_part + 2; ++part) {
        Task of_part{task.object, task.triangle, part, task.cuts + 1};
        of_part.excess = excess(of_part, cells_.cells_[part]);
        if (of_part.excess > 1.0F) tasks.push(of_part);
      }
    }
  }

  Cell cell_of(const Task& task) const {
    if (task.cell != kNone) return cells_.cells_[task.cell];
    return {
        cells_.triangle_nodes(task.object, task.triangle), {{0.0F, 0.0F}, {1.0F, 0.0F}, {0.0F, 1.0F}}, kNone};
  }

  std::array<glm::vec3, 3> corners_of(const Task& task, const Cell& cell) const {
    const std::span<const glm::vec3> p = world_.rays.positions(static_cast<int>(task.object));
    const glm::uvec3 t = world_.scene.objects[task.object].mesh.triangles[task.triangle];
    return {tracing::interpolate(p, t, cell.weights[0]), tracing::interpolate(p, t, cell.weights[1]),
            tracing::interpolate(p, t, cell.weights[2])};
  }

  /// Its longest edge as a multiple of what it may be, `fineness` of the distance to the object in focus.
  float width(const std::array<glm::vec3, 3>& corners, float fineness) const {
    Box box;
    box.add({corners[0], corners[1], corners[2]});
    const float edge = longest_edge(corners);
    if (edge <= fineness * (box.distance(focus_box_) + reach_)) return 0.0F;
    float distance = std::numeric_limits<float>::infinity();
    for (const Box& block : focus_blocks_) distance = std::min(distance, box.distance(block));
    return edge / (fineness * (distance + reach_));
  }

  /// How many times wider than it may be a cell is; 0 of one that is hidden and not much wider.
  float excess_width(const Task& task, const Cell& cell) const {
    const std::array<glm::vec3, 3> corners = corners_of(task, cell);
    const float width_now = width(corners, kFineness);
    return width_now > 1.0F && width_now < kWidthIfHidden && is_hidden(task, cell) ? 0.0F : width_now;
  }

  /// Whether rays from random points of a cell to random points of the object in focus find none of them.
  bool is_hidden(const Task& task, const Cell& cell) const {
    if (!(points_of_focus_.weight() > 0.0)) return false;
    poll_interrupt();
    const std::uint64_t key =
        hash64(hash64(task.object, task.triangle), hash64(cell.nodes.x, hash64(cell.nodes.y, cell.nodes.z)));
    constexpr float kUpTo = 0.999F;
    const glm::vec3 normal = face_normal(world_, task.object, task.triangle);
    if (normal == glm::vec3(0.0F)) return true;
    const std::span<const glm::vec3> p = world_.rays.positions(static_cast<int>(task.object));
    const glm::uvec3 t = world_.scene.objects[task.object].mesh.triangles[task.triangle];
    for (std::uint32_t r = 0; r < kLooks; ++r) {
      const SampleStream stream{key, r};
      const glm::vec2 u = uniform_on_triangle(stream.get(diffuse_dimension));
      const glm::vec2 weights =
          (1.0F - u.x - u.y) * cell.weights[0] + u.x * cell.weights[1] + u.y * cell.weights[2];
      const glm::vec3 to = world_.position(points_of_focus_.sample(stream.get(light_dimension)));
      const glm::vec3 from = tracing::interpolate(p, t, weights);
      const glm::vec3 side = glm::dot(to - from, normal) > 0.0F ? normal : -normal;
      const Surface start = surface_of_triangle(world_, task.object, task.triangle, weights, side);
      const glm::vec3 way = to - start.position;
      const float distance = glm::length(way);
      if (!(distance > 0.0F)) return false;
      const glm::vec3 direction = way / distance;
      const Hit hit =
          world_.rays.all().intersect({offset_origin(start, direction), direction}, RayKind::reflection);
      if (hit.missed() || hit.geometry == focus_ || hit.distance > kUpTo * distance) return false;
    }
    return true;
  }

  /// The same where light may change at a step within it, else 0: something close covers one of its corners
  /// and leaves another one open.
  float excess_width_at_step(const Task& task, const Cell& cell) {
    const std::array<glm::vec3, 3> corners = corners_of(task, cell);
    const float width_now = width(corners, kFinenessOfSteps);
    if (!(width_now > 1.0F)) return 0.0F;
    std::array<float, 3> closeness;
    for (int k = 0; k < 3; ++k) closeness[k] = closeness_at(task, cell, k);
    const auto [least, most] = std::minmax_element(closeness.begin(), closeness.end());
    return *most > kStep * *least && *most * longest_edge(corners) > 0.5F ? width_now : 0.0F;
  }

  /// Mean of the inverse distances to what a node sees on its front, whose own inverse is Ward's measure of
  /// how far its light reaches (Ward, Rubinstein and Clear, "A Ray Tracing Solution for Diffuse
  /// Interreflection", SIGGRAPH 1988).
  float closeness_at(const Task& task, const Cell& cell, int corner) {
    const std::uint32_t node = cell.nodes[corner];
    if (closeness_.size() <= node) closeness_.resize(cells_.nodes_, kUnknown);
    if (closeness_[node] != kUnknown) return closeness_[node];
    poll_interrupt();
    // From within the cell: at a corner rays would start in the edge between two walls.
    constexpr float kInwards = 0.1F;
    const glm::vec2 middle = (cell.weights[0] + cell.weights[1] + cell.weights[2]) / 3.0F;
    const glm::vec3 normal = face_normal(world_, task.object, task.triangle);
    if (normal == glm::vec3(0.0F)) return 0.0F;
    const Surface start = surface_of_triangle(world_, task.object, task.triangle,
                                              glm::mix(cell.weights[corner], middle, kInwards), normal);
    const Frame frame(normal);
    float sum = 0.0F;
    for (std::uint32_t r = 0; r < kLooks; ++r) {
      const SampleStream stream{hash64(node), r};
      const glm::vec3 direction = sample_cosine_hemisphere(frame, stream.get(diffuse_dimension));
      const Hit hit =
          world_.rays.all().intersect({offset_origin(start, direction), direction}, RayKind::reflection);
      if (!hit.missed()) sum += 1.0F / std::max(hit.distance, std::numeric_limits<float>::min());
    }
    return closeness_[node] = sum / static_cast<float>(kLooks);
  }

  /// Halves its longest edge. Returns the first of its two parts.
  std::uint32_t cut(const Task& task) {
    const Cell whole = cell_of(task);
    std::uint32_t number = task.cell;
    if (number == kNone) {
      number = static_cast<std::uint32_t>(cells_.cells_.size());
      std::vector<std::uint32_t>& root = cells_.root_[task.object];
      root.resize(cells_.nodes_of_corner_[task.object].size() / 3, kNone);
      root[task.triangle] = number;
      cells_.cells_.push_back(whole);
    }
    const std::array<glm::vec3, 3> p = corners_of(task, whole);
    int apex = 0;
    float longest = 0.0F;
    for (int k = 0; k < 3; ++k) {
      const float edge = glm::distance(p[(k + 1) % 3], p[(k + 2) % 3]);
      if (edge > longest) {
        longest = edge;
        apex = k;
      }
    }
    const int a = (apex + 1) % 3;
    const int b = (apex + 2) % 3;
    const auto first = static_cast<std::uint32_t>(cells_.cells_.size());
    cells_.cells_[number].first_part = first;
    cells_.cells_[number].apex = static_cast<std::uint8_t>(apex);
    const std::uint32_t node = middle(whole.nodes[a], whole.nodes[b]);
    const glm::vec2 weights = 0.5F * (whole.weights[a] + whole.weights[b]);
    for (const int replaced : {b, a}) {
      Cell part = whole;
      part.first_part = kNone;
      part.nodes[replaced] = node;
      part.weights[replaced] = weights;
      cells_.cells_.push_back(part);
    }
    return first;
  }

  /// Cells on both sides of an edge share the node in its middle.
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    const auto [found, is_new] = middles_.try_emplace(std::minmax(a, b), cells_.nodes_);
    if (is_new) ++cells_.nodes_;
    return found->second;
  }

  const World& world_;
  std::uint32_t focus_;
  CacheCells& cells_;
  Box focus_box_;
  std::vector<Box> focus_blocks_;
  TriangleSampler points_of_focus_;
  float reach_ = 0.0F;
  std::vector<float> closeness_;  ///< of each node, 1/m, or kUnknown
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles_;
};

CacheCells::CacheCells(const World& world, int focus) {
  const std::size_t objects = world.scene.objects.size();
  nodes_of_corner_.resize(objects);
  vertex_nodes_.resize(objects, 0);
  root_.resize(objects);
  for (std::uint32_t o = 0; o < objects; ++o) add_object(world, o);
  first_cut_ = nodes_;
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
  vertex_nodes_[o] = nodes_ - before;
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
          open.insert(open.end(), {first, first + 1});
        }
      }
    }
  }
}

void CacheCells::list_corners() {
  first_corner_.assign(nodes_ + 1, 0);
  along_curve_.reserve(nodes_);
  visit_cells([&](std::uint32_t, std::uint32_t, std::uint32_t, glm::uvec3 nodes) {
    for (int k = 0; k < 3; ++k) {
      if (first_corner_[nodes[k] + 1]++ == 0) along_curve_.push_back(nodes[k]);
    }
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
    const int a = (cells_[cell].apex + 1) % 3;
    const int b = (cells_[cell].apex + 2) % 3;
    const bool second = w[b] > w[a];
    const int kept = second ? b : a;
    const int replaced = second ? a : b;
    w[kept] -= w[replaced];
    w[replaced] *= 2.0F;
    cell = cells_[cell].first_part + (second ? 1U : 0U);
  }
  return tracing::interpolate(values, cells_[cell].nodes, {w.y, w.z});
}

glm::vec3 CacheCells::position(const World& world, std::size_t node) const {
  const Corner& corner = corners(node).front();
  const auto k = static_cast<int>(corner.corner);
  const std::span<const glm::vec3> p = world.rays.positions(static_cast<int>(corner.object));
  const glm::uvec3 t = world.scene.objects[corner.object].mesh.triangles[corner.triangle];
  return corner.cell == kNone ? p[t[k]] : tracing::interpolate(p, t, cells_[corner.cell].weights[k]);
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
