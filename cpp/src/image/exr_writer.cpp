#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "exr_file.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/image/half.hpp"

namespace mirrorbake::image_files {
namespace {

constexpr int kBlockRows = 16;  // of ZIP_COMPRESSION

// Rows that are converted and packed at once: enough blocks for every thread, in little memory.
int rows_at_once(int threads) { return kBlockRows * std::max(4, 2 * threads); }

}  // namespace

std::uint64_t write_exr(const std::string& path, const std::string& file, int width, int height,
                        std::span<const std::string> channels, std::span<const float> pixels, bool as_half) {
  for (const std::string& channel : channels) {
    if (channel.empty() || channel.size() > 255 || channel.find('\0') != std::string::npos) {
      throw FileError(path, "cannot hold a channel named '" + channel + "', expected 1 to 255 characters");
    }
  }
  const std::size_t row_values = static_cast<std::size_t>(width) * channels.size();
  const std::size_t value = as_half ? sizeof(std::uint16_t) : sizeof(float);
  if (kBlockRows * row_values * value > std::numeric_limits<std::int32_t>::max()) {
    throw FileError(path, "cannot hold " + size_text(width, height, static_cast<int>(channels.size())) +
                              ": 16 rows may have 2 GiB");
  }
  const Imf::PixelType type = as_half ? Imf::HALF : Imf::FLOAT;
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  header.insert("Software", Imf::StringAttribute("mirrorbake"));
  for (const std::string& channel : channels) header.channels().insert(channel, Imf::Channel(type));
  const int threads = std::min(thread_count(), Imf::globalThreadCount());
  std::uint64_t clamped = 0;
  std::ofstream stream(file, std::ios::binary);
  {
    Imf::StdOFStream named(stream, file.c_str());
    Imf::OutputFile out(named, header, threads);
    std::vector<std::uint16_t> halves;
    for (int y = 0; y < height; y += rows_at_once(threads)) {
      const int rows = std::min(rows_at_once(threads), height - y);
      const std::span<const float> part = pixels.subspan(static_cast<std::size_t>(y) * row_values,
                                                         static_cast<std::size_t>(rows) * row_values);
      if (as_half) {
        halves.clear();
        for (const float v : part) halves.push_back(half_from_float(clamp_to_half(v, clamped)));
      }
      Imf::FrameBuffer frame;
      for (std::size_t c = 0; c < channels.size(); ++c) {
        const void* const first = as_half ? static_cast<const void*>(halves.data() + c) : part.data() + c;
        frame.insert(channels[c], Imf::Slice::Make(type, first, Imath::V2i(0, y), width, rows,
                                                   value * channels.size(), value * row_values));
      }
      out.setFrameBuffer(frame);
      out.writePixels(rows);
    }
  }
  // OpenEXR says nothing of what fails when it is done: the table of its blocks and what is still in a
  // buffer.
  stream.close();
  if (!stream) throw FileError(path, "cannot be written");
  return clamped;
}

}  // namespace mirrorbake::image_files

namespace mirrorbake {

void set_exr_threads(int threads) {
  check_range("threads", threads, 0, 1024);
  Imf::setGlobalThreadCount(threads);
}

}  // namespace mirrorbake
