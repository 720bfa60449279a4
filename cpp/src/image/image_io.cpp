#include "mirrorbake/image/image_io.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <set>
#include <utility>

#include "exr_file.hpp"
#include "image_files.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/image/atomic_file.hpp"
#include "mirrorbake/image/color.hpp"
#include "openimageio.hpp"

namespace mirrorbake {
namespace {

using image_files::FileKind;
using image_files::Header;
using image_files::Reader;
using image_files::size_text;
using image_files::Window;

// Copies the part of the data window that lies in the display window.
std::vector<float> display_window(const Header& header, const std::vector<float>& pixels) {
  const Window& data = header.data;
  const Window& display = header.display;
  const std::size_t channels = header.channels.size();
  std::vector<float> result(static_cast<std::size_t>(display.width) *
                            static_cast<std::size_t>(display.height) * channels);
  const std::int64_t left = std::max(data.x, display.x);
  const std::int64_t right =
      std::min(std::int64_t{data.x} + data.width, std::int64_t{display.x} + display.width);
  const std::int64_t top = std::max(data.y, display.y);
  const std::int64_t bottom =
      std::min(std::int64_t{data.y} + data.height, std::int64_t{display.y} + display.height);
  for (std::int64_t y = top; y < bottom && left < right; ++y) {
    const std::size_t from = static_cast<std::size_t>((y - data.y) * data.width + left - data.x) * channels;
    const std::size_t to =
        static_cast<std::size_t>((y - display.y) * display.width + left - display.x) * channels;
    std::copy_n(pixels.begin() + static_cast<std::ptrdiff_t>(from),
                static_cast<std::size_t>(right - left) * channels,
                result.begin() + static_cast<std::ptrdiff_t>(to));
  }
  return result;
}

void decode_srgb(const Header& header, std::vector<float>& pixels) {
  std::array<float, 256> table;
  for (std::size_t i = 0; i < table.size(); ++i) table[i] = srgb_decode(static_cast<float>(i) / 255.0F);
  const bool is_byte = header.is_byte;
  const std::size_t channels = header.channels.size();
  const std::size_t alpha = header.alpha < 0 ? channels : static_cast<std::size_t>(header.alpha);
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

void multiply_by_alpha(const Header& header, std::vector<float>& pixels) {
  const std::size_t channels = header.channels.size();
  const std::size_t alpha = static_cast<std::size_t>(header.alpha);
  for (std::size_t i = 0; i < pixels.size(); i += channels) {
    for (std::size_t c = 0; c < channels; ++c) {
      if (c != alpha) pixels[i + c] *= pixels[i + alpha];
    }
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

std::unique_ptr<Reader> open(const std::string& name, FileKind kind,
                             std::shared_ptr<const image_files::Bytes> bytes, const ImageChoice& choice) {
  if (kind == FileKind::exr) return image_files::open_exr(name, std::move(bytes), choice);
  if (!choice.part.empty() || !choice.layer.empty()) {
    throw FileError(name, "has no parts and layers to choose from, expected an EXR file");
  }
  if (kind == FileKind::hdr) return image_files::open_hdr(name, *bytes);
  if (kind == FileKind::webp) return image_files::open_webp(name, *bytes);
  image_files::Guard guard = image_files::guard_of(name, kind, *bytes);
  return image_files::openimageio().open(name, kind, std::move(bytes), std::move(guard));
}

// Opens an image by its content; `name` stands for its path.
std::unique_ptr<Reader> open(const std::string& name, std::shared_ptr<const image_files::Bytes> bytes,
                             const ImageLimits& limits, const ImageChoice& choice) {
  const std::uint64_t size = bytes->size();
  const FileKind kind = image_files::kind_of(name, *bytes);
  std::unique_ptr<Reader> reader = open(name, kind, std::move(bytes), choice);
  image_files::check_limits(name, reader->header(), limits);
  image_files::check_expansion(name, reader->header(), size);
  return reader;
}

// TIFF 6.0, Orientation: 2 is mirrored left to right, 3 turned by 180 degrees, 4 mirrored top to bottom; 5 to
// 8 are those with rows and columns exchanged first.
Image upright(Image image, int orientation) {
  if (orientation == 1) return image;
  const bool is_exchanged = orientation >= 5;
  const bool mirrors_x = orientation == 2 || orientation == 3 || orientation == 6 || orientation == 7;
  const bool mirrors_y = orientation == 3 || orientation == 4 || orientation == 7 || orientation == 8;
  Image result(is_exchanged ? image.height : image.width, is_exchanged ? image.width : image.height,
               image.channels);
  for (int y = 0; y < result.height; ++y) {
    for (int x = 0; x < result.width; ++x) {
      const int across = mirrors_x ? result.width - 1 - x : x;
      const int down = mirrors_y ? result.height - 1 - y : y;
      const float* from = is_exchanged ? image.at(down, across) : image.at(across, down);
      std::copy_n(from, image.channels.size(), result.at(x, y));
    }
  }
  return result;
}

Image read(Reader& reader, const DecodeOptions& options) {
  const Header& header = reader.header();
  Image image(header.data.width, header.data.height, header.channels);
  reader.read(image.pixels);
  if (image_files::is_srgb(header, options.transfer)) decode_srgb(header, image.pixels);
  if (options.alpha == AlphaUse::multiply && header.alpha >= 0 && header.unassociated_alpha) {
    multiply_by_alpha(header, image.pixels);
  }
  if (header.data != header.display) {
    image.pixels = display_window(header, image.pixels);
    image.width = header.display.width;
    image.height = header.display.height;
  }
  image = upright(std::move(image), header.orientation);
  if (options.alpha == AlphaUse::drop && header.alpha >= 0 && header.channel_count() > 1) {
    return without_alpha(std::move(image), header.alpha);
  }
  if (options.alpha == AlphaUse::only && header.alpha >= 0) return only_alpha(std::move(image), header.alpha);
  return image;
}

// Whatever else goes wrong in `work` is about the file, too; `problem` says what.
template <typename Work>
auto file_errors(const std::string& name, const char* problem, const Work& work) {
  try {
    return work();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw FileError(name, "does not fit into memory");
  } catch (const std::exception& e) {
    throw FileError(name, std::string(problem) + ": " + image_files::one_line(e.what()));
  }
}

constexpr const char* kDamaged = "is damaged or truncated";

PixelFormat storage_format(const std::string& path, FileKind kind, PixelFormat format) {
  const auto& formats = image_files::row_of(kind).formats;
  if (format == PixelFormat::automatic) return formats.front();
  std::vector<std::string> expected;
  for (const PixelFormat own : formats) {
    if (own == format) return format;
    if (own != PixelFormat::automatic) expected.emplace_back(name_of(own));
  }
  throw FileError(path, "its format cannot store these pixels, expected " + listed(expected));
}

void check_channels(const std::string& path, FileKind kind, std::span<const std::string> channels) {
  const image_files::ImageKind& row = image_files::row_of(kind);
  if (row.holds == nullptr || row.holds(channels.size(), channels.back() == "A")) return;
  throw FileError(path, std::string(row.name) + " holds " + std::string(row.held) + ", the image has " +
                            std::to_string(channels.size()) + " channels, the last named " + channels.back());
}

}  // namespace

std::vector<std::string> default_channels(int count) {
  switch (count) {
    case 1: return {"Y"};
    case 2: return {"Y", "A"};
    case 3: return {"R", "G", "B"};
    case 4: return {"R", "G", "B", "A"};
    default: throw InvalidArgument("channels", std::to_string(count), "1 to 4, or the names of the channels");
  }
}

Image load_image(const std::string& path, const ImageLimits& limits, const ImageChoice& choice) {
  return file_errors(path, kDamaged, [&] {
    return read(*open(path, image_files::open_bytes(path), limits, choice),
                {.limits = limits, .choice = choice});
  });
}

ImageSize read_image_size(const std::string& path, const ImageLimits& limits) {
  return file_errors(path, kDamaged, [&] {
    std::shared_ptr<const image_files::Bytes> bytes = image_files::open_bytes(path);
    const FileKind kind = image_files::kind_of(path, *bytes);
    const std::unique_ptr<Reader> reader = open(path, std::move(bytes), limits, {});
    const Header& header = reader->header();
    const bool is_exchanged = header.orientation >= 5;
    return ImageSize{is_exchanged ? header.display.height : header.display.width,
                     is_exchanged ? header.display.width : header.display.height, header.channel_count(),
                     header.orientation == 1 && image_files::row_of(kind).is_tileable};
  });
}

Image decode_image(const std::string& name, std::span<const unsigned char> bytes,
                   const DecodeOptions& options) {
  return file_errors(name, kDamaged, [&] {
    return read(*open(name, image_files::bytes_in(bytes), options.limits, options.choice), options);
  });
}

bool has_image_extension(const std::string& path) { return image_files::known_extension(path).has_value(); }

void check_image_path(const std::string& path, PixelFormat format) {
  if (path.empty()) throw FileError("''", "an output path may not be empty");
  storage_format(path, image_files::kind_from_extension(path), format);
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
  const FileKind kind = image_files::kind_from_extension(path);
  check_channels(path, kind, channels);

  const PixelFormat stored = storage_format(path, kind, format);
  AtomicFile file(path);
  const SaveReport report = file_errors(path, "cannot be written", [&]() -> SaveReport {
    if (kind != FileKind::exr) {
      return image_files::openimageio().save(
          {path, file.temporary(), kind, stored, width, height, channels, pixels});
    }
    const std::uint64_t clamped = image_files::write_exr(path, file.temporary(), width, height, channels,
                                                         pixels, stored == PixelFormat::half);
    return {.clamped_to_half = clamped};
  });
  file.commit();
  return report;
}

}  // namespace mirrorbake
