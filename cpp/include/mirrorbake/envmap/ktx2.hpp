#pragma once

#include <string>

#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/image/image_io.hpp"

/// KTX 2.0 files (Khronos, "KTX File Format Specification" version 2.0) of cube maps with their levels.
namespace mirrorbake {

/// Writes a cube map as float16, atomically: one channel as R16, two as R16G16, three and four as R16G16B16A16, where
/// alpha is 1 if the map has none. Values beyond ±65504 are clamped and counted. Throws InvalidArgument if the map is
/// not a cube of one to four channels, FileError if the file cannot be written.
SaveReport save_ktx2(const std::string& path, const EnvMapView& map);

/// Reads a cube map of float16 or float32 with one to four channels and any number of levels, not supercompressed.
/// Throws FileError for anything else, damaged files and those beyond `limits`.
EnvMap load_ktx2(const std::string& path, const ImageLimits& limits = {});

}  // namespace mirrorbake
