#pragma once

#include <OpenImageIO/imageio.h>

#include <memory>
#include <string>

#include "mirrorbake/image/image_io.hpp"

/// What the readers of image files share.
namespace mirrorbake::image_files {

/// Opens one of the five kinds of files by its content, its alpha unassociated. `spec` gets its description with a
/// display window. Throws FileError for everything else, and beyond `limits`.
std::unique_ptr<OIIO::ImageInput> open_file(const std::string& path, const ImageLimits& limits,
                                            OIIO::ImageSpec& spec);

/// Whether the file's colours are to be decoded.
bool is_srgb(const OIIO::ImageSpec& spec, Transfer transfer);

}  // namespace mirrorbake::image_files
