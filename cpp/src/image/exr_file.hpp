#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "image_files.hpp"

namespace mirrorbake::image_files {

/// Opens the first part of an EXR file, or of one in memory, whose bytes have to outlive the reader. Integer channels
/// (ids) keep their values. Throws FileError for anything but flat pixels with a value of every channel for every pixel.
std::unique_ptr<Reader> open_exr(const std::string& name,
                                 std::optional<std::span<const unsigned char>> memory = std::nullopt);

/// Writes pixels of height × width × channels.size() to `file`, as scan lines in ZIP blocks; errors name `path`. Halves are
/// clamped to ±65504; returns how many were. Throws FileError.
std::uint64_t write_exr(const std::string& path, const std::string& file, int width, int height,
                        std::span<const std::string> channels, std::span<const float> pixels, bool as_half);

}  // namespace mirrorbake::image_files
