#pragma once

#include <algorithm>
#include <bit>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/image/image_io.hpp"

/// What readers and writers of cubes with their levels have in common: KTX2 and DDS.
namespace mirrorbake {

static_assert(std::endian::native == std::endian::little,
              "these files are little-endian and so is this code");

inline bool has_extension(const std::string& path, std::string_view wanted) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == wanted;
}

class ByteWriter {
 public:
  template <typename T>
  void put(T value) {
    const std::size_t end = bytes.size();
    bytes.resize(end + sizeof value);
    overwrite(end, value);
  }
  void put_text(std::string_view text) {
    for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
  }
  void pad(std::size_t alignment) {
    while (bytes.size() % alignment != 0) bytes.push_back(std::byte{0});
  }
  template <typename T>
  void overwrite(std::size_t offset, T value) {
    std::memcpy(bytes.data() + offset, &value, sizeof value);
  }
  std::vector<std::byte> bytes;
};

/// A file of which nothing is read before it is known to hold it.
class FileBytes {
 public:
  FileBytes(const std::string& path, const ImageLimits& limits)
      : path_(path), in_(path, std::ios::binary | std::ios::ate) {
    std::error_code error;
    if (!std::filesystem::exists(path, error)) throw FileError(path, "does not exist");
    if (!std::filesystem::is_regular_file(path, error) || !in_) throw FileError(path, "cannot be read");
    size_ = static_cast<std::uint64_t>(in_.tellg());
    if (size_ > limits.max_bytes) throw FileError(path, "is too large");
  }

  void require(std::uint64_t offset, std::uint64_t bytes) const {
    if (offset > size_ || bytes > size_ - offset) throw FileError(path_, "is truncated");
  }
  void read(std::uint64_t offset, void* data, std::uint64_t bytes) {
    require(offset, bytes);
    in_.seekg(static_cast<std::streamoff>(offset));
    in_.read(static_cast<char*>(data), static_cast<std::streamsize>(bytes));
    if (!in_) throw FileError(path_, "cannot be read");
  }
  template <typename T>
  T get(std::uint64_t offset) {
    T value;
    read(offset, &value, sizeof value);
    return value;
  }

 private:
  std::string path_;
  std::ifstream in_;
  std::uint64_t size_ = 0;
};

inline EnvMap without_alpha(const EnvMap& map) {
  EnvMapLayout layout = map.layout;
  layout.channels = 3;
  EnvMap result = make_envmap(layout, default_channels(3));
  for (std::size_t from = 0, to = 0; from < map.values.size(); from += 4, to += 3) {
    std::copy_n(&map.values[from], 3, &result.values[to]);
  }
  return result;
}

}  // namespace mirrorbake
