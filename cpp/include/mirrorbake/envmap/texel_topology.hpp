#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>

#include "mirrorbake/envmap/cube_pyramid.hpp"
#include "mirrorbake/projection/projection.hpp"

/// How the texels of a map with mip levels lie to each other: all that a solver, a regulariser and a fill
/// have to know of a map.
namespace mirrorbake {

enum class TopologyKind { cube, dual_paraboloid, atlas };

/// What a read of a map finds beyond the edges of a face: texels of the neighbouring face, three of which
/// meet at a corner, or nothing, because the texels of a face go on beyond what it shows; its last ones are
/// repeated then.
enum class BeyondEdges { neighbour, nothing };

/// A projection in which the maps of a PEM can be kept: what a solver, files and the page have to know of it.
struct MapProjection {
  TopologyKind kind;
  std::string_view name;  ///< in scene files and PEMs
  ProjectionKind projection;
  int faces;
  int faces_in_a_row;      ///< of a level in the images of the web format
  std::string_view order;  ///< of the faces, and of their texels, in words
  BeyondEdges beyond_edges;
};

/// All of them; `atlas` is none.
std::span<const MapProjection> map_projections();

inline constexpr std::uint32_t kNoTexel = 0xffffffffU;

struct TexelPlace {
  int level = 0, face = 0, row = 0, column = 0;
};

/// Texels are numbered as values are in EnvMapLayout: levels from the finest, in a level the faces, in a face
/// the rows from the top. All levels down to one texel a face exist. Sides are powers of two, so that every
/// texel but those of the finest level has its children exactly below it.
class TexelTopology {
 public:
  /// Faces of size² texels. Throws InvalidArgument unless the size is a power of two from 1 to 16384.
  static TexelTopology of(const MapProjection& projection, int size);
  static TexelTopology cube(int size);
  static TexelTopology dual_paraboloid(int size);
  /// One sheet of width × height texels on texture coordinates, (0, 0) its top left corner.
  static TexelTopology atlas(int width, int height);
  TexelTopology(const CubePyramidLayout& layout)  // NOLINT(google-explicit-constructor): it is one
      : TexelTopology(cube(layout.size)) {}

  TopologyKind kind() const { return kind_; }
  BeyondEdges beyond_edges() const;
  int levels() const { return static_cast<int>(offsets_.size()) - 1; }
  int faces() const { return faces_; }
  int width(int level) const { return width_ >> level > 0 ? width_ >> level : 1; }
  int height(int level) const { return height_ >> level > 0 ? height_ >> level : 1; }
  std::size_t texels() const { return offsets_.back(); }
  /// Number of a level's first texel; of `levels()`, the number of texels.
  std::size_t level_offset(int level) const { return offsets_[static_cast<std::size_t>(level)]; }

  std::uint32_t index(const TexelPlace& place) const {
    const auto line = static_cast<std::size_t>(place.face) * static_cast<std::size_t>(height(place.level)) +
                      static_cast<std::size_t>(place.row);
    return static_cast<std::uint32_t>(level_offset(place.level) +
                                      line * static_cast<std::size_t>(width(place.level)) +
                                      static_cast<std::size_t>(place.column));
  }
  TexelPlace place(std::uint32_t texel) const;

  /// The texel at a place whose row or column may lie beyond the face: the one that holds the direction there
  /// when the projection is continued, on the neighbouring face or hemisphere; of an atlas the edge is
  /// repeated.
  std::uint32_t texel_at(const TexelPlace& place) const;

  /// Above, below, left, right, so that whoever is a texel's neighbour has it as one; kNoTexel where
  /// nothing lies beyond an edge, as of an atlas and of the sheets of a dual paraboloid.
  std::array<std::uint32_t, 4> neighbours(std::uint32_t texel) const;
  /// kNoTexel on the coarsest level.
  std::uint32_t parent(std::uint32_t texel) const;
  /// kNoTexel on the finest level, and for the missing ones of a sheet that is one texel wide.
  std::array<std::uint32_t, 4> children(std::uint32_t texel) const;
  /// Direction whose lookup hits the texel's centre; of an atlas (u, v, 0).
  glm::vec3 centre(std::uint32_t texel) const;
  /// In steradians; of an atlas the share of the sheet.
  double solid_angle(std::uint32_t texel) const;

  bool operator==(const TexelTopology& other) const {
    return kind_ == other.kind_ && width_ == other.width_ && height_ == other.height_;
  }

 private:
  TexelTopology(TopologyKind kind, int faces, int width, int height);

  TopologyKind kind_;
  int faces_, width_, height_;
  std::vector<std::size_t> offsets_;
};

}  // namespace mirrorbake
