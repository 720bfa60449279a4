#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledOutputFile.h>

#include <algorithm>
#include <exception>
#include <fstream>
#include <string>
#include <utility>

#include "exr_file.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/atomic_file.hpp"
#include "mirrorbake/image/half.hpp"

namespace mirrorbake {
namespace {

int half_of(int side) { return std::max(side / 2, 1); }

// Means of two by two pixels, or of two where one side is a single pixel; an odd last one is left out.
Image halved(const Image& image) {
  Image result(half_of(image.width), half_of(image.height), image.channels);
  const int across = image.width > 1 ? 2 : 1;
  const int down = image.height > 1 ? 2 : 1;
  for (int y = 0; y < result.height; ++y) {
    for (int x = 0; x < result.width; ++x) {
      for (std::size_t c = 0; c < image.channels.size(); ++c) {
        float sum = 0.0F;
        for (int j = 0; j < down; ++j) {
          for (int i = 0; i < across; ++i) sum += image.at(across * x + i, down * y + j)[c];
        }
        result.at(x, y)[c] = sum / static_cast<float>(across * down);
      }
    }
  }
  return result;
}

void check_levels(const std::vector<Image>& levels) {
  if (levels.empty()) throw InvalidArgument("levels", "none", "one image at least");
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const Image& image = levels[l];
    const int width = l == 0 ? std::max(image.width, 1) : half_of(levels[l - 1].width);
    const int height = l == 0 ? std::max(image.height, 1) : half_of(levels[l - 1].height);
    const std::size_t values =
        static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * levels.front().channels.size();
    if (image.width == width && image.height == height && image.channels == levels.front().channels &&
        image.pixels.size() == values && values > 0) {
      continue;
    }
    throw InvalidArgument(
        "levels[" + std::to_string(l) + "]",
        std::to_string(image.width) + "x" + std::to_string(image.height) + " pixels, " +
            std::to_string(image.channels.size()) + " channels",
        std::to_string(width) + "x" + std::to_string(height) + " and the channels of the first");
  }
}

}  // namespace

void check_levels_path(const std::string& path, PixelFormat format) {
  check_image_path(path, format);
  if (image_files::kind_from_extension(path) != image_files::FileKind::exr) {
    throw FileError(path, "its format holds no mip levels, expected .exr");
  }
}

SaveReport save_levels(const std::string& path, std::vector<Image> levels, PixelFormat format) {
  check_levels_path(path, format);
  check_levels(levels);
  while (levels.back().width > 1 || levels.back().height > 1) levels.push_back(halved(levels.back()));
  AtomicFile file(path);
  SaveReport report;
  try {
    report.clamped_to_half =
        image_files::write_exr_levels(path, file.temporary(), levels, format != PixelFormat::float32);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw FileError(path, "cannot be written: " + image_files::one_line(error.what()));
  }
  file.commit();
  return report;
}

namespace image_files {

std::uint64_t write_exr_levels(const std::string& path, const std::string& file,
                               std::span<const Image> levels, bool as_half) {
  constexpr unsigned kTile = 64;
  const Image& finest = levels.front();
  const std::size_t channels = finest.channels.size();
  const Imf::PixelType type = as_half ? Imf::HALF : Imf::FLOAT;
  const std::size_t value = as_half ? sizeof(std::uint16_t) : sizeof(float);
  Imf::Header header(finest.width, finest.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  header.setTileDescription({kTile, kTile, Imf::MIPMAP_LEVELS, Imf::ROUND_DOWN});
  header.insert("Software", Imf::StringAttribute("mirrorbake"));
  for (const std::string& channel : finest.channels) header.channels().insert(channel, Imf::Channel(type));
  std::uint64_t clamped = 0;
  std::ofstream stream(file, std::ios::binary);
  {
    Imf::StdOFStream named(stream, file.c_str());
    Imf::TiledOutputFile out(named, header);
    for (std::size_t l = 0; l < levels.size(); ++l) {
      const Image& image = levels[l];
      std::vector<std::uint16_t> halves;
      for (std::size_t i = 0; as_half && i < image.pixels.size(); ++i) {
        halves.push_back(half_from_float(clamp_to_half(image.pixels[i], clamped)));
      }
      Imf::FrameBuffer frame;
      for (std::size_t c = 0; c < channels; ++c) {
        const void* const first =
            as_half ? static_cast<const void*>(halves.data() + c) : image.pixels.data() + c;
        frame.insert(
            finest.channels[c],
            Imf::Slice::Make(type, first, Imath::V2i(0, 0), image.width, image.height, value * channels,
                             value * channels * static_cast<std::size_t>(image.width)));
      }
      out.setFrameBuffer(frame);
      const int level = static_cast<int>(l);
      out.writeTiles(0, out.numXTiles(level) - 1, 0, out.numYTiles(level) - 1, level);
    }
  }
  stream.close();
  if (!stream) throw FileError(path, "cannot be written");
  return clamped;
}

}  // namespace image_files
}  // namespace mirrorbake
