#include "scene_builder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>

#include "file_bytes.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake {
namespace {

std::string unique_name(const std::string& wanted, std::map<std::string, int>& taken) {
  int& count = taken[wanted];
  if (++count == 1) return wanted;
  for (;; ++count) {
    const std::string name = wanted + "#" + std::to_string(count);
    if (taken.emplace(name, 1).second) return name;
  }
}

// Triangles [first, end) of the mesh.
using Range = std::pair<std::size_t, std::size_t>;

// The mesh of some triangles; `new_index` has an entry kUnused for every vertex, and has so again afterwards.
constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();

TriangleMesh submesh(const TriangleMesh& mesh, const std::vector<Range>& ranges,
                     std::vector<std::uint32_t>& new_index) {
  TriangleMesh result;
  std::vector<std::uint32_t> used;
  for (const auto& [first, end] : ranges) {
    for (std::size_t i = first; i < end; ++i) {
      glm::uvec3 t = mesh.triangles[i];
      for (int k = 0; k < 3; ++k) {
        std::uint32_t& index = new_index[t[k]];
        if (index == kUnused) {
          index = static_cast<std::uint32_t>(used.size());
          used.push_back(t[k]);
        }
        t[k] = index;
      }
      result.triangles.push_back(t);
    }
  }
  for (const std::uint32_t vertex : used) {
    result.positions.push_back(mesh.positions[vertex]);
    if (!mesh.normals.empty()) result.normals.push_back(mesh.normals[vertex]);
    if (!mesh.uvs.empty()) result.uvs.push_back(mesh.uvs[vertex]);
    if (!mesh.colors.empty()) result.colors.push_back(mesh.colors[vertex]);
    if (!mesh.tangents.empty()) result.tangents.push_back(mesh.tangents[vertex]);
    new_index[vertex] = kUnused;
  }
  return result;
}

}  // namespace

void Warnings::add(const std::string& message, std::uint64_t count) {
  if (count == 0) return;
  const auto [it, is_new] = index_.emplace(message, warnings_.size());
  if (is_new) {
    warnings_.push_back({valid_utf8(message), count});
  } else {
    warnings_[it->second].count += count;
  }
}

void TextureReader::reserve(const std::string& name, int width, int height, int channels) {
  const std::uint64_t size = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) *
                             static_cast<std::uint64_t>(channels) * sizeof(float);
  if (size > options_.max_texture_bytes - bytes_) {
    throw FileError(name, "is beyond the limit on decoded textures of " +
                              std::to_string(options_.max_texture_bytes >> 20) + " MiB together");
  }
  bytes_ += size;
}

void TextureReader::release(const Image& image) { bytes_ -= image.pixels.size() * sizeof(float); }

Image TextureReader::decode(const std::string& name, std::span<const unsigned char> bytes, Transfer transfer,
                            AlphaUse alpha) {
  DecodeOptions options;
  options.limits = {options_.max_texture_side, 4, options_.max_texture_bytes - bytes_};
  options.transfer = transfer;
  options.alpha = alpha;
  Image image = decode_image(name, bytes, options);
  if (image.channels.size() != 1 && image.channels.size() != 3) {
    throw FileError(name,
                    "has " + std::to_string(image.channels.size()) + " channels, expected grey or R, G, B");
  }
  for (const float v : image.pixels) {
    if (!(v >= 0.0F) || !std::isfinite(v)) {
      throw FileError(name, "has the value " + text_of(v) + ", expected finite ones of at least 0");
    }
  }
  reserve(name, image.width, image.height, image.channel_count());
  return image;
}

Image TextureReader::read(const std::string& name, std::span<const unsigned char> bytes, Transfer transfer,
                          float* largest) {
  Image image = decode(name, bytes, transfer, AlphaUse::drop);
  const float most = std::max(1.0F, *std::max_element(image.pixels.begin(), image.pixels.end()));
  if (most > 1.0F) {
    if (largest == nullptr) warnings_.add(name + ": values above 1 are taken as 1");
    for (float& v : image.pixels) v = largest != nullptr ? v / most : std::min(v, 1.0F);
  }
  if (largest != nullptr) *largest = most;
  return image;
}

std::optional<Image> TextureReader::read_opacity(const std::string& name,
                                                 std::span<const unsigned char> bytes, bool grey_counts) {
  Image image = decode(name, bytes, Transfer::linear, AlphaUse::only);
  release(image);
  if (image.channels[0] != "A" && !grey_counts) return std::nullopt;
  const std::size_t channels = image.channels.size();
  for (std::size_t i = 0; i * channels < image.pixels.size(); ++i) {
    image.pixels[i] = std::min(image.pixels[i * channels], 1.0F);
  }
  image.pixels.resize(image.pixels.size() / channels);
  image.channels = {"A"};
  if (std::all_of(image.pixels.begin(), image.pixels.end(), [](float v) { return v == 1.0F; })) {
    return std::nullopt;
  }
  reserve(name, image.width, image.height, 1);
  return image;
}

Texture TextureReader::read_file_texture(const std::string& path, Transfer transfer, float* largest) {
  Texture texture;
  ImageLimits limits;
  limits.max_side = options_.max_texture_side;
  const ImageSize size = read_image_size(path, limits);
  const std::uint64_t decoded = static_cast<std::uint64_t>(size.width) *
                                static_cast<std::uint64_t>(size.height) *
                                static_cast<std::uint64_t>(std::min(size.channels, 3)) * sizeof(float);
  if (decoded > options_.cache_textures_above) {
    texture.file = std::make_shared<TextureFile>(path, transfer, limits);
    return texture;
  }
  const std::string bytes = read_file(path);
  texture.image =
      read(path, {reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()}, transfer, largest);
  return texture;
}

glm::vec3 radiance(const std::string& path, const std::string& what, glm::vec3 value) {
  for (int i = 0; i < 3; ++i) {
    if (!(value[i] >= 0.0F) || !std::isfinite(value[i])) {
      throw FileError(path, what + " is " + text_of(value) + ", expected finite values of at least 0");
    }
  }
  return value;
}

glm::vec3 reflectance(const std::string& path, const std::string& what, glm::vec3 value, Warnings& warnings) {
  radiance(path, what, value);
  if (value.x <= 1.0F && value.y <= 1.0F && value.z <= 1.0F) return value;
  warnings.add(what + ": values above 1 are taken as 1");
  return {std::min(value.x, 1.0F), std::min(value.y, 1.0F), std::min(value.z, 1.0F)};
}

std::vector<Object> split_into_objects(LoadedMesh&& loaded, const std::vector<Material>& materials,
                                       const std::map<int, int>& material_of) {
  const LoadedMesh source = std::move(loaded);
  struct Piece {
    const MeshGroup* group;
    std::vector<Range> ranges;
  };
  std::vector<Piece> pieces;
  std::map<std::pair<int, int>, std::size_t> piece_of;
  std::map<int, std::size_t> pieces_of_owner;
  for (std::size_t i = 0; i < source.groups.size(); ++i) {
    const MeshGroup& group = source.groups[i];
    const std::size_t end =
        i + 1 < source.groups.size() ? source.groups[i + 1].first_triangle : source.mesh.triangles.size();
    if (end == group.first_triangle) continue;
    const auto [it, is_new] = piece_of.emplace(std::pair(group.owner, group.material), pieces.size());
    if (is_new) {
      pieces.push_back({&group, {}});
      ++pieces_of_owner[group.owner];
    }
    pieces[it->second].ranges.push_back({group.first_triangle, end});
  }

  std::vector<std::uint32_t> new_index(source.mesh.positions.size(), kUnused);
  std::map<std::string, int> taken;
  std::vector<Object> objects;
  for (const Piece& piece : pieces) {
    Object object;
    object.material = material_of.at(piece.group->material);
    std::string name = piece.group->name.empty() ? "object" : valid_utf8(piece.group->name);
    if (pieces_of_owner[piece.group->owner] > 1) {
      name += "/" + materials[static_cast<std::size_t>(object.material)].name;
    }
    object.name = unique_name(name, taken);
    object.mesh = submesh(source.mesh, piece.ranges, new_index);
    objects.push_back(std::move(object));
  }
  return objects;
}

}  // namespace mirrorbake
