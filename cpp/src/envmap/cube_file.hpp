#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/image/bytes.hpp"
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
  FileBytes(const std::string& name, const image_files::Bytes& bytes, const ImageLimits& limits)
      : name_(name), bytes_(bytes) {
    if (bytes.size() > limits.max_bytes) throw FileError(name, "is too large");
  }

  void require(std::uint64_t offset, std::uint64_t bytes) const {
    if (offset > bytes_.size() || bytes > bytes_.size() - offset) throw FileError(name_, "is truncated");
  }
  void read(std::uint64_t offset, std::span<unsigned char> to) const {
    require(offset, to.size());
    if (bytes_.read(offset, to) != to.size()) throw FileError(name_, "cannot be read");
  }
  template <typename T>
  T get(std::uint64_t offset) const {
    std::array<unsigned char, sizeof(T)> raw{};
    read(offset, raw);
    T value;
    std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }

 private:
  const std::string& name_;
  const image_files::Bytes& bytes_;
};

/// What such a file holds: a cube, or a picture that has one face and may be any map. A picture's projection
/// is not known; it stands in the layout as latlong.
struct MapFile {
  EnvMap map;
  bool is_picture = false;
};

MapFile read_ktx2(const std::string& name, const image_files::Bytes& bytes, const ImageLimits& limits);
EnvMap read_dds(const std::string& name, const image_files::Bytes& bytes, const ImageLimits& limits);

/// The map in a file's picture, as unpack_faces finds it in an image; maps of one face keep their levels.
/// Throws FileError.
EnvMap unpacked(const std::string& name, MapFile file, const std::optional<Projection>& projection,
                FaceLayout layout);

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
