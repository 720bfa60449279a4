#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/image/image.hpp"

/// Image files: EXR through OpenEXR; WebP through libwebp; HDR by a reader of its own; TIFF, PNG and JPEG,
/// and writing HDR, through OpenImageIO, in a library that is loaded when it is needed first. None of them is
/// seen outside.
namespace mirrorbake {

/// Bounds of what a reader accepts: files are hostile until read. They are checked before pixels are
/// allocated.
struct ImageLimits {
  int max_side = 65536;  ///< pixels
  int max_channels = 1024;
  std::uint64_t max_bytes = std::uint64_t{4} << 30;  ///< of the decoded float32 pixels
};

/// Pixel storage in a file. `automatic`: float16 for EXR, 8 bit for PNG and JPEG, float32 otherwise.
enum class PixelFormat { automatic, half, float32, uint8, uint16 };

template <>
struct EnumNames<PixelFormat> {
  static constexpr std::string_view what = "format";
  static constexpr auto names = enum_names("automatic", "half", "float32", "uint8", "uint16");
};

struct SaveReport {
  std::uint64_t clamped_to_half = 0;  ///< values beyond ±65504 in a file of float16
  std::uint64_t clipped = 0;          ///< values outside [0,1], or below 0 in HDR, or NaN there
};

/// Which pixels of an EXR file that has several sets of them. Other files have one, of which both are empty.
struct ImageChoice {
  std::string part;  ///< name or number from 0 of a part; empty: the first with colours, or else the first
  /// Its channels, without its name and the dot before them; empty: all channels of the part
  std::string layer;
};

/// Reads a file as scene-linear float32 of Rec. 709 primaries. What kind of file it is follows from its first
/// bytes, not from its name. Integer formats are decoded from sRGB unless the file says that it is linear;
/// alpha is left alone, colour is multiplied by it (premultiplied, as EXR has it). The image is the display
/// window: what a cropped data window leaves out is 0, and it is upright, whatever order of rows and columns
/// the file states. Of a file with several images one is read, of EXR the chosen one. EXR's chromaticities,
/// and EXPOSURE and XYZE of HDR, are applied; its integer channels (ids) keep their values. Channel names are
/// valid UTF-8. Throws FileError if it is missing, not an image, truncated, beyond `limits`, or claims more
/// than its bytes can hold; TIFF, PNG and JPEG also if the library that reads them cannot be loaded.
Image load_image(const std::string& path, const ImageLimits& limits = {}, const ImageChoice& choice = {});

/// The colours of an image: what is left of it to shine. Channels R, G, B, or Y alone; of an image with none
/// of its own the only layer that has them. Depth, alpha and others are left out. Throws FileError(name) if
/// there are none, or several layers that have them.
Image colours_of(const std::string& name, Image image);

/// The channels of several images of one size side by side, each image's with a prefix.
Image merge(const std::vector<std::pair<std::string, const Image*>>& images);

struct ImageSize {
  int width = 0;   ///< pixels
  int height = 0;  ///< pixels
  int channels = 0;
  bool is_tileable = true;  ///< TextureFile reads it: upright, and of a format that OpenImageIO reads here
};

/// Reads what a file's header says. Throws FileError as load_image does, but for damaged pixels.
ImageSize read_image_size(const std::string& path, const ImageLimits& limits = {});

/// Whether integers are decoded from sRGB: as load_image does, always (floats too), or never.
enum class Transfer { automatic, srgb, linear };

template <>
struct EnumNames<Transfer> {
  static constexpr std::string_view what = "transfer";
  static constexpr auto names = enum_names("automatic", "srgb", "linear");
};

/// What becomes of an alpha channel: the colour is multiplied by it, as load_image does; it is dropped and
/// the colour left as it is stored; or it alone is kept. Images without one stay as they are.
enum class AlphaUse { multiply, drop, only };

struct DecodeOptions {
  ImageLimits limits;
  ImageChoice choice;
  Transfer transfer = Transfer::automatic;
  AlphaUse alpha = AlphaUse::multiply;
};

/// Decodes an image file that is in memory; `name` stands for its path in errors. As load_image, and
/// FileError also if the image claims to be larger than its format can compress into so few bytes.
Image decode_image(const std::string& name, std::span<const unsigned char> bytes,
                   const DecodeOptions& options = {});

/// Whether the extension of `path` names a format that save_image writes.
bool has_image_extension(const std::string& path);

/// What save_image would refuse whatever the image is: throws FileError if the extension of `path` names no
/// format or one that cannot store `format`, if `path` is empty or a folder, or its folder does not exist.
/// Nothing is written.
void check_image_path(const std::string& path, PixelFormat format = PixelFormat::automatic);

/// Writes atomically: a temporary file beside `path`, renamed when it is complete. The extension decides the
/// format. EXR and TIFF hold any channels; PNG one to four, of which an even number must end with "A"; JPEG
/// one or three; HDR three, rounded to the nearest that its 8 bits hold. Integer formats are encoded to sRGB
/// after clipping to [0,1], alpha unassociated. Throws FileError if the file cannot be written or its kind
/// cannot hold the image, InvalidArgument if the image is empty or its parts disagree.
SaveReport save_image(const std::string& path, const Image& image,
                      PixelFormat format = PixelFormat::automatic);

/// The same for `pixels` of shape height × width × channels.size().
SaveReport save_image(const std::string& path, int width, int height, std::span<const std::string> channels,
                      std::span<const float> pixels, PixelFormat format = PixelFormat::automatic);

/// An EXR file that holds mip levels: level 0 and as many further ones as there are images, each half as wide
/// and high, rounded down but 1 at least. OpenEXR wants levels down to one pixel: what is missing, of which a
/// cube with its faces one below the other has two, is averaged from the last image. Written as save_image
/// does. Throws FileError and InvalidArgument as it does, and for images that are no levels of one.
SaveReport save_levels(const std::string& path, std::vector<Image> levels,
                       PixelFormat format = PixelFormat::automatic);

/// What save_levels would refuse whatever the images are, as check_image_path does.
void check_levels_path(const std::string& path, PixelFormat format = PixelFormat::automatic);

/// Lets EXR files be packed on so many threads of OpenEXR's, 0 to 1024; none until it is called. They are one
/// pool for the whole process and do not survive fork(): a program's choice. Throws InvalidArgument.
void set_exr_threads(int threads);

/// Names of 1 to 4 channels: Y; Y, A; R, G, B; R, G, B, A. Throws InvalidArgument for any other count.
std::vector<std::string> default_channels(int count);

}  // namespace mirrorbake
