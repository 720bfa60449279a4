#pragma once

#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake {

/// The built-in surroundings: a furnished room with textured walls and floor, a table whose top is the plane
/// y = 0 with its centre at the origin, props near the centre and far from it, and an area light under the
/// ceiling. The reflector is not part of it: it stands on the table at the origin.
Scene make_room();

}  // namespace mirrorbake
