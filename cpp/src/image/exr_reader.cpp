#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfTileDescription.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <limits>
#include <map>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <utility>

#include "exr_file.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake::image_files {
namespace {

class MemoryStream : public Imf::IStream {
 public:
  MemoryStream(const std::string& name, std::span<const unsigned char> bytes)
      : Imf::IStream(name.c_str()), bytes_(bytes) {}

  bool isMemoryMapped() const override { return true; }

  char* readMemoryMapped(int count) override {
    // OpenEXR only reads what it gets here.
    return const_cast<char*>(reinterpret_cast<const char*>(take(count)));
  }

  bool read(char* to, int count) override {
    std::memcpy(to, take(count), static_cast<std::size_t>(count));
    return position_ < bytes_.size();
  }

  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  const unsigned char* take(int count) {
    if (count < 0 || position_ > bytes_.size() ||
        static_cast<std::size_t>(count) > bytes_.size() - position_) {
      throw std::runtime_error("early end of file");
    }
    const unsigned char* data = bytes_.data() + position_;
    position_ += static_cast<std::uint64_t>(count);
    return data;
  }

  std::span<const unsigned char> bytes_;
  std::uint64_t position_ = 0;
};

// Without threads of its own: OpenEXR's are one pool for the whole program, which is not ours to resize.
constexpr int kNoThreads = 0;

struct OpenFile {
  std::unique_ptr<MemoryStream> stream;
  std::unique_ptr<Imf::MultiPartInputFile> file;
};

OpenFile open(const std::string& name, std::optional<std::span<const unsigned char>> memory) {
  OpenFile result;
  if (memory) {
    result.stream = std::make_unique<MemoryStream>(name, *memory);
    result.file = std::make_unique<Imf::MultiPartInputFile>(*result.stream, kNoThreads);
  } else {
    result.file = std::make_unique<Imf::MultiPartInputFile>(name.c_str(), kNoThreads);
  }
  return result;
}

bool equal_but_for_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](unsigned char c, unsigned char d) { return std::tolower(c) == std::tolower(d); });
}

std::pair<std::string_view, std::string_view> layer_and_suffix(std::string_view channel) {
  const std::size_t dot = channel.find_last_of('.');
  if (dot == std::string_view::npos) return {"", channel};
  return {channel.substr(0, dot + 1), channel.substr(dot + 1)};
}

// Files store their channels in the order of the alphabet. As in OpenImageIO, colours come first within a layer and alpha
// after them; an X with a Y or a Z makes coordinates.
std::vector<std::string> in_usual_order(const std::vector<std::string>& names) {
  constexpr std::array<std::string_view, 20> kUsual = {"R",    "Red",  "G",  "Green", "B",     "Blue", "Y",
                                                       "real", "imag", "A",  "Alpha", "AR",    "RA",   "AG",
                                                       "GA",   "AB",   "BA", "Z",     "Depth", "Zback"};
  constexpr std::array<std::string_view, 21> kCoordinates = {
      "R", "Red",   "G",  "Green", "B",  "Blue", "X",  "Y",  "Z",     "real", "imag",
      "A", "Alpha", "AR", "RA",    "AG", "GA",   "AB", "BA", "Depth", "Zback"};
  struct Layer {
    bool has_x = false;
    bool has_y_or_z = false;
  };
  std::map<std::string_view, Layer> layers;
  for (const std::string& name : names) {
    const auto [layer, suffix] = layer_and_suffix(name);
    if (equal_but_for_case(suffix, "X")) layers[layer].has_x = true;
    if (equal_but_for_case(suffix, "Y") || equal_but_for_case(suffix, "Z")) layers[layer].has_y_or_z = true;
  }
  std::vector<std::tuple<std::string_view, std::ptrdiff_t, std::string_view, std::size_t>> keys;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto [layer, suffix] = layer_and_suffix(names[i]);
    const bool coordinates = layers[layer].has_x && layers[layer].has_y_or_z;
    const std::span<const std::string_view> order =
        coordinates ? std::span<const std::string_view>(kCoordinates) : kUsual;
    const auto rank =
        std::find_if(order.begin(), order.end(),
                     [s = suffix](std::string_view known) { return equal_but_for_case(s, known); }) -
        order.begin();
    keys.emplace_back(layer, static_cast<std::size_t>(rank) < order.size() ? rank : 10000, suffix, i);
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::string> sorted;
  for (const auto& key : keys) sorted.push_back(names[std::get<3>(key)]);
  return sorted;
}

// Bytes of pixels from one byte of the file: deflate gives at most 1032, and 4 for 3 in PXR24; PIZ a run of 256 words for
// ten bits; DWA 8 × 8 floats for two deflated bytes of their mean and two that end the block. 0 for what comes after them.
std::uint64_t most_expansion(Imf::Compression compression) {
  switch (compression) {
    case Imf::NO_COMPRESSION:
    case Imf::RLE_COMPRESSION:
    case Imf::ZIPS_COMPRESSION:
    case Imf::ZIP_COMPRESSION:
    case Imf::PIZ_COMPRESSION:
    case Imf::PXR24_COMPRESSION:
    case Imf::B44_COMPRESSION:
    case Imf::B44A_COMPRESSION: return 1400;
    case Imf::DWAA_COMPRESSION:
    case Imf::DWAB_COMPRESSION: return std::uint64_t{1} << 17;
    default: return 0;
  }
}

// Rows that one task reads: whole blocks, lest they be unpacked twice.
std::size_t rows_per_task(const Imf::Header& header) {
  constexpr std::size_t kRows = 64;
  if (header.hasTileDescription()) {
    const std::size_t tile = std::max(1u, header.tileDescription().ySize);
    return tile * ((kRows + tile - 1) / tile);
  }
  return header.compression() < Imf::DWAB_COMPRESSION ? kRows : 256;
}

// Sides that do not fit become negative, which no limits accept.
Window window_of(const Imath::Box2i& box) {
  const auto side = [](int first, int last) {
    const std::int64_t size = std::int64_t{last} - first + 1;
    return size > std::numeric_limits<int>::max() ? -1 : static_cast<int>(size);
  };
  return {box.min.x, box.min.y, side(box.min.x, box.max.x), side(box.min.y, box.max.y)};
}

class ExrReader : public Reader {
 public:
  ExrReader(const std::string& name, std::optional<std::span<const unsigned char>> memory)
      : name_(name), memory_(memory) {
    const OpenFile opened = open(name_, memory_);
    const Imf::Header& source = opened.file->header(0);
    if (source.hasType() && Imf::isDeepData(source.type())) {
      throw FileError(name_, "holds deep samples, expected flat pixels");
    }
    header_.data = window_of(source.dataWindow());
    header_.display = window_of(source.displayWindow());
    header_.says_linear = true;
    header_.expansion = most_expansion(source.compression());
    std::vector<std::string> channels;
    for (auto c = source.channels().begin(); c != source.channels().end(); ++c) {
      if (c.channel().xSampling != 1 || c.channel().ySampling != 1) {
        throw FileError(name_, std::string("its channel ") + c.name() +
                                   " is subsampled, expected a value for every pixel");
      }
      channels.emplace_back(c.name());
      header_.pixel_bytes += c.channel().type == Imf::HALF ? 2 : 4;
    }
    header_.channels = in_usual_order(channels);
    const auto alpha =
        std::find_if(header_.channels.begin(), header_.channels.end(), [](const auto& channel) {
          const std::string_view suffix = layer_and_suffix(channel).second;
          return equal_but_for_case(suffix, "A") || equal_but_for_case(suffix, "Alpha");
        });
    if (alpha != header_.channels.end()) header_.alpha = static_cast<int>(alpha - header_.channels.begin());
    if (source.hasTileDescription()) {
      const Imf::TileDescription& tile = source.tileDescription();
      const auto side = [](unsigned int size) { return static_cast<int>(std::min(size, 0x7fffffffU)); };
      header_.tile = {0, 0, side(tile.xSize), side(tile.ySize)};
    }
    rows_per_task_ = rows_per_task(source);
  }

  const Header& header() const override { return header_; }

  void read(std::span<float> pixels) override {
    const Window& window = header_.data;
    const std::size_t pixel_bytes = header_.channels.size() * sizeof(float);
    Imf::FrameBuffer frame;
    for (std::size_t c = 0; c < header_.channels.size(); ++c) {
      frame.insert(
          header_.channels[c],
          Imf::Slice::Make(Imf::FLOAT, pixels.data() + c, Imath::V2i(window.x, window.y), window.width,
                           window.height, pixel_bytes, pixel_bytes * static_cast<std::size_t>(window.width)));
    }
    parallel_for(static_cast<std::size_t>(window.height), rows_per_task_,
                 [&](std::size_t begin, std::size_t end) {
                   // One that is open reads for one thread at a time.
                   const OpenFile opened = open(name_, memory_);
                   Imf::InputPart part(*opened.file, 0);
                   if (window_of(part.header().dataWindow()) != window)
                     throw FileError(name_, "changed while it was read");
                   part.setFrameBuffer(frame);
                   part.readPixels(window.y + static_cast<int>(begin), window.y + static_cast<int>(end) - 1);
                 });
  }

 private:
  std::string name_;
  std::optional<std::span<const unsigned char>> memory_;
  Header header_;
  std::size_t rows_per_task_ = 1;
};

}  // namespace

std::unique_ptr<Reader> open_exr(const std::string& name,
                                 std::optional<std::span<const unsigned char>> memory) {
  return std::make_unique<ExrReader>(name, memory);
}

}  // namespace mirrorbake::image_files
