#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "guard.hpp"
#include "mirrorbake/image/image_io.hpp"

/// The kinds of image files: what is known of each before one is opened, a row of one table; and the readers
/// that are part of this library.
namespace mirrorbake::image_files {

enum class FileKind { exr, hdr, tiff, png, jpeg, webp };

/// Bytes at the beginning of a file by which its kind is told.
inline constexpr std::size_t kHeadBytes = 12;

struct ImageKind {
  FileKind kind;
  std::string_view name;                            ///< in messages
  const char* plugin;                               ///< OpenImageIO's name for it
  bool (*begins)(std::string_view head);            ///< whether a file that begins so is of the kind
  Guard (*guard)(const std::string&, const Bytes&)  ///< what OpenImageIO must not see; null: all of it
      = nullptr;
  bool is_tileable = true;  ///< TextureFile reads it
  /// In lower case; none: it is only read. What follows is about writing.
  std::array<std::string_view, 2> extensions{};
  std::array<PixelFormat, 4> formats{};  ///< the first is what `automatic` means; none after `automatic`
  /// Whether it holds so many channels, of which the last may be alpha; null: any.
  bool (*holds)(std::size_t channels, bool ends_with_alpha) = nullptr;
  std::string_view held{};  ///< in words
};

inline constexpr std::array kImageKinds{
    ImageKind{.kind = FileKind::exr,
              .name = "EXR",
              .plugin = "openexr",
              .begins = [](std::string_view head) { return head.starts_with("\x76\x2f\x31\x01"); },
              .extensions = {".exr"},
              .formats = {PixelFormat::half, PixelFormat::float32}},
    ImageKind{.kind = FileKind::hdr,
              .name = "HDR",
              .plugin = "hdr",
              .begins = [](std::string_view head) { return head.starts_with("#?"); },
              .is_tileable = false,
              .extensions = {".hdr"},
              .formats = {PixelFormat::float32},
              .holds = [](std::size_t channels, bool alpha) { return channels == 3 && !alpha; },
              .held = "R, G, B"},
    ImageKind{.kind = FileKind::tiff,
              .name = "TIFF",
              .plugin = "tiff",
              .begins =
                  [](std::string_view head) {
                    return head.starts_with(std::string_view("II\x2a\0", 4)) ||
                           head.starts_with(std::string_view("II\x2b\0", 4)) ||
                           head.starts_with(std::string_view("MM\0\x2a", 4)) ||
                           head.starts_with(std::string_view("MM\0\x2b", 4));
                  },
              .guard = guard_tiff,
              .extensions = {".tif", ".tiff"},
              .formats = {PixelFormat::float32, PixelFormat::half, PixelFormat::uint8, PixelFormat::uint16}},
    ImageKind{.kind = FileKind::png,
              .name = "PNG",
              .plugin = "png",
              .begins = [](std::string_view head) { return head.starts_with("\x89PNG\r\n\x1a\n"); },
              .guard = guard_png,
              .extensions = {".png"},
              .formats = {PixelFormat::uint8, PixelFormat::uint16},
              .holds = [](std::size_t channels,
                          bool alpha) { return channels <= 4 && (channels % 2 == 0) == alpha; },
              .held = "Y; Y, A; R, G, B or R, G, B, A"},
    ImageKind{
        .kind = FileKind::jpeg,
        .name = "JPEG",
        .plugin = "jpeg",
        .begins = [](std::string_view head) { return head.starts_with("\xff\xd8\xff"); },
        .guard = guard_jpeg,
        .extensions = {".jpg", ".jpeg"},
        .formats = {PixelFormat::uint8},
        .holds = [](std::size_t channels, bool alpha) { return channels == 1 || (channels == 3 && !alpha); },
        .held = "Y or R, G, B"},
    ImageKind{.kind = FileKind::webp,
              .name = "WebP",
              .plugin = "webp",
              .begins =
                  [](std::string_view head) {
                    return head.size() == kHeadBytes && head.starts_with("RIFF") && head.ends_with("WEBP");
                  },
              .is_tileable = false},
};

class Reader;

/// Opens a part of an EXR file, with its integer channels (ids) as they are and its colours relative to Rec.
/// 709. Channels in no layer come before those of layers; V-Ray's ".R" is "R". Throws FileError for anything
/// but flat pixels with a value of every channel for every pixel, or luminance with chroma of half the size.
std::unique_ptr<Reader> open_exr(const std::string& name, std::shared_ptr<const Bytes> bytes,
                                 const ImageChoice& choice);

/// Opens a Radiance picture (Larson, Shakespeare: "Rendering with Radiance", 1998, and the format's
/// filefmts.pdf): RGBE or XYZE, flat, or run-length encoded in the old or the new way, scan lines of any of
/// the eight orientations. Its EXPOSURE and COLORCORR are divided out, so that pixels are radiance. Throws
/// FileError.
std::unique_ptr<Reader> open_hdr(const std::string& name, const Bytes& bytes);

/// Opens a WebP image, lossy or not; 8 bits, sRGB. Throws FileError, also for animations.
std::unique_ptr<Reader> open_webp(const std::string& name, const Bytes& bytes);

}  // namespace mirrorbake::image_files
