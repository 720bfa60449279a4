#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "guard.hpp"
#include "image_kinds.hpp"
#include "mirrorbake/image/bytes.hpp"
#include "mirrorbake/image/image_io.hpp"

/// What the readers of image files share: OpenEXR's, which is part of this library, and OpenImageIO's in a
/// library that is loaded when it is needed. Nothing here knows either.
namespace mirrorbake::image_files {

/// The row of the table.
const ImageKind& row_of(FileKind kind);
/// Kind by content: the first bytes. Throws FileError, in which `name` stands for the path.
FileKind kind_of(const std::string& name, const Bytes& bytes);
/// Kind by extension of those that are written, the second throws FileError if it names none.
std::optional<FileKind> known_extension(const std::string& path);
FileKind kind_from_extension(const std::string& path);

/// Finds what only looks like a whole file, and what a decoder must not see, before a decoder sees it. Throws
/// FileError.
Guard guard_of(const std::string& name, FileKind kind, const Bytes& bytes);

/// Columns [x, x + width) and rows [y, y + height) of the plane that a file's pixels lie in.
struct Window {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  bool operator==(const Window&) const = default;
};

/// What a file says of its pixels.
struct Header {
  Window data;
  Window display;
  Window tile;  ///< size of one, empty: none
  std::vector<std::string> channels;
  int alpha = -1;  ///< index of the channel, -1: none
  bool unassociated_alpha = false;
  bool is_integer = false;
  bool is_byte = false;
  bool says_linear = false;
  std::size_t pixel_bits = 0;       ///< of all channels as they are stored
  int orientation = 1;              ///< as TIFF numbers it, see Guard
  std::uint64_t expansion = 0;      ///< bytes of pixels that a byte of the file can become, 0: unbounded
  bool expands_to_display = false;  ///< the bound holds for the display window, too

  int channel_count() const { return static_cast<int>(channels.size()); }
};

/// An open file, whose pixels have not been read.
class Reader {
 public:
  virtual ~Reader() = default;
  virtual const Header& header() const = 0;
  /// The data window as float32, rows from the top, the channels of a pixel together. Throws FileError.
  virtual void read(std::span<float> pixels) = 0;
};

/// Throws FileError for what is empty or beyond `limits`.
void check_limits(const std::string& path, const Header& header, const ImageLimits& limits);

/// Throws FileError if the pixels are more than `size` bytes can hold.
void check_expansion(const std::string& name, const Header& header, std::uint64_t size);

/// Whether the file's colours are to be decoded.
bool is_srgb(const Header& header, Transfer transfer);

/// "640 x 480 pixels of 3 channels".
std::string size_text(std::int64_t width, std::int64_t height, int channels);

/// What another library says of a failure, often several lines, in one.
std::string one_line(std::string text);

}  // namespace mirrorbake::image_files
