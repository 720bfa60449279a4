#pragma once

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>

#include "mirrorbake/projection/map_point.hpp"

/// The dual paraboloid projection (spec P2; [EMT] §2.3). Face 0 holds the directions with d_z ≥ 0: (x, y) =
/// (d_x, d_y)/(1 + d_z) for unit d; face 1 the others: (x, y) = (d_x, d_y)/(1 − d_z). [EMT] gives the back
/// map −x and −y; here both maps have the same signs, so that a direction crosses the rim at the same (x, y)
/// in both. The domain of a face is the unit disc. Positions beyond it are directions of the other
/// hemisphere, continued smoothly: a border of any width holds valid data.
namespace mirrorbake {

/// NaN, infinite and zero directions give the centre of face 0, not covered.
MapPoint dual_paraboloid_from_direction(glm::dvec3 direction);

/// Unit direction at any finite (x, y), inside or outside of the disc.
glm::dvec3 direction_from_dual_paraboloid(int face, double x, double y);

MapJacobian dual_paraboloid_jacobian(int face, double x, double y);

/// The homogeneous texture matrix of [EMT] eq. 9–12 for a face: applied to (r, 1), r a unit reflection vector
/// in the space of `frame_from_map`, it gives (s q, t q, ·, q) with texture coordinates s, t in [0,1], t
/// downwards, and q > 0 exactly on the hemisphere extended beyond its rim. [EMT] prints S = d₀ − r; for r =
/// 2(n·v)n − v, which points away from the surface, it is d₀ + r (its eq. 8). `frame_from_map` is the linear
/// part of the rigid transformation from the map's axes, e.g. that of the model-view matrix if r is in eye
/// space. Throws InvalidArgument if it is not orthonormal to 1e-4 or `face` is not 0 or 1.
glm::mat4 dual_paraboloid_texture_matrix(const glm::mat3& frame_from_map, int face);

}  // namespace mirrorbake
