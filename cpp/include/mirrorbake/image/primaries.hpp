#pragma once

#include <array>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>

/// Colours of other primaries than the library's own.
namespace mirrorbake::image_files {

/// CIE xy chromaticities of red, green, blue and white.
using Primaries = std::array<glm::dvec2, 4>;

/// Those of Rec. ITU-R BT.709, which all colours of this library have.
Primaries rec709_primaries();

/// CIE XYZ of colours that are relative to `primaries`, white having Y = 1 (SMPTE RP 177). Singular if they
/// are.
glm::dmat3 xyz_from_rgb(const Primaries& primaries);

/// Without adaptation to another white: the same light, described by other numbers.
glm::dmat3 rec709_from_xyz();

}  // namespace mirrorbake::image_files
