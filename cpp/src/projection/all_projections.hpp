#pragma once

#include <array>

#include "mirrorbake/projection/traits.hpp"

/// The list of projections, each of which stands in a file of its own.
namespace mirrorbake {

extern const ProjectionTraits kCubeTraits, kDualParaboloidTraits, kSphereMapTraits, kLatlongTraits,
    kAngularTraits, kFisheyeTraits, kEqualAreaTraits;

/// In the order of ProjectionKind.
inline constexpr std::array kProjections = {
    &kCubeTraits,    &kDualParaboloidTraits, &kSphereMapTraits, &kLatlongTraits,
    &kAngularTraits, &kFisheyeTraits,        &kEqualAreaTraits,
};

}  // namespace mirrorbake
