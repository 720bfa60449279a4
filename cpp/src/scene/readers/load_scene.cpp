#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "readers.hpp"

namespace mirrorbake {
namespace {

void check_options(const SceneOptions& options) {
  if (options.max_texture_side < 1 || options.max_texture_side > 65536) {
    throw InvalidArgument("max_texture_side", std::to_string(options.max_texture_side), "1 to 65536");
  }
  if (!(options.luminous_efficacy >= 1e-6F && options.luminous_efficacy <= 1e6F)) {
    throw InvalidArgument("luminous_efficacy", text_of(options.luminous_efficacy), "1e-6 to 1e6");
  }
  check_origin(options.origin);
}

}  // namespace

LoadedScene load_scene(const std::string& path, const SceneOptions& options) {
  check_options(options);
  LoadedScene loaded = reader_of(path).scene(path, options);
  try {
    validate(loaded.scene);
  } catch (const InvalidArgument& error) {
    throw FileError(path, error.what());
  }
  return loaded;
}

}  // namespace mirrorbake
