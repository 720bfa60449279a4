#include "files.hpp"

#include <OpenImageIO/filesystem.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <utility>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/image/color.hpp"
#include "mirrorbake/image/half.hpp"

namespace mirrorbake::image_files {
namespace {

// Bytes of pixels from one byte of the file: deflate, in PNG and TIFF, gives at most 1032; JPEG 1024: six
// blocks of two bits at least for 16 x 16 pixels of 3 bytes, if its chroma is subsampled; LZW 2730; T.6 a row
// of 65536 white pixels for one bit. OpenEXR's DCT is not looked into.
std::uint64_t most_expansion(FileKind kind, bool is_fax) {
  if (kind == FileKind::exr) return 0;
  if (kind == FileKind::tiff) return is_fax ? 65536 : 2730;
  return 1100;
}

class FileReader : public Reader {
 public:
  FileReader(const std::string& name, FileKind kind, std::shared_ptr<const Bytes> bytes, Guard guard)
      : name_(name), input_(open_input(name, kind, std::move(bytes), std::move(guard), header_)) {}

  const Header& header() const override { return header_; }

  void read(std::span<float> pixels) override {
    input_->threads(thread_count());
    // The TIFF reader succeeds on a truncated file and only leaves a message.
    if (!input_->read_image(0, 0, 0, header_.channel_count(), OIIO::TypeDesc::FLOAT, pixels.data()) ||
        input_->has_error()) {
      throw FileError(name_, "is damaged or truncated: " + one_line(input_->geterror()));
    }
  }

 private:
  std::string name_;
  Header header_;
  OpenInput input_;
};

OIIO::TypeDesc storage_type(PixelFormat format) {
  switch (format) {
    case PixelFormat::half: return OIIO::TypeDesc::HALF;
    case PixelFormat::uint8: return OIIO::TypeDesc::UINT8;
    case PixelFormat::uint16: return OIIO::TypeDesc::UINT16;
    case PixelFormat::automatic:
    case PixelFormat::float32: break;
  }
  return OIIO::TypeDesc::FLOAT;
}

OIIO::ImageSpec specification(const SaveRequest& request) {
  OIIO::ImageSpec spec(request.width, request.height, static_cast<int>(request.channels.size()),
                       storage_type(request.format));
  spec.channelnames.assign(request.channels.begin(), request.channels.end());
  const auto alpha = std::find(request.channels.begin(), request.channels.end(), "A");
  spec.alpha_channel =
      alpha == request.channels.end() ? -1 : static_cast<int>(alpha - request.channels.begin());
  if (spec.format.is_floating_point()) {
    spec.attribute("oiio:ColorSpace", "Linear");
  } else {
    spec.attribute("oiio:ColorSpace", "sRGB");
    if (spec.alpha_channel >= 0) spec.attribute("oiio:UnassociatedAlpha", 1);
  }
  if (request.kind == FileKind::tiff) spec.attribute("compression", "zip");
  spec.attribute("Software", "mirrorbake");
  return spec;
}

// Rounds a colour to what RGBE holds, three mantissas of 8 bits and the largest one's exponent: the writer
// cuts off what is beyond, which darkens images by half a percent.
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
    for (float& v : values) v = clamp_to_half(v, report.clamped_to_half);
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
  if (spec.format.is_floating_point()) return;
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

std::size_t GuardedBytes::read(void* to, std::size_t count) {
  const std::size_t done = pread(to, count, m_pos);
  m_pos += static_cast<std::int64_t>(done);
  return done;
}

std::size_t GuardedBytes::pread(void* to, std::size_t count, std::int64_t offset) {
  if (offset < 0) return 0;
  return read_patched(*bytes_, patches_, static_cast<std::uint64_t>(offset),
                      {static_cast<unsigned char*>(to), count});
}

OpenInput open_input(const std::string& path, FileKind kind, std::shared_ptr<const Bytes> bytes, Guard guard,
                     Header& header) {
  OpenInput input;
  if (kind == FileKind::jpeg) {
    input.memory.resize(bytes->size());
    input.memory.resize(read_patched(*bytes, guard.patches, 0, input.memory));
    input.bytes = std::make_unique<OIIO::Filesystem::IOMemReader>(input.memory.data(), input.memory.size());
  } else {
    input.bytes = std::make_unique<GuardedBytes>(path, std::move(bytes), std::move(guard.patches));
  }
  input.input = OIIO::ImageInput::create(row_of(kind).plugin);
  if (!input.input) throw FileError(path, "cannot be read: " + one_line(OIIO::geterror()));
  if (!input->set_ioproxy(input.bytes.get())) {
    throw FileError(path, "cannot be read: this OpenImageIO reads its format only from files that it opens");
  }
  // Unassociated alpha is multiplied in by us, in linear light, and not by the reader in encoded values.
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  OIIO::ImageSpec spec;
  if (!input->open(path, spec, config))
    throw FileError(path, "cannot be read: " + one_line(input->geterror()));
  if (spec.deep) throw FileError(path, "holds deep samples, expected flat pixels");
  if (spec.depth > 1) throw FileError(path, "is a volume, expected an image");
  header.data = {spec.x, spec.y, spec.width, spec.height};
  const bool has_display = spec.full_width > 0 && spec.full_height > 0;
  header.display =
      has_display ? Window{spec.full_x, spec.full_y, spec.full_width, spec.full_height} : header.data;
  header.channels = spec.channelnames;
  header.channels.resize(static_cast<std::size_t>(std::max(spec.nchannels, 0)));
  header.alpha = spec.alpha_channel;
  header.unassociated_alpha = spec.get_int_attribute("oiio:UnassociatedAlpha") != 0;
  header.is_integer = !spec.format.is_floating_point();
  header.is_byte = spec.format == OIIO::TypeDesc::UINT8;
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  header.says_linear =
      space == "Linear" || space == "linear" || space == "scene_linear" || space.starts_with("lin_");
  header.pixel_bits = guard.pixel_bits > 0 ? guard.pixel_bits : 8 * spec.pixel_bytes(true);
  header.orientation = guard.orientation;
  header.expansion = most_expansion(kind, guard.is_fax);
  header.expands_to_display = true;
  return input;
}

OpenInput open_checked(const std::string& path, const ImageLimits& limits, Header& header) {
  std::shared_ptr<const Bytes> bytes = open_bytes(path);
  const std::uint64_t size = bytes->size();
  const FileKind kind = kind_of(path, *bytes);
  Guard guard = guard_of(path, kind, *bytes);
  OpenInput input = open_input(path, kind, std::move(bytes), std::move(guard), header);
  check_limits(path, header, limits);
  check_expansion(path, header, size);
  return input;
}

std::unique_ptr<Reader> open_file(const std::string& name, FileKind kind, std::shared_ptr<const Bytes> bytes,
                                  Guard guard) {
  return std::make_unique<FileReader>(name, kind, std::move(bytes), std::move(guard));
}

SaveReport save_file(const SaveRequest& request) {
  const auto fail = [&](const std::string& reason) {
    throw FileError(request.path, "cannot be written: " + one_line(reason));
  };
  const OIIO::ImageSpec spec = specification(request);
  // The proxy outlives its user, which may still write to it when it is closed by an exception.
  OIIO::Filesystem::IOVecOutput memory;
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(row_of(request.kind).plugin);
  if (!output) fail(OIIO::geterror());
  output->threads(thread_count());
  // The PNG writer does not notice a full disk, and the JPEG writer ends the program: these get none to write
  // to.
  const bool in_memory = request.kind == FileKind::png || request.kind == FileKind::jpeg;
  if (in_memory && !output->set_ioproxy(&memory)) fail("not to memory");
  if (!output->open(request.file, spec)) fail(output->geterror());
  SaveReport report;
  constexpr int kRows = 64;
  const std::size_t row_values = static_cast<std::size_t>(request.width) * request.channels.size();
  std::vector<float> rows;
  for (int y = 0; y < request.height; y += kRows) {
    const int end = std::min(request.height, y + kRows);
    const std::span<const float> values = request.pixels.subspan(
        static_cast<std::size_t>(y) * row_values, static_cast<std::size_t>(end - y) * row_values);
    rows.assign(values.begin(), values.end());
    encode(spec, request.kind, rows, report);
    if (!output->write_scanlines(y, end, 0, OIIO::TypeDesc::FLOAT, rows.data())) fail(output->geterror());
  }
  if (!output->close()) fail(output->geterror());
  if (in_memory) {
    std::ofstream out(request.file, std::ios::binary);
    out.write(reinterpret_cast<const char*>(memory.buffer().data()),
              static_cast<std::streamsize>(memory.buffer().size()));
    out.close();
    if (!out) throw FileError(request.path, "cannot be written");
  }
  return report;
}

}  // namespace mirrorbake::image_files
