#pragma once

#include <cstddef>
#include <string>

#include "mirrorbake/envmap/envmap.hpp"

namespace mirrorbake {

/// Fills NaN and infinite values of all levels from their surroundings: from the rim of a hole inwards, each
/// takes the mean of that channel over those of its eight neighbours, across the edges of faces, that are
/// known by then. Returns how many there were; every other value keeps its bits. Throws FileError, in which
/// `name` stands for the file, if a level has no finite value of a channel.
std::size_t repair_not_finite(const std::string& name, EnvMap& map);

}  // namespace mirrorbake
