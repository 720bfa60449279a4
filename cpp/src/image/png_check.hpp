#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>

namespace mirrorbake::image_files {

/// Checks that a PNG file is a sequence of chunks with the right checksums, from its header to its end: libpng prints
/// messages of its own about those that are not. `read` puts the file's next bytes into a span and returns how many it
/// had left. Throws FileError, in which `name` stands for the path.
void check_png(const std::string& name, const std::function<std::size_t(std::span<unsigned char>)>& read);

}  // namespace mirrorbake::image_files
