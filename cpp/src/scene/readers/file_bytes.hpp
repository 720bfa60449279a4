#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace mirrorbake {

/// The whole of a regular file, so that nothing later allocates more than the file's size justifies. Throws
/// FileError.
std::string read_file(const std::filesystem::path& path);

/// The file that a reference inside `directory`'s scene file means: relative, and after following links still
/// inside the directory. Nothing if it points elsewhere: a scene from the net must not read its user's files.
std::optional<std::filesystem::path> resolve_inside(const std::filesystem::path& directory,
                                                    const std::string& reference);

}  // namespace mirrorbake
