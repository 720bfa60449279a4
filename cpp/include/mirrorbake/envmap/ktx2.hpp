#pragma once

#include <string>

#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/image/image_io.hpp"

/// KTX 2.0 files (Khronos, "KTX File Format Specification" version 2.0) of cube maps with their levels.
namespace mirrorbake {

/// Whether the extension is .ktx2, in capitals or not.
bool is_ktx2(const std::string& path);

/// Writes a cube map as float16 (`automatic`, `half`) or float32, atomically: one channel as R, two as RG,
/// three and four as RGBA. Of three channels the file says that its alpha is to be read as 1 (KTXswizzle
/// "rgb1"). Values beyond ±65504 are clamped to float16 and counted. Throws InvalidArgument if the map is not
/// a cube of one to four channels, FileError if the file cannot be written or `format` is another.
SaveReport save_ktx2(const std::string& path, const EnvMapView& map,
                     PixelFormat format = PixelFormat::automatic);

/// What save_ktx2 would refuse whatever the map's values are, by the same errors. Nothing is written.
void check_ktx2_path(const std::string& path, const Projection& projection,
                     PixelFormat format = PixelFormat::automatic);

/// Reads a cube map, or a picture of one face whose shape tells what map it is, with any number of levels:
/// integers of 8 and 16 bits, linear or sRGB, float16 and float32 of one to four channels, RGB9E5, R11G11B10
/// and BC6H; plain or supercompressed by Zstandard or ZLIB. Swizzles and the orientation of pictures are
/// followed; an alpha that is to be read as 1 is left out, and colours of integers are multiplied by another
/// unless they are. Throws FileError for anything else, damaged files and those beyond `limits`.
EnvMap load_ktx2(const std::string& path, const ImageLimits& limits = {});

}  // namespace mirrorbake
