#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

/// The Utah teapot as bicubic Bézier patches: Newell, "The utilization of procedure models in digital image
/// synthesis", PhD thesis, University of Utah, 1975; control points as published by Crow, "The origins of the
/// teapot", IEEE Computer Graphics and Applications 7(1), 1987, who added the bottom, in the proportions that
/// Blinn gave it (lower than the pot on the museum's shelf by a factor of 1.3). Listings of 306 points repeat
/// some; these are the distinct ones.
///
/// The axis is +Z, the spout points along +X, the foot stands on z = 0 and the knob ends at z = 3.15.
namespace mirrorbake::utah_teapot {

constexpr std::size_t kPatchCount = 32;
constexpr std::size_t kControlPointCount = 290;

/// Eight bands of four patches each, in this order: rim, upper body, lower body, handle, spout, knob, lid,
/// bottom.
constexpr std::size_t kPatchesPerBand = 4;
constexpr std::size_t kBandCount = kPatchCount / kPatchesPerBand;
constexpr std::size_t kKnobBand = 5;
constexpr std::size_t kLidBand = 6;

/// Indices of each patch's control points: entry 4·j + i belongs to the Bernstein polynomials B_i(u) B_j(v).
/// The outward normal is ∂S/∂u × ∂S/∂v. In the knob and the bottom the four points of row j = 0 coincide.
extern const std::array<std::array<std::uint16_t, 16>, kPatchCount> kPatches;
extern const std::array<glm::dvec3, kControlPointCount> kControlPoints;

}  // namespace mirrorbake::utah_teapot
