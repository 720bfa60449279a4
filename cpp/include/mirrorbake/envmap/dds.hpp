#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/image/image_io.hpp"

/// DDS files (Microsoft, "Programming Guide for DDS") of cube maps with their levels. Direct3D's faces have
/// the order and orientation of OpenGL's.
namespace mirrorbake {

/// Whether the extension is .dds, in capitals or not.
bool is_dds(const std::string& path);

/// Writes a cube map with a DX10 header as float16 (`automatic`, `half`) or float32, atomically: one channel
/// as R, two as RG, three and four as RGBA; of three channels the header says that alpha is opaque. Values
/// beyond ±65504 are clamped to float16 and counted. Throws InvalidArgument if the map is not a cube of one
/// to four channels, FileError if the file cannot be written or `format` is another.
SaveReport save_dds(const std::string& path, const EnvMapView& map,
                    PixelFormat format = PixelFormat::automatic);

/// What save_dds would refuse whatever the map's values are, by the same errors. Nothing is written.
void check_dds_path(const std::string& path, const Projection& projection,
                    PixelFormat format = PixelFormat::automatic);

/// Writes blocks that an encoder has made of a cube of three channels: BC6H_UF16, all levels of a face, one
/// face after the other, (width + 3)/4 squared blocks of 16 bytes each. Throws InvalidArgument for another
/// number of bytes and what is no such cube, FileError if the file cannot be written.
void save_dds_bc6h(const std::string& path, const EnvMapLayout& layout, std::span<const std::byte> blocks);

/// Reads a cube map with any number of levels: float16 or float32 of one to four channels, BC6H, RGB9E5,
/// R11G11B10, or RGBA of 8 or 16 bits, with a DX10 header or the older codes of floats (as cmft writes). An
/// alpha that is opaque is left out; colours of integers are multiplied by another unless they are. Throws
/// FileError for anything else, damaged files and those beyond `limits`.
EnvMap load_dds(const std::string& path, const ImageLimits& limits = {});

}  // namespace mirrorbake
