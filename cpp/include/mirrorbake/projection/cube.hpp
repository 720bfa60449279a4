#pragma once

#include <glm/vec3.hpp>

#include "mirrorbake/projection/map_point.hpp"

/// The cube projection (spec P1; [WP]; [EMT] §2.2).
///
/// Faces are ordered +X −X +Y −Y +Z −Z, each oriented as in OpenGL and KTX2, row 0 at the top:
///
///                 +------+
///                 |  +Y  |          s runs to the right, t runs down, both in [0,1].
///          +------+------+------+------+
///          |  −X  |  +Z  |  +X  |  −Z  |   seen from inside, left-handed
///          +------+------+------+------+
///                 |  −Y  |
///                 +------+
namespace mirrorbake {

struct CubeCoordinates {
  int face = 0;    ///< 0…5
  float s = 0.5F;  ///< [0,1], left to right
  float t = 0.5F;  ///< [0,1], top to bottom
};

/// Face and position of a direction of any finite length > 0. On an edge the first of x, y, z that is largest
/// wins. NaN, infinite and zero directions give face 0, s = t = ½: never an index out of range.
CubeCoordinates cube_from_direction(glm::vec3 direction);

/// Direction through (s, t) of a face, its largest component ±1, not normalised. (s, t) may lie outside
/// [0,1].
glm::vec3 direction_from_cube(int face, float s, float t);

/// Solid angle in steradians of texel (column, row) of a face of `size`² texels, relative error ≤ 1e-12.
double cube_texel_solid_angle(int size, int column, int row);

/// The same in double, with positions counted from the centre of the face: x = 2s − 1, y = 1 − 2t.
MapPoint cube_point_from_direction(glm::dvec3 direction);
glm::dvec3 direction_from_cube_point(int face, double x, double y);

/// Of the normalised direction.
MapJacobian cube_jacobian(int face, double x, double y);

}  // namespace mirrorbake
