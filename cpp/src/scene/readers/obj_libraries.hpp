#pragma once

#include <string>
#include <string_view>
#include <vector>

/// How OBJ files name their material libraries.
namespace mirrorbake {

/// What follows each `mtllib` of an OBJ file's text.
std::vector<std::string> material_libraries(std::string_view text);

/// The files that `names` after an `mtllib` stand for: one whose name has spaces, if the OBJ file `path` has
/// it beside it, or several. "\\" between folders becomes "/".
std::vector<std::string> library_files(const std::string& path, std::string names);

}  // namespace mirrorbake
