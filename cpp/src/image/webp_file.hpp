#pragma once

#include <memory>
#include <string>

#include "image_files.hpp"

namespace mirrorbake::image_files {

/// Opens a WebP image, lossy or not; 8 bits, sRGB. Throws FileError, also for animations.
std::unique_ptr<Reader> open_webp(const std::string& name, const Bytes& bytes);

}  // namespace mirrorbake::image_files
