#include <webp/decode.h>

#include <vector>

#include "image_files.hpp"
#include "mirrorbake/core/error.hpp"

namespace mirrorbake::image_files {
namespace {

class WebpReader : public Reader {
 public:
  WebpReader(const std::string& name, const Bytes& bytes) : name_(name), bytes_(all_of(name, bytes)) {
    WebPBitstreamFeatures features{};
    if (WebPGetFeatures(bytes_.data(), bytes_.size(), &features) != VP8_STATUS_OK) {
      throw FileError(name, "is a damaged or truncated WebP image");
    }
    if (features.has_animation != 0) throw FileError(name, "is an animation, expected a single image");
    header_.data = header_.display = {0, 0, features.width, features.height};
    header_.channels = {"R", "G", "B"};
    if (features.has_alpha != 0) {
      header_.channels.emplace_back("A");
      header_.alpha = 3;
      header_.unassociated_alpha = true;
    }
    header_.is_integer = true;
    header_.is_byte = true;
    header_.pixel_bits = 8 * header_.channels.size();
  }

  const Header& header() const override { return header_; }

  void read(std::span<float> pixels) override {
    const std::size_t channels = header_.channels.size();
    std::vector<unsigned char> decoded(pixels.size());
    const int stride = static_cast<int>(channels) * header_.data.width;
    const auto decode = channels == 4 ? WebPDecodeRGBAInto : WebPDecodeRGBInto;
    if (decode(bytes_.data(), bytes_.size(), decoded.data(), decoded.size(), stride) == nullptr) {
      throw FileError(name_, "is damaged or truncated");
    }
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<float>(decoded[i]) / 255.0F;
  }

 private:
  std::string name_;
  std::vector<unsigned char> bytes_;
  Header header_;
};

}  // namespace

std::unique_ptr<Reader> open_webp(const std::string& name, const Bytes& bytes) {
  return std::make_unique<WebpReader>(name, bytes);
}

}  // namespace mirrorbake::image_files
