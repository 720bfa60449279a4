// Bytes as a mesh file: the first byte chooses the format.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "fuzz_targets.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/load.hpp"

int fuzz_load_mesh(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const char* extensions[] = {".obj", ".gltf", ".glb"};
  static const std::string stem =
      (std::filesystem::temp_directory_path() / ("mirrorbake-fuzz-" + std::to_string(getpid()))).string();
  const std::string path = stem + extensions[data[0] % 3];
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data) + 1, static_cast<std::streamsize>(size - 1));
  const mirrorbake::MeshLimits limits{100'000, 100'000};
  try {
    mirrorbake::validate(mirrorbake::load_mesh(path, limits));
  } catch (const mirrorbake::FileError&) {
  }
  std::filesystem::remove(path);
  return 0;
}
