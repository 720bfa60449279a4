#include "mirrorbake/image/image_io.hpp"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <optional>
#include <set>

#include "image_files.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/image/atomic_file.hpp"
#include "mirrorbake/image/color.hpp"
#include "png_check.hpp"

namespace mirrorbake {
namespace {

constexpr float kLargestHalf = 65504.0F;

enum class FileKind { exr, hdr, tiff, png, jpeg };

const char* plugin_name(FileKind kind) {
  switch (kind) {
    case FileKind::exr: return "openexr";
    case FileKind::hdr: return "hdr";
    case FileKind::tiff: return "tiff";
    case FileKind::png: return "png";
    case FileKind::jpeg: return "jpeg";
  }
  return "";
}

// Only these five readers ever see a file: OpenImageIO left to itself tries all of its plugins on one it does
// not recognise.
FileKind kind_from_head(const std::string& name, std::span<const unsigned char> head) {
  const auto starts_with = [&](std::initializer_list<int> magic) {
    return head.size() >= magic.size() && std::equal(magic.begin(), magic.end(), head.begin(),
                                                     [](int a, unsigned char b) { return a == b; });
  };
  if (starts_with({0x76, 0x2f, 0x31, 0x01})) return FileKind::exr;
  if (starts_with({'#', '?'})) return FileKind::hdr;
  if (starts_with({'I', 'I', 42, 0}) || starts_with({'I', 'I', 43, 0}) || starts_with({'M', 'M', 0, 42}) ||
      starts_with({'M', 'M', 0, 43})) {
    return FileKind::tiff;
  }
  if (starts_with({0x89, 'P', 'N', 'G', 0x0d, 0x0a, 0x1a, 0x0a})) return FileKind::png;
  if (starts_with({0xff, 0xd8, 0xff})) return FileKind::jpeg;
  throw FileError(name, "is not an EXR, HDR, TIFF, PNG or JPEG image");
}

FileKind kind_from_content(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) throw FileError(path, "does not exist");
  if (!std::filesystem::is_regular_file(status)) throw FileError(path, "is not a file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw FileError(path, "cannot be read");
  std::array<unsigned char, 8> head{};
  in.read(reinterpret_cast<char*>(head.data()), head.size());
  return kind_from_head(path, head);
}

std::optional<FileKind> known_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".exr") return FileKind::exr;
  if (extension == ".hdr") return FileKind::hdr;
  if (extension == ".tif" || extension == ".tiff") return FileKind::tiff;
  if (extension == ".png") return FileKind::png;
  if (extension == ".jpg" || extension == ".jpeg") return FileKind::jpeg;
  return std::nullopt;
}

FileKind kind_from_extension(const std::string& path) {
  if (const std::optional<FileKind> kind = known_extension(path)) return *kind;
  throw FileError(path, "has an unknown extension, expected .exr, .hdr, .tif, .tiff, .png, .jpg or .jpeg");
}

// A JPEG decoder makes up what a truncated file lacks and carries on. Every complete file ends with an
// end-of-image marker, possibly followed by a few bytes that programs append.
constexpr std::string_view kEndOfJpeg = "\xff\xd9";
constexpr std::size_t kJpegTail = 4096;

bool jpeg_is_complete(const std::string& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = in.tellg();
  const std::streamoff tail_size = std::min<std::streamoff>(size, kJpegTail);
  std::string tail(static_cast<std::size_t>(tail_size), '\0');
  in.seekg(size - tail_size);
  in.read(tail.data(), tail_size);
  return in && tail.find(kEndOfJpeg) != std::string::npos;
}

bool jpeg_is_complete(std::span<const unsigned char> bytes) {
  const auto tail = bytes.last(std::min(bytes.size(), kJpegTail));
  return std::search(tail.begin(), tail.end(), kEndOfJpeg.begin(), kEndOfJpeg.end(),
                     [](auto a, char b) { return a == static_cast<unsigned char>(b); }) != tail.end();
}

// What only looks like a whole file is found before a decoder sees it.
void check_complete(const std::string& path, FileKind kind) {
  if (kind == FileKind::jpeg && !jpeg_is_complete(path)) throw FileError(path, "is truncated");
  if (kind != FileKind::png) return;
  std::ifstream in(path, std::ios::binary);
  image_files::check_png(path, [&](std::span<unsigned char> to) {
    in.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(to.size()));
    return static_cast<std::size_t>(in.gcount());
  });
}

void check_complete(const std::string& name, FileKind kind, std::span<const unsigned char> bytes) {
  if (kind == FileKind::jpeg && !jpeg_is_complete(bytes)) throw FileError(name, "is truncated");
  if (kind != FileKind::png) return;
  image_files::check_png(name, [&](std::span<unsigned char> to) {
    const std::size_t count = std::min(to.size(), bytes.size());
    std::copy_n(bytes.begin(), count, to.begin());
    bytes = bytes.subspan(count);
    return count;
  });
}

// What OpenImageIO says of a failure, often several lines, in one.
std::string one_line(std::string text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.pop_back();
  for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at)) {
    text.replace(at, 1, "; ");
  }
  return text;
}

std::string size_text(std::int64_t width, std::int64_t height, int channels) {
  return std::to_string(width) + " x " + std::to_string(height) + " pixels of " + std::to_string(channels) +
         " channels";
}

void check_limits(const std::string& path, std::int64_t width, std::int64_t height, int channels,
                  const ImageLimits& limits) {
  if (width < 1 || height < 1 || channels < 1) {
    throw FileError(path, "is empty: " + size_text(width, height, channels));
  }
  const bool too_wide = width > limits.max_side || height > limits.max_side || channels > limits.max_channels;
  // Sides and channels are bounded by then, so that the product cannot overflow.
  if (too_wide || static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) *
                          static_cast<std::uint64_t>(channels) * sizeof(float) >
                      limits.max_bytes) {
    throw FileError(path, "is too large: " + size_text(width, height, channels) + ", the limits are " +
                              std::to_string(limits.max_side) + " a side, " +
                              std::to_string(limits.max_channels) + " channels and " +
                              std::to_string(limits.max_bytes >> 20) + " MiB");
  }
}

bool is_integer(const OIIO::TypeDesc& format) { return !format.is_floating_point(); }

bool says_linear(const OIIO::ImageSpec& spec) {
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  return space == "Linear" || space == "linear" || space == "scene_linear" || space.starts_with("lin_");
}

// Copies the part of the data window that lies in the display window.
std::vector<float> display_window(const OIIO::ImageSpec& spec, const std::vector<float>& data) {
  const std::size_t channels = static_cast<std::size_t>(spec.nchannels);
  std::vector<float> pixels(static_cast<std::size_t>(spec.full_width) *
                            static_cast<std::size_t>(spec.full_height) * channels);
  const std::int64_t left = std::max<std::int64_t>(spec.x, spec.full_x);
  const std::int64_t right =
      std::min<std::int64_t>(std::int64_t{spec.x} + spec.width, std::int64_t{spec.full_x} + spec.full_width);
  const std::int64_t top = std::max<std::int64_t>(spec.y, spec.full_y);
  const std::int64_t bottom = std::min<std::int64_t>(std::int64_t{spec.y} + spec.height,
                                                     std::int64_t{spec.full_y} + spec.full_height);
  for (std::int64_t y = top; y < bottom && left < right; ++y) {
    const std::size_t from = static_cast<std::size_t>((y - spec.y) * spec.width + left - spec.x) * channels;
    const std::size_t to =
        static_cast<std::size_t>((y - spec.full_y) * spec.full_width + left - spec.full_x) * channels;
    std::copy_n(data.begin() + static_cast<std::ptrdiff_t>(from),
                static_cast<std::size_t>(right - left) * channels,
                pixels.begin() + static_cast<std::ptrdiff_t>(to));
  }
  return pixels;
}

void decode_srgb(const OIIO::ImageSpec& spec, std::vector<float>& pixels) {
  std::array<float, 256> table;
  for (std::size_t i = 0; i < table.size(); ++i) table[i] = srgb_decode(static_cast<float>(i) / 255.0F);
  const bool is_byte = spec.format == OIIO::TypeDesc::UINT8;
  const std::size_t channels = static_cast<std::size_t>(spec.nchannels);
  const std::size_t alpha = spec.alpha_channel < 0 ? channels : static_cast<std::size_t>(spec.alpha_channel);
  parallel_for(pixels.size() / channels, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t c = 0; c < channels; ++c) {
        float& value = pixels[i * channels + c];
        if (c == alpha) continue;
        value = is_byte ? table[static_cast<std::size_t>(value * 255.0F + 0.5F)] : srgb_decode(value);
      }
    }
  });
}

void multiply_by_alpha(const OIIO::ImageSpec& spec, std::vector<float>& pixels) {
  const std::size_t channels = static_cast<std::size_t>(spec.nchannels);
  const std::size_t alpha = static_cast<std::size_t>(spec.alpha_channel);
  for (std::size_t i = 0; i < pixels.size(); i += channels) {
    for (std::size_t c = 0; c < channels; ++c) {
      if (c != alpha) pixels[i + c] *= pixels[i + alpha];
    }
  }
}

// Deflate, in PNG and TIFF, gives at most 1032 bytes for one; JPEG 1024: six blocks of two bits at least for 16 × 16
// pixels of 3 bytes, if its chroma is subsampled; LZW 2730. OpenEXR's DCT knows no such bound.
void check_expansion(const std::string& name, FileKind kind, const OIIO::ImageSpec& spec, std::size_t size) {
  if (kind == FileKind::exr) return;
  const std::uint64_t most = (kind == FileKind::tiff ? std::uint64_t{2730} : std::uint64_t{1100}) * size;
  const std::uint64_t texels =
      std::max(static_cast<std::uint64_t>(spec.width) * static_cast<std::uint64_t>(spec.height),
               static_cast<std::uint64_t>(spec.full_width) * static_cast<std::uint64_t>(spec.full_height));
  if (texels * spec.pixel_bytes(true) > most) {
    throw FileError(name, "claims " + size_text(spec.width, spec.height, spec.nchannels) +
                              ", more than its " + std::to_string(size) + " bytes can hold");
  }
}

Image without_alpha(Image image, int alpha) {
  const std::size_t channels = image.channels.size();
  std::size_t to = 0;
  for (std::size_t from = 0; from < image.pixels.size(); ++from) {
    if (from % channels != static_cast<std::size_t>(alpha)) image.pixels[to++] = image.pixels[from];
  }
  image.pixels.resize(to);
  image.channels.erase(image.channels.begin() + alpha);
  return image;
}

Image only_alpha(Image image, int alpha) {
  const std::size_t channels = image.channels.size();
  std::size_t to = 0;
  for (auto from = static_cast<std::size_t>(alpha); from < image.pixels.size(); from += channels) {
    image.pixels[to++] = image.pixels[from];
  }
  image.pixels.resize(to);
  image.channels = {"A"};
  return image;
}

std::unique_ptr<OIIO::ImageInput> open_input(const std::string& path, FileKind kind,
                                             const ImageLimits& limits, OIIO::Filesystem::IOProxy* proxy,
                                             OIIO::ImageSpec& spec) {
  std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(plugin_name(kind));
  if (!input) throw FileError(path, "cannot be read: " + one_line(OIIO::geterror()));
  if (proxy != nullptr && !input->set_ioproxy(proxy)) throw FileError(path, "cannot be read from memory");
  // Unassociated alpha is multiplied in by us, in linear light, and not by the reader in encoded values.
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  if (!input->open(path, spec, config))
    throw FileError(path, "cannot be read: " + one_line(input->geterror()));
  if (spec.deep) throw FileError(path, "holds deep samples, expected flat pixels");
  if (spec.depth > 1) throw FileError(path, "is a volume, expected an image");
  check_limits(path, spec.width, spec.height, spec.nchannels, limits);
  if (spec.full_width < 1 || spec.full_height < 1) {
    spec.full_x = spec.x;
    spec.full_y = spec.y;
    spec.full_width = spec.width;
    spec.full_height = spec.height;
  }
  check_limits(path, spec.full_width, spec.full_height, spec.nchannels, limits);
  return input;
}

Image read(const std::string& path, FileKind kind, const DecodeOptions& options,
           std::optional<std::span<const unsigned char>> memory = std::nullopt) {
  std::optional<OIIO::Filesystem::IOMemReader> proxy;
  if (memory) proxy.emplace(memory->data(), memory->size());
  OIIO::ImageSpec spec;
  const std::unique_ptr<OIIO::ImageInput> input =
      open_input(path, kind, options.limits, proxy ? &*proxy : nullptr, spec);
  if (memory) check_expansion(path, kind, spec, memory->size());

  Image image;
  image.width = spec.full_width;
  image.height = spec.full_height;
  image.channels.assign(spec.channelnames.begin(), spec.channelnames.end());
  image.pixels.resize(static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height) *
                      static_cast<std::size_t>(spec.nchannels));
  input->threads(thread_count());
  // The TIFF reader succeeds on a truncated file and only leaves a message.
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.pixels.data()) ||
      input->has_error()) {
    throw FileError(path, "is damaged or truncated: " + one_line(input->geterror()));
  }
  if (image_files::is_srgb(spec, options.transfer)) decode_srgb(spec, image.pixels);
  if (options.alpha == AlphaUse::multiply && spec.alpha_channel >= 0 &&
      spec.get_int_attribute("oiio:UnassociatedAlpha") != 0) {
    multiply_by_alpha(spec, image.pixels);
  }
  if (spec.x != spec.full_x || spec.y != spec.full_y || spec.width != spec.full_width ||
      spec.height != spec.full_height) {
    image.pixels = display_window(spec, image.pixels);
  }
  if (options.alpha == AlphaUse::drop && spec.alpha_channel >= 0 && spec.nchannels > 1) {
    return without_alpha(std::move(image), spec.alpha_channel);
  }
  if (options.alpha == AlphaUse::only && spec.alpha_channel >= 0) {
    return only_alpha(std::move(image), spec.alpha_channel);
  }
  return image;
}

// Whatever goes wrong while `read` runs is the file's fault.
template <typename Read>
Image file_errors(const std::string& name, const Read& read_image) {
  try {
    return read_image();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw FileError(name, "does not fit into memory");
  } catch (const std::exception& e) {
    throw FileError(name, std::string("is damaged: ") + e.what());
  }
}

OIIO::TypeDesc storage_type(const std::string& path, FileKind kind, PixelFormat format) {
  const auto refuse = [&](const char* expected) {
    throw FileError(path, std::string("its format cannot store these pixels, expected ") + expected);
  };
  using OIIO::TypeDesc;
  switch (kind) {
    case FileKind::exr:
      if (format == PixelFormat::automatic || format == PixelFormat::half) return TypeDesc::HALF;
      if (format != PixelFormat::float32) refuse("half or float32");
      return TypeDesc::FLOAT;
    case FileKind::hdr:
      if (format != PixelFormat::automatic && format != PixelFormat::float32)
        refuse("float32 (stored as RGBE)");
      return TypeDesc::FLOAT;
    case FileKind::png:
      if (format == PixelFormat::uint16) return TypeDesc::UINT16;
      if (format != PixelFormat::automatic && format != PixelFormat::uint8) refuse("uint8 or uint16");
      return TypeDesc::UINT8;
    case FileKind::jpeg:
      if (format != PixelFormat::automatic && format != PixelFormat::uint8) refuse("uint8");
      return TypeDesc::UINT8;
    case FileKind::tiff:
      if (format == PixelFormat::half) return TypeDesc::HALF;
      if (format == PixelFormat::uint8) return TypeDesc::UINT8;
      if (format == PixelFormat::uint16) return TypeDesc::UINT16;
      return TypeDesc::FLOAT;
  }
  return TypeDesc::UNKNOWN;
}

void check_channels(const std::string& path, FileKind kind, std::span<const std::string> channels) {
  const std::size_t count = channels.size();
  const bool ends_with_alpha = channels.back() == "A";
  const bool holds = kind == FileKind::png    ? count <= 4 && (count % 2 == 0) == ends_with_alpha
                     : kind == FileKind::jpeg ? count == 1 || (count == 3 && !ends_with_alpha)
                     : kind == FileKind::hdr  ? count == 3 && !ends_with_alpha
                                              : true;
  if (holds) return;
  throw FileError(path, std::string("a ") +
                            (kind == FileKind::png    ? "PNG holds Y; Y, A; R, G, B or R, G, B, A"
                             : kind == FileKind::jpeg ? "JPEG holds Y or R, G, B"
                                                      : "HDR file holds R, G, B") +
                            ", the image has " + std::to_string(count) + " channels, the last named " +
                            channels.back());
}

// Rounds a colour to what RGBE holds, three mantissas of 8 bits and the largest one's exponent: the writer cuts off what
// is beyond, which darkens images by half a percent.
void round_to_rgbe(std::span<float, 3> color) {
  int exponent = 0;
  const float largest = std::max({color[0], color[1], color[2]});
  const float mantissa = std::frexp(largest, &exponent);
  if (mantissa >= 255.5F / 256.0F) ++exponent;
  for (float& v : color) v = std::ldexp(std::nearbyint(std::ldexp(v, 8 - exponent)), exponent - 8);
}

// Turns `values`, whole pixels, into what `spec` stores.
void encode(const OIIO::ImageSpec& spec, FileKind kind, std::span<float> values, SaveReport& report) {
  if (spec.format == OIIO::TypeDesc::HALF) {
    for (float& v : values) {
      if (std::abs(v) > kLargestHalf) {
        v = std::copysign(kLargestHalf, v);
        ++report.clamped_to_half;
      }
    }
    return;
  }
  if (kind == FileKind::hdr) {
    // RGBE has no sign, and its largest exponent is 2^127.
    for (float& v : values) {
      if (!(v >= 0.0F) || v > 0x1.fep126F) {
        v = v > 0.0F ? 0x1.fep126F : 0.0F;
        ++report.clipped;
      }
    }
    for (std::size_t i = 0; i < values.size(); i += 3) round_to_rgbe(values.subspan(i).first<3>());
    return;
  }
  if (!is_integer(spec.format)) return;
  const std::size_t channels = static_cast<std::size_t>(spec.nchannels);
  const std::size_t alpha = spec.alpha_channel < 0 ? channels : static_cast<std::size_t>(spec.alpha_channel);
  for (std::size_t i = 0; i < values.size(); i += channels) {
    if (alpha < channels) {
      const float a = values[i + alpha];
      for (std::size_t c = 0; c < channels; ++c) {
        if (c != alpha && a != 0.0F) values[i + c] /= a;
      }
    }
    for (std::size_t c = 0; c < channels; ++c) {
      float& v = values[i + c];
      if (!(v >= 0.0F && v <= 1.0F)) ++report.clipped;
      v = c == alpha ? (v > 0.0F ? std::min(v, 1.0F) : 0.0F) : srgb_encode(v);
    }
  }
}

}  // namespace

std::unique_ptr<OIIO::ImageInput> image_files::open_file(const std::string& path, const ImageLimits& limits,
                                                         OIIO::ImageSpec& spec) {
  const FileKind kind = kind_from_content(path);
  check_complete(path, kind);
  std::unique_ptr<OIIO::ImageInput> input = open_input(path, kind, limits, nullptr, spec);
  check_expansion(path, kind, spec, std::filesystem::file_size(path));
  return input;
}

bool image_files::is_srgb(const OIIO::ImageSpec& spec, Transfer transfer) {
  if (transfer == Transfer::automatic) return is_integer(spec.format) && !says_linear(spec);
  return transfer == Transfer::srgb;
}

PixelFormat parse_pixel_format(std::string_view name) {
  if (name == "automatic") return PixelFormat::automatic;
  if (name == "half") return PixelFormat::half;
  if (name == "float32") return PixelFormat::float32;
  if (name == "uint8") return PixelFormat::uint8;
  if (name == "uint16") return PixelFormat::uint16;
  throw InvalidArgument("format", name, "automatic, half, float32, uint8 or uint16");
}

std::vector<std::string> default_channels(int count) {
  switch (count) {
    case 1: return {"Y"};
    case 2: return {"Y", "A"};
    case 3: return {"R", "G", "B"};
    case 4: return {"R", "G", "B", "A"};
    default: throw InvalidArgument("channels", std::to_string(count), "1 to 4, or the names of the channels");
  }
}

Image load_image(const std::string& path, const ImageLimits& limits) {
  const FileKind kind = kind_from_content(path);
  check_complete(path, kind);
  return file_errors(path, [&] {
    return read(path, kind, {limits, Transfer::automatic, AlphaUse::multiply});
  });
}

ImageSize read_image_size(const std::string& path, const ImageLimits& limits) {
  try {
    OIIO::ImageSpec spec;
    const auto input = image_files::open_file(path, limits, spec);
    return {spec.full_width, spec.full_height, spec.nchannels};
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw FileError(path, std::string("is damaged: ") + e.what());
  }
}

Image decode_image(const std::string& name, std::span<const unsigned char> bytes,
                   const DecodeOptions& options) {
  const FileKind kind = kind_from_head(name, bytes);
  check_complete(name, kind, bytes);
  return file_errors(name, [&] { return read(name, kind, options, bytes); });
}

bool has_image_extension(const std::string& path) { return known_extension(path).has_value(); }

void check_image_path(const std::string& path, PixelFormat format) {
  if (path.empty()) throw FileError("''", "an output path may not be empty");
  storage_type(path, kind_from_extension(path), format);
  const AtomicFile checks_the_folder(path);
}

SaveReport save_image(const std::string& path, const Image& image, PixelFormat format) {
  return save_image(path, image.width, image.height, image.channels, image.pixels, format);
}

SaveReport save_image(const std::string& path, int width, int height, std::span<const std::string> channels,
                      std::span<const float> pixels, PixelFormat format) {
  if (width < 1 || height < 1 || channels.empty()) {
    throw InvalidArgument("image", size_text(width, height, static_cast<int>(channels.size())),
                          "at least one pixel");
  }
  const std::size_t row_values = static_cast<std::size_t>(width) * channels.size();
  if (pixels.size() != row_values * static_cast<std::size_t>(height)) {
    throw InvalidArgument("image.pixels", std::to_string(pixels.size()) + " values",
                          size_text(width, height, static_cast<int>(channels.size())));
  }
  if (std::set<std::string>(channels.begin(), channels.end()).size() != channels.size()) {
    throw InvalidArgument("image.channels", "a list with a name twice", "different names");
  }
  check_image_path(path, format);
  const FileKind kind = kind_from_extension(path);
  check_channels(path, kind, channels);

  OIIO::ImageSpec spec(width, height, static_cast<int>(channels.size()), storage_type(path, kind, format));
  spec.channelnames.assign(channels.begin(), channels.end());
  const auto alpha = std::find(channels.begin(), channels.end(), "A");
  spec.alpha_channel = alpha == channels.end() ? -1 : static_cast<int>(alpha - channels.begin());
  if (is_integer(spec.format)) {
    spec.attribute("oiio:ColorSpace", "sRGB");
    if (spec.alpha_channel >= 0) spec.attribute("oiio:UnassociatedAlpha", 1);
  } else {
    spec.attribute("oiio:ColorSpace", "Linear");
  }
  if (kind == FileKind::exr || kind == FileKind::tiff) spec.attribute("compression", "zip");
  spec.attribute("Software", "mirrorbake");

  AtomicFile file(path);
  // The proxy outlives its user, which may still write to it when it is closed by an exception.
  OIIO::Filesystem::IOVecOutput memory;
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(plugin_name(kind));
  if (!output) throw FileError(path, "cannot be written: " + one_line(OIIO::geterror()));
  output->threads(thread_count());
  // The PNG writer does not notice a full disk, and the JPEG writer ends the program: these get none to write to.
  const bool in_memory = kind == FileKind::png || kind == FileKind::jpeg;
  if (in_memory && !output->set_ioproxy(&memory)) throw FileError(path, "cannot be written to memory");
  if (!output->open(file.temporary(), spec))
    throw FileError(path, "cannot be written: " + one_line(output->geterror()));
  SaveReport report;
  constexpr int kRows = 64;
  std::vector<float> rows;
  for (int y = 0; y < height; y += kRows) {
    const int end = std::min(height, y + kRows);
    const auto first = pixels.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(y) * row_values);
    rows.assign(first, first + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(end - y) * row_values));
    encode(spec, kind, rows, report);
    if (!output->write_scanlines(y, end, 0, OIIO::TypeDesc::FLOAT, rows.data())) {
      throw FileError(path, "cannot be written: " + one_line(output->geterror()));
    }
  }
  if (!output->close()) throw FileError(path, "cannot be written: " + one_line(output->geterror()));
  if (in_memory) {
    write_file(path, std::as_bytes(std::span(memory.buffer())));
  } else {
    file.commit();
  }
  return report;
}

}  // namespace mirrorbake
