#include <utility>

#include "files.hpp"

namespace mirrorbake::image_files {
namespace {

class Implementation : public OpenImageIo {
 public:
  std::unique_ptr<Reader> open(const std::string& name, FileKind kind, std::shared_ptr<const Bytes> bytes,
                               Guard guard) const override {
    return open_file(name, kind, std::move(bytes), std::move(guard));
  }
  SaveReport save(const SaveRequest& request) const override { return save_file(request); }
  std::unique_ptr<Texture> open_texture(const std::string& path, Transfer transfer,
                                        const ImageLimits& limits) const override {
    return open_texture_file(path, transfer, limits);
  }
  void set_texture_cache_bytes(std::uint64_t bytes) const override { set_cache_bytes(bytes); }
};

}  // namespace
}  // namespace mirrorbake::image_files

/// What the library is loaded for; the name has the version in it.
extern "C" __attribute__((visibility("default"))) const mirrorbake::image_files::OpenImageIo*
MIRRORBAKE_OPENIMAGEIO_ENTRY() {
  // Destroyed never: textures may be looked up to the last.
  static const auto* const implementation = new mirrorbake::image_files::Implementation;
  return implementation;
}
