#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVersion.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <limits>
#include <vector>

#include "exr_file.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/image/half.hpp"

// OpenEXR makes the header. The blocks are packed here, on the threads of parallel_for: OpenEXR's own are one pool for the
// whole program, which is not ours to resize and does not survive a fork. A file is: magic number and version; the header;
// for every block its place in the file; the blocks, each its first row, its size and its bytes (OpenEXR File Layout, in
// OpenEXR's documentation).
namespace mirrorbake::image_files {
namespace {

static_assert(std::endian::native == std::endian::little, "EXR is little-endian and so is this code");

constexpr int kBlockRows = 16;        // of ZIP_COMPRESSION
constexpr int kCompressionLevel = 4;  // OpenEXR's own default
constexpr std::size_t kBlocksAtOnce = 64;
constexpr std::size_t kLongestShortName = 31;
constexpr float kLargestHalf = 65504.0F;

class StringStream : public Imf::OStream {
 public:
  StringStream() : Imf::OStream("header") {}
  void write(const char* from, int count) override { text_.append(from, static_cast<std::size_t>(count)); }
  std::uint64_t tellp() override { return text_.size(); }
  void seekp(std::uint64_t) override {}  // nothing in a header is written twice
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

template <typename T>
void append(std::string& to, T value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

std::string header_bytes(int width, int height, std::span<const std::string> channels, bool as_half) {
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  header.insert("Software", Imf::StringAttribute("mirrorbake"));
  int version = Imf::EXR_VERSION;
  for (const std::string& channel : channels) {
    header.channels().insert(channel, Imf::Channel(as_half ? Imf::HALF : Imf::FLOAT));
    if (channel.size() > kLongestShortName) version |= Imf::LONG_NAMES_FLAG;
  }
  header.sanityCheck();
  StringStream stream;
  header.writeTo(stream);
  std::string bytes;
  append(bytes, Imf::MAGIC);
  append(bytes, version);
  return bytes + stream.text();
}

// A row lists all values of a channel, then those of the next, in the order of their names.
struct Source {
  int width;
  int height;
  std::size_t stride;              // channels of a pixel
  std::vector<std::size_t> order;  // of the channels in the file
  std::span<const float> pixels;
  bool as_half;
};

std::uint64_t gather(const Source& source, int begin, int end, std::vector<unsigned char>& raw) {
  const std::size_t width = static_cast<std::size_t>(source.width);
  raw.resize(static_cast<std::size_t>(end - begin) * width * source.stride *
             (source.as_half ? sizeof(std::uint16_t) : sizeof(float)));
  std::uint64_t clamped = 0;
  unsigned char* to = raw.data();
  for (int y = begin; y < end; ++y) {
    for (const std::size_t channel : source.order) {
      const float* from =
          source.pixels.data() + static_cast<std::size_t>(y) * width * source.stride + channel;
      for (std::size_t x = 0; x < width; ++x, from += source.stride) {
        if (source.as_half) {
          const bool is_large = std::abs(*from) > kLargestHalf;
          const std::uint16_t half = half_from_float(is_large ? std::copysign(kLargestHalf, *from) : *from);
          clamped += is_large ? 1 : 0;
          std::memcpy(to, &half, sizeof(half));
          to += sizeof(half);
        } else {
          std::memcpy(to, from, sizeof(float));
          to += sizeof(float);
        }
      }
    }
  }
  return clamped;
}

// The even bytes before the odd ones, all as differences to the byte before them, deflated; or the bytes as they are if that
// is no less.
void pack(const std::vector<unsigned char>& raw, std::vector<unsigned char>& split,
          std::vector<unsigned char>& packed) {
  const std::size_t size = raw.size();
  const std::size_t half = (size + 1) / 2;
  packed.resize(size);
  for (std::size_t i = 0; i < size / 2; ++i) {
    packed[i] = raw[2 * i];
    packed[half + i] = raw[2 * i + 1];
  }
  if (size % 2 != 0) packed[half - 1] = raw[size - 1];
  split.resize(size);
  split[0] = packed[0];
  for (std::size_t i = 1; i < size; ++i) {
    split[i] = static_cast<unsigned char>(packed[i] - packed[i - 1] + 128);
  }
  uLongf packed_size = size;
  if (compress2(packed.data(), &packed_size, split.data(), size, kCompressionLevel) == Z_OK &&
      packed_size < size) {
    packed.resize(packed_size);
  } else {
    packed = raw;
  }
}

struct Block {
  std::vector<unsigned char> bytes;
  std::uint64_t clamped = 0;
};

}  // namespace

std::uint64_t write_exr(const std::string& path, const std::string& file, int width, int height,
                        std::span<const std::string> channels, std::span<const float> pixels, bool as_half) {
  for (const std::string& channel : channels) {
    if (channel.empty() || channel.size() > 255 || channel.find('\0') != std::string::npos) {
      throw FileError(path, "cannot hold a channel named '" + channel + "', expected 1 to 255 characters");
    }
  }
  const std::uint64_t block_bytes = std::uint64_t{kBlockRows} * static_cast<std::uint64_t>(width) *
                                    channels.size() * (as_half ? sizeof(std::uint16_t) : sizeof(float));
  if (block_bytes > std::numeric_limits<std::int32_t>::max()) {
    throw FileError(path, "cannot hold " + size_text(width, height, static_cast<int>(channels.size())) +
                              ": 16 rows may have 2 GiB");
  }
  Source source{width, height, channels.size(), {}, pixels, as_half};
  for (std::size_t c = 0; c < channels.size(); ++c) source.order.push_back(c);
  std::sort(source.order.begin(), source.order.end(),
            [&](std::size_t a, std::size_t b) { return channels[a] < channels[b]; });

  std::ofstream out(file, std::ios::binary);
  std::string head = header_bytes(width, height, channels, as_half);
  const std::size_t blocks = (static_cast<std::size_t>(height) + kBlockRows - 1) / kBlockRows;
  std::vector<std::uint64_t> places(blocks);
  std::uint64_t place = head.size() + blocks * sizeof(std::uint64_t);
  const auto write = [&out](const auto& values) {
    out.write(reinterpret_cast<const char*>(values.data()),
              static_cast<std::streamsize>(values.size() * sizeof(values[0])));
  };
  write(head);
  write(places);

  std::uint64_t clamped = 0;
  std::vector<Block> packed(std::min(blocks, kBlocksAtOnce));
  for (std::size_t first = 0; first < blocks && out; first += kBlocksAtOnce) {
    const std::size_t count = std::min(kBlocksAtOnce, blocks - first);
    parallel_for(count, 1, [&](std::size_t begin, std::size_t end) {
      std::vector<unsigned char> raw;
      std::vector<unsigned char> split;
      for (std::size_t i = begin; i < end; ++i) {
        const int row = static_cast<int>(first + i) * kBlockRows;
        packed[i].clamped = gather(source, row, std::min(height, row + kBlockRows), raw);
        pack(raw, split, packed[i].bytes);
      }
    });
    for (std::size_t i = 0; i < count; ++i) {
      std::string start;
      append(start, static_cast<std::int32_t>((first + i) * kBlockRows));
      append(start, static_cast<std::int32_t>(packed[i].bytes.size()));
      write(start);
      write(packed[i].bytes);
      places[first + i] = place;
      place += start.size() + packed[i].bytes.size();
      clamped += packed[i].clamped;
    }
  }
  out.seekp(static_cast<std::streamoff>(head.size()));
  write(places);
  out.close();
  if (!out) throw FileError(path, "cannot be written");
  return clamped;
}

}  // namespace mirrorbake::image_files
