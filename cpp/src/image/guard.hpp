#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mirrorbake/image/bytes.hpp"

/// What stands between a file and OpenImageIO. The reader interprets metadata that this library does not use,
/// and its XMP parser overflows the stack on nested elements; so a decoder sees a file whose metadata are
/// covered by patches.
namespace mirrorbake::image_files {

/// Which corner of the picture the first stored row and column are, as TIFF numbers it (tag 274, EXIF the
/// same): 1 is the upright picture, 5 to 8 have rows and columns exchanged.
struct Guard {
  std::vector<Patch> patches;
  int orientation = 1;
  std::size_t pixel_bits = 0;  ///< of all channels as they are stored; 0: as the decoder says
  bool is_fax = false;         ///< TIFF's bilevel compressions, in which a white page takes next to nothing
};

/// Walks all chunks and finds what only looks like a whole file. Throws FileError.
Guard guard_png(const std::string& name, const Bytes& bytes);

/// Walks the segments before the pixels. Throws FileError if the file is truncated.
Guard guard_jpeg(const std::string& name, const Bytes& bytes);

/// Walks the directories. Throws FileError if the first of them is damaged, and for tiled CMYK, for which
/// OpenImageIO's buffers are too small.
Guard guard_tiff(const std::string& name, const Bytes& bytes);

/// Orientation that an EXIF block, which is a TIFF file without pixels, states; 1 if it states none.
int exif_orientation(const std::vector<unsigned char>& block);

}  // namespace mirrorbake::image_files
