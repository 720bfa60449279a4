// Bytes as a scene of up to three files: the first byte chooses the format; a line "%%image%%" or
// "%%library%%" starts the file image.png or library.mtl that the scene may refer to.
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "fuzz_targets.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/load.hpp"

namespace {

namespace fs = std::filesystem;

const fs::path& folder() {
  static const fs::path path = [] {
    fs::path made = fs::temp_directory_path() / ("mirrorbake-fuzz-scene-" + std::to_string(getpid()));
    fs::create_directories(made);
    return made;
  }();
  return path;
}

void write(const fs::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// What precedes the marker; the rest stays in `bytes` without the marker.
std::string_view cut(std::string_view& bytes, std::string_view marker) {
  const std::size_t at = std::min(bytes.find(marker), bytes.size());
  const std::string_view head = bytes.substr(0, at);
  bytes.remove_prefix(std::min(at + marker.size(), bytes.size()));
  return head;
}

}  // namespace

int fuzz_load_scene(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const char* extensions[] = {".obj", ".gltf", ".glb"};
  std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const fs::path scene = folder() / (std::string("scene") + extensions[data[0] % 3]);
  write(scene, cut(bytes, "\n%%library%%\n"));
  write(folder() / "library.mtl", cut(bytes, "\n%%image%%\n"));
  write(folder() / "image.png", bytes);
  mirrorbake::SceneOptions options;
  options.meshes = {100'000, 100'000};
  options.max_texture_bytes = 64U << 20;
  options.cache_textures_above = 64;
  try {
    mirrorbake::validate(mirrorbake::load_scene(scene.string(), options).scene);
  } catch (const mirrorbake::FileError&) {
  }
  return 0;
}
