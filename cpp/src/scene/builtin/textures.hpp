#pragma once

#include <glm/vec3.hpp>

#include "mirrorbake/image/image.hpp"

/// Procedural textures of the built-in room: scene-linear, three channels, the same pixels on every machine
/// up to the rounding of std::sin. Those that say "repeats" tile without a seam.
namespace mirrorbake::textures {

/// Scene-linear colour of an sRGB hexadecimal one, 0xRRGGBB.
glm::vec3 from_srgb(unsigned hex);

Image floorboards();                                           ///< repeats; boards along u
Image wood(glm::vec3 light, glm::vec3 dark);                   ///< repeats; grain along u
Image bricks();                                                ///< repeats
Image stripes(glm::vec3 ground, glm::vec3 stripe);             ///< repeats; upright stripes
Image diamonds(glm::vec3 ground, glm::vec3 figure);            ///< repeats
Image trellis(glm::vec3 ground, glm::vec3 figure);             ///< repeats
Image checkers(int squares, glm::vec3 light, glm::vec3 dark);  ///< repeats
Image weave(glm::vec3 colour);                                 ///< repeats
Image leaves();                                                ///< repeats
Image rug();
Image landscape();   ///< a painting: sun, hills and a lake
Image rectangles();  ///< a painting: coloured rectangles between black bars
Image circles();     ///< a painting: concentric rings in a grid
Image toy_block();   ///< one side of a wooden cube: frame and disc
Image clock_face();

}  // namespace mirrorbake::textures
