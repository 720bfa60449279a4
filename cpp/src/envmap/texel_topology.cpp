#include "mirrorbake/envmap/texel_topology.hpp"

#include <algorithm>
#include <bit>
#include <string>

#include "map_kinds.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/texel_lookup.hpp"

namespace mirrorbake {
namespace {

void check_side(const char* name, int side) {
  if (side < 1 || side > 16384 || !std::has_single_bit(static_cast<unsigned>(side))) {
    throw InvalidArgument(name, std::to_string(side), "a power of two from 1 to 16384");
  }
}

const MapProjection& traits(TopologyKind kind) {
  return *std::ranges::find(kMapProjections, kind, &MapProjection::kind);
}

Projection projection_of(TopologyKind kind) { return {.kind = traits(kind).projection}; }

}  // namespace

TexelTopology::TexelTopology(TopologyKind kind, int faces, int width, int height)
    : kind_(kind), faces_(faces), width_(width), height_(height) {
  const int levels = static_cast<int>(std::bit_width(static_cast<unsigned>(std::max(width, height))));
  offsets_.push_back(0);
  for (int level = 0; level < levels; ++level) {
    offsets_.push_back(offsets_.back() + static_cast<std::size_t>(faces) *
                                             static_cast<std::size_t>(this->width(level)) *
                                             static_cast<std::size_t>(this->height(level)));
  }
}

std::span<const MapProjection> map_projections() { return kMapProjections; }

TexelTopology TexelTopology::of(const MapProjection& projection, int size) {
  check_side("size", size);
  return {projection.kind, projection.faces, size, size};
}

TexelTopology TexelTopology::cube(int size) { return of(traits(TopologyKind::cube), size); }

TexelTopology TexelTopology::dual_paraboloid(int size) {
  return of(traits(TopologyKind::dual_paraboloid), size);
}

TexelTopology TexelTopology::atlas(int width, int height) {
  check_side("width", width);
  check_side("height", height);
  return {TopologyKind::atlas, 1, width, height};
}

BeyondEdges TexelTopology::beyond_edges() const {
  return kind_ == TopologyKind::atlas ? BeyondEdges::nothing : traits(kind_).beyond_edges;
}

TexelPlace TexelTopology::place(std::uint32_t texel) const {
  int level = 0;
  while (texel >= offsets_[static_cast<std::size_t>(level) + 1]) ++level;
  // Sides are powers of two.
  const auto i = static_cast<unsigned>(texel - level_offset(level));
  const auto w = static_cast<unsigned>(width(level)), h = static_cast<unsigned>(height(level));
  const unsigned line = i >> std::countr_zero(w);
  return {level, static_cast<int>(line >> std::countr_zero(h)), static_cast<int>(line & (h - 1)),
          static_cast<int>(i & (w - 1))};
}

std::uint32_t TexelTopology::texel_at(const TexelPlace& place) const {
  const int w = width(place.level);
  const int h = height(place.level);
  if (place.row >= 0 && place.row < h && place.column >= 0 && place.column < w) return index(place);
  if (kind_ == TopologyKind::atlas) {
    return index({place.level, 0, std::clamp(place.row, 0, h - 1), std::clamp(place.column, 0, w - 1)});
  }
  const FaceTexel texel = continued(projection_of(kind_), w, h, {place.face, place.row, place.column});
  return index({place.level, texel.face, texel.row, texel.column});
}

std::array<std::uint32_t, 4> TexelTopology::neighbours(std::uint32_t texel) const {
  const TexelPlace p = place(texel);
  const int w = width(p.level);
  const int h = height(p.level);
  if (p.row > 0 && p.row + 1 < h && p.column > 0 && p.column + 1 < w) {
    const auto line = static_cast<std::uint32_t>(w);
    return {texel - line, texel + line, texel - 1, texel + 1};
  }
  const std::array<TexelPlace, 4> around{TexelPlace{p.level, p.face, p.row - 1, p.column},
                                         {p.level, p.face, p.row + 1, p.column},
                                         {p.level, p.face, p.row, p.column - 1},
                                         {p.level, p.face, p.row, p.column + 1}};
  std::array<std::uint32_t, 4> result;
  for (std::size_t i = 0; i < 4; ++i) {
    const TexelPlace& q = around[i];
    const bool inside = q.row >= 0 && q.column >= 0 && q.row < h && q.column < w;
    result[i] = inside || beyond_edges() == BeyondEdges::neighbour ? texel_at(q) : kNoTexel;
  }
  return result;
}

std::uint32_t TexelTopology::parent(std::uint32_t texel) const {
  const TexelPlace p = place(texel);
  if (p.level + 1 >= levels()) return kNoTexel;
  return index({p.level + 1, p.face, std::min(p.row / 2, height(p.level + 1) - 1),
                std::min(p.column / 2, width(p.level + 1) - 1)});
}

std::array<std::uint32_t, 4> TexelTopology::children(std::uint32_t texel) const {
  std::array<std::uint32_t, 4> result;
  result.fill(kNoTexel);
  const TexelPlace p = place(texel);
  if (p.level == 0) return result;
  const int rows = std::min(2, height(p.level - 1));
  const int columns = std::min(2, width(p.level - 1));
  for (int i = 0; i < 4; ++i) {
    if (i / 2 >= rows || i % 2 >= columns) continue;
    result[static_cast<std::size_t>(i)] =
        index({p.level - 1, p.face, 2 * p.row + i / 2, 2 * p.column + i % 2});
  }
  return result;
}

glm::vec3 TexelTopology::centre(std::uint32_t texel) const {
  const TexelPlace p = place(texel);
  const int w = width(p.level);
  const int h = height(p.level);
  if (kind_ == TopologyKind::atlas) {
    return {(static_cast<float>(p.column) + 0.5F) / static_cast<float>(w),
            (static_cast<float>(p.row) + 0.5F) / static_cast<float>(h), 0.0F};
  }
  return direction_from_point(projection_of(kind_), p.face, column_center(p.column, w), row_center(p.row, h));
}

double TexelTopology::solid_angle(std::uint32_t texel) const {
  const TexelPlace p = place(texel);
  if (kind_ == TopologyKind::atlas) return 1.0 / (width(p.level) * height(p.level));
  return texel_solid_angle(projection_of(kind_), width(p.level), height(p.level), p.column, p.row);
}

}  // namespace mirrorbake
