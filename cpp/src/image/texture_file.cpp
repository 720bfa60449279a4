#include "mirrorbake/image/texture_file.hpp"

#include "mirrorbake/core/error.hpp"
#include "openimageio.hpp"

namespace mirrorbake {

struct TextureFile::State {
  std::string path;
  std::unique_ptr<image_files::Texture> texture;
};

TextureFile::TextureFile(const std::string& path, Transfer transfer, const ImageLimits& limits)
    : state_(std::make_unique<State>(
          State{path, image_files::openimageio().open_texture(path, transfer, limits)})) {}

TextureFile::~TextureFile() = default;

const std::string& TextureFile::path() const { return state_->path; }
int TextureFile::width() const { return state_->texture->width(); }
int TextureFile::height() const { return state_->texture->height(); }
glm::vec3 TextureFile::mean() const { return state_->texture->mean(); }

glm::vec3 TextureFile::lookup(glm::vec2 uv, float footprint, TextureWrap wrap_u, TextureWrap wrap_v) const {
  return state_->texture->lookup(uv, footprint, wrap_u, wrap_v);
}

void set_texture_cache_bytes(std::uint64_t bytes) {
  if (bytes < std::uint64_t{16} << 20) {
    throw InvalidArgument("texture cache bytes", std::to_string(bytes), "at least 16 MiB");
  }
  image_files::openimageio().set_texture_cache_bytes(bytes);
}

}  // namespace mirrorbake
