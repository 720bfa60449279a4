#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "image_files.hpp"

namespace mirrorbake::image_files {

/// Walks the headers and throws FileError if an attribute is longer than the file, before OpenEXR makes room
/// for it.
void check_exr(const std::string& name, const Bytes& bytes);

/// Writes pixels of height × width × channels.size() to `file`, as scan lines in ZIP blocks; errors name
/// `path`. Halves are clamped to ±65504; returns how many were. Throws FileError.
std::uint64_t write_exr(const std::string& path, const std::string& file, int width, int height,
                        std::span<const std::string> channels, std::span<const float> pixels, bool as_half);

/// The same for all levels of an image, in tiles of 64².
std::uint64_t write_exr_levels(const std::string& path, const std::string& file,
                               std::span<const Image> levels, bool as_half);

}  // namespace mirrorbake::image_files
