#pragma once

#include <optional>
#include <span>
#include <string_view>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/projection/map_point.hpp"
#include "mirrorbake/projection/projection.hpp"

/// What the library knows of a projection, in one place: its formulas, and the few facts about its faces that
/// lookups, resampling and prefiltering ask for. Code that deals with any projection asks here; the names of
/// single projections stand only in shortcuts, beside a way that does for all, and in file formats.
namespace mirrorbake {

/// Of what a face is made.
enum class FaceShape {
  square,    ///< all of it
  panorama,  ///< all of it; columns are longitudes, so that the left side goes on at the right one
  disc,      ///< what lies within the unit circle, see Rim
};

/// What lies at the rim of a disc.
enum class Rim {
  none,       ///< the face is no disc
  neighbour,  ///< another face, which this one overlaps beyond the rim (dual paraboloid)
  direction,  ///< a single direction, which the map goes on beyond (angular map)
  boundary,   ///< the last that the map covers; its texels go on beyond (fisheye)
  singular,   ///< a single direction, where texels are stretched without bound (sphere map)
};

/// The solid angle of a small texel by its distance r from the centre of the face: resampling has the formula
/// in vectors. Tabulated: integrated for each texel instead, which does for all.
enum class CenterDensity { tabulated, equal, cube, paraboloid, fisheye };

struct ProjectionTraits {
  std::string_view name;
  FaceShape shape = FaceShape::square;
  Rim rim = Rim::none;
  CenterDensity density = CenterDensity::tabulated;
  /// As they stand for {} in the names of files, one for each face; none for a single face.
  std::span<const std::string_view> face_names = {};
  bool takes_field_of_view = false;

  /// The functions of projection.hpp, for this projection. No point_on_face: that of point_from_direction.
  MapPoint (*point_from_direction)(const Projection&, glm::dvec3 direction) = nullptr;
  glm::dvec3 (*direction_from_point)(const Projection&, int face, double x, double y) = nullptr;
  MapJacobian (*jacobian)(const Projection&, int face, double x, double y) = nullptr;
  double (*texel_solid_angle)(const Projection&, int width, int height, int column, int row) = nullptr;
  std::optional<glm::dvec2> (*point_on_face)(const Projection&, int face, glm::dvec3 direction) = nullptr;

  /// Radians per unit of x and y where texels are largest: at the centre of a disc, whose density is the
  /// product.
  glm::dvec2 (*largest_texel)(const Projection&) = nullptr;
};

const ProjectionTraits& traits(ProjectionKind kind);

}  // namespace mirrorbake
