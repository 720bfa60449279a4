#pragma once

#include <cstdint>
#include <string>

#include "mirrorbake/image/image.hpp"

/// Image files (EXR, HDR, TIFF, PNG, JPEG) through OpenImageIO, which stays behind this header.
namespace mirrorbake {

/// Bounds of what a reader accepts: files are hostile until read.
struct ImageLimits {
  int max_side = 65536;                                ///< pixels
  std::uint64_t max_bytes = std::uint64_t{4} << 30;    ///< of the decoded float32 pixels
};

/// Pixel storage in a file. `automatic`: float16 for EXR, 8 bit for PNG and JPEG, float32 otherwise.
enum class PixelFormat { automatic, half, float32, uint8, uint16 };

struct SaveReport {
  std::uint64_t clamped_to_half = 0;  ///< values beyond ±65504 that were clamped because the file stores float16
};

/// Reads a file as scene-linear float32; integer formats are decoded from sRGB, alpha is left alone. Throws
/// FileError if it is missing, not an image, truncated or beyond `limits`.
Image load_image(const std::string& path, const ImageLimits& limits = {});

/// Writes atomically: a temporary file beside `path`, renamed when it is complete. The extension decides the
/// format. Integer formats are encoded to sRGB after clipping to [0,1]. Throws FileError.
SaveReport save_image(const std::string& path, const Image& image, PixelFormat format = PixelFormat::automatic);

}  // namespace mirrorbake
