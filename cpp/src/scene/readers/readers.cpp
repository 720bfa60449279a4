#include "readers.hpp"

#include <algorithm>
#include <cctype>
#include <system_error>

#include "file_bytes.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

constexpr std::array kReaders{
    SceneReader{{".obj"}, read_obj, read_obj_scene, find_obj_references},
    SceneReader{{".gltf", ".glb"}, read_gltf, read_gltf_scene, find_gltf_references},
};

}  // namespace

const SceneReader& reader_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::vector<std::string> known;
  for (const SceneReader& reader : kReaders) {
    for (const std::string_view own : reader.extensions) {
      if (own.empty()) continue;
      if (own == extension) return reader;
      known.emplace_back(own);
    }
  }
  throw FileError(path, "has the extension '" + extension + "', expected " + listed(known));
}

bool References::add(const std::filesystem::path& directory, const std::string& reference) {
  const std::optional<std::filesystem::path> file = resolve_inside(directory, reference);
  std::error_code code;
  if (!file || !std::filesystem::is_regular_file(*file, code)) return false;
  if (std::find(files_.begin(), files_.end(), file->string()) == files_.end()) {
    files_.push_back(file->string());
  }
  return true;
}

std::vector<std::string> referenced_files(const std::string& path, FileContent content) {
  References found(std::filesystem::path(path).parent_path());
  reader_of(path).references(path, content, found);
  return found.take();
}

}  // namespace mirrorbake
