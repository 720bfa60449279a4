#pragma once

#include <array>
#include <span>

#include <glm/vec3.hpp>

/// What a screen pixel sees in a reflector: a cone of directions, given by its axis and two differentials
/// (spec E5; [WP] figures 3–6). The differentials are what `sample` takes.
namespace mirrorbake {

struct Footprint {
  glm::vec3 direction{0.0F};  ///< unit
  glm::vec3 ddx{0.0F};        ///< change of the direction from the left to the right side of the pixel
  glm::vec3 ddy{0.0F};        ///< from its top to its bottom
};

/// The quadrilateral reflection cone through the reflected rays of a pixel's corners, in the order top left,
/// top right, bottom right, bottom left, of any length > 0: its middle, and the means of its opposite sides.
/// The ellipse with these as conjugate diameters is the elliptical cone that touches the middles of the
/// sides. If corners are not finite or cancel, everything is zero.
Footprint footprint_from_corners(const std::array<glm::vec3, 4>& corners);

/// Differential of the mirror direction d − 2(d·n)n of a ray with direction d and normal n, both unit, whose
/// differentials are `dd` and `dn` (Igehy, Tracing Ray Differentials, SIGGRAPH 1999, eq. 15).
glm::vec3 reflected_differential(glm::vec3 direction, glm::vec3 normal, glm::vec3 dd, glm::vec3 dn);

/// Differences within quads of 2×2 pixels, as GPUs take them, of an image of directions (height × width): ddx
/// is the right pixel of a row of the quad minus the left one, ddy the lower of a column minus the upper. At
/// an odd last column or row the difference to the pixel before is taken. Throws InvalidArgument if the spans
/// are not height × width.
void quad_differentials(int width, int height, std::span<const glm::vec3> directions,
                        std::span<glm::vec3> ddx, std::span<glm::vec3> ddy);

}  // namespace mirrorbake
