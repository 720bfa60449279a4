#pragma once

#include <memory>
#include <string>

#include "image_files.hpp"

namespace mirrorbake::image_files {

/// Opens a Radiance picture (Larson, Shakespeare: "Rendering with Radiance", 1998, and the format's
/// filefmts.pdf): RGBE or XYZE, flat, or run-length encoded in the old or the new way, scan lines of any of
/// the eight orientations. Its EXPOSURE and COLORCORR are divided out, so that pixels are radiance. Throws
/// FileError.
std::unique_ptr<Reader> open_hdr(const std::string& name, const Bytes& bytes);

}  // namespace mirrorbake::image_files
