#pragma once

#include <glm/vec3.hpp>

namespace mirrorbake {

/// A position in a map. x runs to the right and y up, both from the centre of the face, in [−1,1]: counted
/// from the centre they keep a bit more than in [0,1], which a float32 round trip within 2e-7 rad needs.
struct MapPoint {
  int face = 0;
  double x = 0.0;
  double y = 0.0;
  bool covered = true;  ///< false if the map has no such direction, or it is NaN, infinite or zero
};

/// How a direction of unit length changes with the position in a map: ∂d/∂x and ∂d/∂y, in radians per unit.
struct MapJacobian {
  glm::dvec3 dx{0.0};
  glm::dvec3 dy{0.0};
};

}  // namespace mirrorbake
