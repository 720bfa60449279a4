#include <OpenImageIO/imagecache.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/texture.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <string>
#include <vector>

#include "files.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/image/color.hpp"

namespace mirrorbake::image_files {
namespace {

constexpr float kDefaultCacheMebibytes = 1024.0F;

OIIO::TypeDesc stored_type(const OIIO::ImageSpec& source) {
  return source.format.size() == 1 ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT;
}

int colour_channels(const OIIO::ImageSpec& source) {
  return source.nchannels - (source.alpha_channel >= 0 && source.nchannels > 1 ? 1 : 0);
}

// A file as the texture system sees it: linear colours without alpha. Names are "number:transfer:path", the
// number because a path may be opened again when its file has changed.
class LinearInput : public OIIO::ImageInput {
 public:
  static OIIO::ImageInput* create() { return new LinearInput; }

  const char* format_name() const override { return "mirrorbake"; }

  bool open(const std::string& name, OIIO::ImageSpec& spec) override {
    const std::size_t transfer = name.find(':') + 1;
    const std::size_t path = name.find(':', transfer) + 1;
    try {
      Header header;
      inner_ = std::make_unique<OpenInput>(open_checked(name.substr(path), ImageLimits{}, header));
      is_srgb_ = is_srgb(header, static_cast<Transfer>(name[transfer] - '0'));
      describe((*inner_)->spec());
    } catch (const std::exception& e) {
      errorfmt("{}", e.what());
      return false;
    }
    spec = m_spec;
    return true;
  }

  bool close() override {
    inner_.reset();
    return true;
  }

  int current_subimage() const override { return inner_ ? (*inner_)->current_subimage() : 0; }
  int current_miplevel() const override { return inner_ ? (*inner_)->current_miplevel() : 0; }

  bool seek_subimage(int subimage, int miplevel) override {
    if (!inner_ || subimage != 0 || !(*inner_)->seek_subimage(subimage, miplevel)) return false;
    describe((*inner_)->spec());
    return true;
  }

  bool read_native_scanline(int subimage, int miplevel, int y, int z, void* data) override {
    return read_native_scanlines(subimage, miplevel, y, y + 1, z, data);
  }

  bool read_native_scanlines(int subimage, int miplevel, int ybegin, int yend, int z, void* data) override {
    yend = std::min(yend, m_spec.height);
    std::vector<float> source(static_cast<std::size_t>(m_spec.width) *
                              static_cast<std::size_t>(std::max(0, yend - ybegin)) * source_channels_);
    if (!(*inner_)->read_scanlines(subimage, miplevel, ybegin, yend, z, 0, static_cast<int>(source_channels_),
                                   OIIO::TypeDesc::FLOAT, source.data())) {
      return fail();
    }
    convert(source, data);
    return true;
  }

  bool read_native_tile(int subimage, int miplevel, int x, int y, int z, void* data) override {
    if (!seek_subimage(subimage, miplevel)) return false;
    std::vector<float> source(static_cast<std::size_t>(m_spec.tile_pixels()) * source_channels_);
    if (!(*inner_)->read_tile(x, y, z, OIIO::TypeDesc::FLOAT, source.data())) return fail();
    convert(source, data);
    return true;
  }

 private:
  void describe(const OIIO::ImageSpec& source) {
    source_channels_ = static_cast<std::size_t>(source.nchannels);
    channels_ = static_cast<std::size_t>(colour_channels(source));
    m_spec = OIIO::ImageSpec(source.width, source.height, colour_channels(source), stored_type(source));
    m_spec.tile_width = source.tile_width;
    m_spec.tile_height = source.tile_height;
    m_spec.tile_depth = source.tile_depth;
  }

  bool fail() {
    errorfmt("{}", (*inner_)->geterror());
    return false;
  }

  void convert(const std::vector<float>& source, void* data) const {
    std::vector<float> linear;
    linear.reserve(source.size());
    for (std::size_t i = 0; i < source.size(); ++i) {
      if (i % source_channels_ >= channels_) continue;  // alpha is the last channel
      linear.push_back(is_srgb_ ? srgb_decode(source[i]) : source[i]);
    }
    OIIO::convert_pixel_values(OIIO::TypeDesc::FLOAT, linear.data(), m_spec.format, data,
                               static_cast<int>(linear.size()));
  }

  std::unique_ptr<OpenInput> inner_;
  bool is_srgb_ = false;
  std::size_t source_channels_ = 0;
  std::size_t channels_ = 0;
};

// One for all files, and until the process ends, never destroyed: threads may look up to the last.
// OpenImageIO 2 makes a pointer of it, 3 a shared one.
OIIO::TextureSystem& texture_system() {
  static const auto* const system = [] {
    auto* const made = new auto(OIIO::TextureSystem::create(false));
    (*made)->attribute("max_memory_MB", kDefaultCacheMebibytes);
    (*made)->attribute("max_open_files", 64);
    (*made)->attribute("autotile", 64);
    (*made)->attribute("automip", 1);
    (*made)->attribute("accept_untiled", 1);
    (*made)->attribute("accept_unmipped", 1);
    (*made)->attribute("gray_to_rgb", 1);
    (*made)->attribute("failure_retries", 0);
    return made;
  }();
  return **system;
}

OIIO::TextureOpt::Wrap wrap_mode(TextureWrap wrap) {
  switch (wrap) {
    case TextureWrap::repeat: return OIIO::TextureOpt::WrapPeriodic;
    case TextureWrap::clamp: return OIIO::TextureOpt::WrapClamp;
    case TextureWrap::mirror: return OIIO::TextureOpt::WrapMirror;
  }
  return OIIO::TextureOpt::WrapPeriodic;
}

// The texture system turns coordinates into integers.
float bounded(float x, TextureWrap wrap) {
  if (!std::isfinite(x)) return 0.0F;
  if (wrap == TextureWrap::clamp) return std::clamp(x, -1.0F, 2.0F);
  if (std::abs(x) < 1024.0F) return x;
  return x - 2.0F * std::floor(0.5F * x);
}

struct Facts {
  int width = 0;
  int height = 0;
  glm::vec3 mean{0.0F};
};

// Checks all texels, in strips of rows, so that it takes little memory.
Facts check_texels(const std::string& path, Transfer transfer, const ImageLimits& limits) {
  Facts facts;
  Header header;
  const OpenInput input = open_checked(path, limits, header);
  const OIIO::ImageSpec& spec = input->spec();
  const int channels = colour_channels(spec);
  const bool has_last_alpha = spec.alpha_channel < 0 || spec.alpha_channel == spec.nchannels - 1;
  if ((channels != 1 && channels != 3) || !has_last_alpha) {
    throw FileError(path, "has " + std::to_string(spec.nchannels) + " channels, expected grey or R, G, B");
  }
  if (header.orientation != 1) throw FileError(path, "is stored turned, expected a texture that is upright");
  if (header.data != header.display || spec.x != 0 || spec.y != 0) {
    throw FileError(path, "is cropped, expected a texture whose data window is its display window");
  }
  facts.width = spec.width;
  facts.height = spec.height;
  const bool is_encoded = is_srgb(header, transfer);
  const int rows = spec.tile_height > 0 ? spec.tile_height : 64;
  const std::size_t row = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.nchannels);
  std::vector<float> strip(static_cast<std::size_t>(rows) * row);
  double sums[3] = {0.0, 0.0, 0.0};
  for (int y = 0; y < spec.height; y += rows) {
    const int end = std::min(y + rows, spec.height);
    const bool is_read =
        spec.tile_width > 0
            ? input->read_tiles(0, 0, 0, spec.width, y, end, 0, 1, 0, spec.nchannels, OIIO::TypeDesc::FLOAT,
                                strip.data())
            : input->read_scanlines(0, 0, y, end, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, strip.data());
    if (!is_read || input->has_error())
      throw FileError(path, "is damaged or truncated: " + one_line(input->geterror()));
    const std::size_t size = static_cast<std::size_t>(end - y) * row;
    for (std::size_t i = 0; i < size; ++i) {
      const int channel = static_cast<int>(i % static_cast<std::size_t>(spec.nchannels));
      if (channel >= channels) continue;
      if (!(strip[i] >= 0.0F && strip[i] <= 1.0F)) {
        throw FileError(path, "has the value " + text_of(strip[i]) + ", expected 0 to 1");
      }
      sums[channel] += static_cast<double>(is_encoded ? srgb_decode(strip[i]) : strip[i]);
    }
  }
  const double count = static_cast<double>(spec.width) * static_cast<double>(spec.height);
  for (int c = 0; c < 3; ++c) facts.mean[c] = static_cast<float>(sums[channels == 1 ? 0 : c] / count);
  return facts;
}

class TextureOfFile : public Texture {
 public:
  TextureOfFile(const std::string& path, Transfer transfer, const ImageLimits& limits)
      : path_(path), facts_(check_texels(path, transfer, limits)) {
    static std::atomic<std::uint64_t> count{0};
    name_ = OIIO::ustring(std::to_string(count++) + ":" + std::to_string(static_cast<int>(transfer)) + ":" +
                          path);
    OIIO::TextureSystem& system = texture_system();
    system.imagecache()->add_file(name_, LinearInput::create);
    handle_ = system.get_texture_handle(name_);
    if (handle_ == nullptr || !system.good(handle_)) {
      throw FileError(path, "cannot be used as a texture: " + one_line(system.geterror()));
    }
  }
  ~TextureOfFile() override { texture_system().invalidate(name_); }
  TextureOfFile(const TextureOfFile&) = delete;
  TextureOfFile& operator=(const TextureOfFile&) = delete;

  int width() const override { return facts_.width; }
  int height() const override { return facts_.height; }
  glm::vec3 mean() const override { return facts_.mean; }

  glm::vec3 lookup(glm::vec2 uv, float footprint, TextureWrap wrap_u, TextureWrap wrap_v) const override {
    OIIO::TextureSystem& system = texture_system();
    OIIO::TextureOpt options;
    options.swrap = wrap_mode(wrap_u);
    options.twrap = wrap_mode(wrap_v);
    options.interpmode = OIIO::TextureOpt::InterpBilinear;
    options.mipmode = footprint > 0.0F ? OIIO::TextureOpt::MipModeTrilinear : OIIO::TextureOpt::MipModeNoMIP;
    glm::vec3 value(0.0F);
    if (!system.texture(handle_, system.get_perthread_info(), options, bounded(uv.x, wrap_u),
                        bounded(1.0F - uv.y, wrap_v), footprint, 0.0F, 0.0F, footprint, 3, &value.x)) {
      throw FileError(path_, "cannot be read as it was when it was opened: " + system.geterror());
    }
    return value;
  }

 private:
  std::string path_;
  Facts facts_;
  OIIO::ustring name_;
  OIIO::TextureSystem::TextureHandle* handle_ = nullptr;
};

}  // namespace

std::unique_ptr<Texture> open_texture_file(const std::string& path, Transfer transfer,
                                           const ImageLimits& limits) {
  try {
    return std::make_unique<TextureOfFile>(path, transfer, limits);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw FileError(path, "is damaged: " + one_line(e.what()));
  }
}

void set_cache_bytes(std::uint64_t bytes) {
  texture_system().attribute("max_memory_MB", static_cast<float>(bytes >> 20));
}

}  // namespace mirrorbake::image_files
