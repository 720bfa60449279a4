#pragma once

#include <vector>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/scene/scene.hpp"

/// Building blocks of furniture. Large faces are cut into cells, because indirect light is cached per vertex.
namespace mirrorbake {

/// Appends `other` to `mesh`; both have normals and texture coordinates, and no parts.
void append(TriangleMesh& mesh, const TriangleMesh& other);

/// Turns by `degrees` counter-clockwise about +Y, seen from above, then moves by `offset`.
TriangleMesh placed(TriangleMesh mesh, float degrees, glm::vec3 offset);

/// The rectangle corner, corner + u, … facing u × v in cells of at most `cell` metres. Texture coordinates
/// are lengths from the corner along u and v divided by `tile`, the extent of one texture repeat in metres.
TriangleMesh make_panel(glm::vec3 corner, glm::vec3 u, glm::vec3 v, float cell, glm::vec2 tile);

/// The same with texture coordinates (0,0) to (1,1).
TriangleMesh make_picture(glm::vec3 corner, glm::vec3 u, glm::vec3 v, float cell);

/// A box in cells of at most `cell` metres. The texture's u axis (the grain of wood) follows each side's
/// longer edge, and starts somewhere else in every block.
TriangleMesh make_block(glm::vec3 min, glm::vec3 max, float cell, float tile);

/// A box whose edges are rounded with `radius`, `cells` cells per side; a cushion.
TriangleMesh make_rounded_block(glm::vec3 min, glm::vec3 max, float radius, int cells, float tile);

/// Surface of revolution about the vertical axis through `base`. `profile` holds (radius, height above base);
/// its right-hand side is the outside: upwards along an outer wall, downwards along an inner one. Corners
/// sharper than 35° stay sharp. u runs around `repeats` times, v along the profile from 0 to 1.
TriangleMesh make_lathe(glm::vec3 base, const std::vector<glm::vec2>& profile, int segments,
                        float repeats = 1.0F);

/// A hanging cloth from `corner` along `width` (horizontal) and up by `height`, `folds` sine folds of the
/// given `depth`. It is seen from the side of width × up.
TriangleMesh make_curtain(glm::vec3 corner, glm::vec3 width, float height, int folds, float depth);

}  // namespace mirrorbake
