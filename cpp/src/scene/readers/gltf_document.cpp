#include "gltf_document.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <exception>
#include <filesystem>
#include <limits>
#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "file_bytes.hpp"
#include "gltf_compression.hpp"
#include "mirrorbake/core/error.hpp"

namespace mirrorbake::gltf {
namespace {

// tinygltf converts `extras` and `extensions` by recursion.
constexpr int kMaxJsonDepth = 256;
// How many bytes a document may take by referring to the same files again.
constexpr std::uint64_t kMaxRepeatedBytes = std::uint64_t{1} << 28;

constexpr std::array<std::string_view, 9> kKnown = {
    "EXT_meshopt_compression", "EXT_texture_webp",      "KHR_draco_mesh_compression",
    "KHR_lights_punctual",     "KHR_materials_ior",     "KHR_materials_emissive_strength",
    "KHR_materials_unlit",     "KHR_mesh_quantization", "KHR_texture_transform"};

// What tinygltf would let pass: deep nesting, and negative sizes, which it takes for absent ones.
void check_json(const std::string& path, std::string_view json) {
  constexpr std::array<std::string_view, 4> kSizes = {"byteLength", "byteOffset", "byteStride", "count"};
  int depth = 0;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (c == '{' || c == '[') {
      if (++depth > kMaxJsonDepth)
        fail(path, "JSON is nested deeper than " + std::to_string(kMaxJsonDepth) + " levels");
    } else if (c == '}' || c == ']') {
      --depth;
    } else if (c == '"') {
      const std::size_t begin = ++i;
      for (; i < json.size() && json[i] != '"'; ++i) {
        if (json[i] == '\\') ++i;
      }
      const std::string_view key = json.substr(begin, i < json.size() ? i - begin : std::string_view::npos);
      const std::size_t value = json.find_first_not_of(" \t\r\n:", std::min(i + 1, json.size()));
      if (value != std::string_view::npos && json[value] == '-' &&
          std::find(kSizes.begin(), kSizes.end(), key) != kSizes.end()) {
        fail(path, std::string(key) + " is negative");
      }
    }
  }
}

// tinygltf asks for a view of every accessor of indices and for data of every buffer, which compressed files
// do not have: their accessors may stand for what Draco decodes, and their buffers for what meshoptimizer
// does. They get a view of this name and a buffer of one byte. Nothing for files that need no such change.
constexpr const char* kPlaceholder = "\x01placeholder";

std::optional<std::string> without_placeholders(std::string_view json) {
  if (json.find(kDraco) == std::string_view::npos && json.find(kMeshopt) == std::string_view::npos)
    return std::nullopt;
  nlohmann::json document = nlohmann::json::parse(json.begin(), json.end(), nullptr, false);
  if (!document.is_object() || !document["buffers"].is_array() || !document["accessors"].is_array() ||
      !document["bufferViews"].is_array()) {
    return std::nullopt;  // tinygltf will say what is wrong
  }
  nlohmann::json& buffers = document["buffers"];
  const nlohmann::json empty = {{"byteLength", 1}, {"uri", "data:application/octet-stream;base64,AA=="}};
  for (nlohmann::json& buffer : buffers) {
    const bool is_fallback = buffer.is_object() && !buffer.contains("uri") && buffer.contains("extensions") &&
                             buffer["extensions"].is_object() && buffer["extensions"].contains(kMeshopt);
    if (is_fallback) buffer = empty;
  }
  const std::size_t view = document["bufferViews"].size();
  document["bufferViews"].push_back({{"buffer", buffers.size()}, {"byteLength", 1}, {"name", kPlaceholder}});
  buffers.push_back(empty);
  for (nlohmann::json& accessor : document["accessors"]) {
    if (accessor.is_object() && !accessor.contains("bufferView")) accessor["bufferView"] = view;
  }
  return document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// A binary file with another text, of which it has `size` bytes.
std::string with_json(const std::string& bytes, std::size_t size, std::string json) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto word = [](std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    return std::string(reinterpret_cast<const char*>(&number), sizeof number);
  };
  const std::string chunks = bytes.substr(20 + size);
  return bytes.substr(0, 8) + word(20 + json.size() + chunks.size()) + word(json.size()) +
         bytes.substr(16, 4) + json + chunks;
}

// Before tinygltf, to which such a file is an empty one or an error about something else.
bool is_version_1(bool binary, std::string_view bytes) {
  if (binary) return bytes.size() > 4 && bytes[4] == 1;
  const std::size_t asset = bytes.find("\"asset\"");
  if (asset == std::string_view::npos) return bytes.find("\"techniques\"") != std::string_view::npos;
  const std::string_view object = bytes.substr(asset, std::min(bytes.find('}', asset), bytes.size()) - asset);
  const std::size_t version = object.find("\"version\"");
  if (version == std::string_view::npos) return false;
  const std::size_t digit = object.find_first_of("0123456789", version);
  return digit != std::string_view::npos && object[digit] == '1';
}

bool is_binary(std::string_view bytes) { return bytes.substr(0, 4) == "glTF"; }

// The text of a binary file: the first chunk after the header of 12 bytes (glTF 2.0 §4.4).
std::string_view json_chunk(const std::string& path, std::string_view bytes) {
  constexpr std::size_t kHeader = 12;
  constexpr std::size_t kChunkHeader = 8;
  if (bytes.size() < kHeader + kChunkHeader) fail(path, "binary header is cut off");
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + kHeader, sizeof(length));
  if (length > bytes.size() - kHeader - kChunkHeader) fail(path, "JSON chunk is cut off");
  return bytes.substr(kHeader + kChunkHeader, length);
}

// tinygltf asks for files by joining the directory and the reference; these callbacks let it see only what is
// inside.
struct Directory {
  std::filesystem::path root;
  std::string refused;   // the first reference that points outside
  std::string repeated;  // the first file that is referred to too often
  std::map<std::filesystem::path, int> reads;
  std::uint64_t repeated_bytes = 0;

  std::optional<std::filesystem::path> resolve(const std::string& joined) {
    const std::string prefix = root.string() + "/";
    const std::string reference = joined.starts_with(prefix) ? joined.substr(prefix.size()) : joined;
    auto target = resolve_inside(root, reference);
    if (!target && refused.empty()) refused = reference;
    return target;
  }
};

// tinygltf knows seven media types, and takes URIs of data with another type or a character set for names of
// files.
std::optional<std::string_view> data_uri(std::string_view joined) {
  const std::size_t at = joined.find("data:");
  if (at == std::string_view::npos || (at > 0 && joined[at - 1] != '/')) return std::nullopt;
  constexpr std::string_view kBase64 = ";base64,";
  const std::size_t end = joined.find(kBase64, at);
  if (end == std::string_view::npos) return std::nullopt;
  return joined.substr(end + kBase64.size());
}

bool file_exists(const std::string& joined, void* user) {
  if (data_uri(joined)) return true;
  const auto target = static_cast<Directory*>(user)->resolve(joined);
  std::error_code code;
  return target && std::filesystem::is_regular_file(*target, code);
}

bool read_whole_file(std::vector<unsigned char>* out, std::string* error, const std::string& joined,
                     void* user) {
  if (const auto encoded = data_uri(joined)) {
    *out = base64_decoded(*encoded);
    return true;
  }
  Directory& directory = *static_cast<Directory*>(user);
  const auto target = directory.resolve(joined);
  if (!target) return false;
  try {
    // Each reference holds a copy of the file: a short text must not fill the memory.
    std::error_code code;
    const std::uintmax_t size = std::filesystem::file_size(*target, code);
    if (!code && ++directory.reads[*target] > 1) directory.repeated_bytes += size;
    if (directory.repeated_bytes > kMaxRepeatedBytes) {
      directory.repeated = joined;
      return false;
    }
    const std::string bytes = read_file(*target);
    out->assign(bytes.begin(), bytes.end());
    return true;
  } catch (const FileError& e) {
    if (error != nullptr) *error += e.what();
    return false;
  }
}

bool refuse_to_write(std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
  return false;
}

[[maybe_unused]] bool file_size(std::size_t* size, std::string* error, const std::string& joined,
                                void* user) {
  std::vector<unsigned char> bytes;
  if (!read_whole_file(&bytes, error, joined, user)) return false;
  *size = bytes.size();
  return true;
}

// tinygltf takes either all callbacks or none, and falls back to the whole file system without a word. What
// "all" is depends on its version: 2.9 asks for the size of a file too.
template <typename Callbacks>
Callbacks file_callbacks(Directory* directory) {
  Callbacks callbacks{};
  callbacks.FileExists = file_exists;
  callbacks.ExpandFilePath = [](const std::string& name, void*) { return name; };
  callbacks.ReadWholeFile = read_whole_file;
  callbacks.WriteWholeFile = refuse_to_write;
  if constexpr (requires { callbacks.GetFileSizeInBytes; }) callbacks.GetFileSizeInBytes = file_size;
  callbacks.user_data = directory;
  return callbacks;
}

// Images in buffers and in files are read where they are when they are needed.
bool keep_embedded(tinygltf::Image* image, int, std::string*, std::string*, int, int,
                   const unsigned char* bytes, int size, void*) {
  image->as_is = true;
  if (image->bufferView < 0 && image->uri.empty()) image->image.assign(bytes, bytes + size);
  return true;
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

int component_size(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT: return 4;
    default: return 0;
  }
}

int component_count(int type) {
  switch (type) {
    case TINYGLTF_TYPE_SCALAR: return 1;
    case TINYGLTF_TYPE_VEC2: return 2;
    case TINYGLTF_TYPE_VEC3: return 3;
    case TINYGLTF_TYPE_VEC4: return 4;
    default: return 0;
  }
}

// Elements at a checked place in a buffer.
struct Elements {
  const unsigned char* data = nullptr;
  std::size_t stride = 0;
};

Elements locate(const std::string& path, const tinygltf::Model& model, int view_index, std::size_t offset,
                std::size_t count, std::size_t element_size, const std::string& what) {
  // glTF 2.0 §3.6.2.1: zeros, which a sparse accessor replaces.
  static constexpr std::array<unsigned char, 64> kZeros{};
  if (view_index == -1) return {kZeros.data(), 0};
  const std::span<const unsigned char> bytes = view_bytes(path, model, view_index, what);
  const tinygltf::BufferView& view = model.bufferViews[static_cast<std::size_t>(view_index)];
  // glTF 2.0 §3.6.2.4 allows 4 to 252.
  const std::size_t stride = view.byteStride == 0 ? element_size : view.byteStride;
  if (stride < element_size || stride > 252) {
    fail(path, what + " byte stride is " + std::to_string(view.byteStride) + ", expected " +
                   std::to_string(element_size) + " to 252");
  }
  const bool fits = count == 0 || (offset <= view.byteLength && element_size <= view.byteLength - offset &&
                                   count - 1 <= (view.byteLength - offset - element_size) / stride);
  if (!fits) {
    fail(path, what + " accessor with " + std::to_string(count) +
                   " elements ends beyond its buffer view of " + std::to_string(view.byteLength) + " bytes");
  }
  return {bytes.data() + offset, stride};
}

template <typename Component>
Component component_at(const unsigned char* place) {
  Component value;
  std::memcpy(&value, place, sizeof(value));
  return value;
}

// glTF 2.0 §3.11: decoding of normalised integers.
template <typename Component>
float decoded(const unsigned char* place, bool is_normalized) {
  const float value = static_cast<float>(component_at<Component>(place));
  if (!is_normalized || std::is_same_v<Component, float>) return value;
  return std::max(value / static_cast<float>(std::numeric_limits<Component>::max()), -1.0F);
}

float decode(const unsigned char* place, int type, bool is_normalized) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE: return decoded<std::int8_t>(place, is_normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return decoded<std::uint8_t>(place, is_normalized);
    case TINYGLTF_COMPONENT_TYPE_SHORT: return decoded<std::int16_t>(place, is_normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return decoded<std::uint16_t>(place, is_normalized);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return decoded<std::uint32_t>(place, is_normalized);
    default: return decoded<float>(place, is_normalized);
  }
}

std::uint32_t decode_index(const unsigned char* place, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return component_at<std::uint8_t>(place);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return component_at<std::uint16_t>(place);
    default: return component_at<std::uint32_t>(place);
  }
}

bool is_index_type(int type) {
  return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
         type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

// Calls put(index, place of its values) for the sparse replacements, glTF 2.0 §3.6.2.3, of elements of `size`
// bytes.
template <typename Put>
void apply_sparse(const std::string& path, const tinygltf::Model& model, const tinygltf::Accessor& accessor,
                  const std::string& what, std::size_t size, const Put& put) {
  const auto& sparse = accessor.sparse;
  if (!sparse.isSparse) return;
  if (sparse.count < 0 || static_cast<std::size_t>(sparse.count) > accessor.count ||
      sparse.indices.bufferView < 0 || sparse.values.bufferView < 0 ||
      !is_index_type(sparse.indices.componentType)) {
    fail(path, what + " has an invalid sparse accessor");
  }
  const std::size_t count = static_cast<std::size_t>(sparse.count);
  const std::size_t index_size = static_cast<std::size_t>(component_size(sparse.indices.componentType));
  const Elements at =
      locate(path, model, sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset),
             count, index_size, what + " sparse index");
  const Elements from =
      locate(path, model, sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset), count,
             size, what + " sparse value");
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t index = decode_index(at.data + i * at.stride, sparse.indices.componentType);
    if (index >= accessor.count) fail(path, what + " sparse index is " + std::to_string(index));
    put(index, from.data + i * from.stride);
  }
}

}  // namespace

bool is_known_extension(std::string_view name) {
  return std::find(kKnown.begin(), kKnown.end(), name) != kKnown.end();
}

void fail(const std::string& path, std::string_view problem) { throw FileError(path, problem); }

tinygltf::Model read_document(const std::string& path) {
  std::string bytes = read_file(path);
  if (bytes.size() > std::numeric_limits<std::int32_t>::max()) fail(path, "is larger than 2 GiB");
  const bool binary = is_binary(bytes);
  if (is_version_1(binary, bytes)) fail(path, "is a glTF 1.0 file, expected glTF 2.0");
  const std::string_view json = binary ? json_chunk(path, bytes) : std::string_view(bytes);
  check_json(path, json);
  if (const auto text = without_placeholders(json))
    bytes = binary ? with_json(bytes, json.size(), *text) : *text;

  std::error_code code;
  Directory directory{std::filesystem::weakly_canonical(path, code).parent_path(), {}, {}, {}};
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(keep_embedded, nullptr);
  loader.SetFsCallbacks(file_callbacks<tinygltf::FsCallbacks>(&directory));
  tinygltf::Model model;
  std::string errors;
  std::string warnings;
  const unsigned length = static_cast<unsigned>(bytes.size());
  bool is_good = false;
  try {
    is_good = binary ? loader.LoadBinaryFromMemory(&model, &errors, &warnings,
                                                   reinterpret_cast<const unsigned char*>(bytes.data()),
                                                   length, directory.root.string())
                     : loader.LoadASCIIFromString(&model, &errors, &warnings, bytes.data(), length,
                                                  directory.root.string());
  } catch (const std::exception& e) {
    errors = e.what();
  }
  if (!directory.refused.empty()) {
    fail(path, "refers to '" + directory.refused + "', which is not inside the file's own directory");
  }
  if (!directory.repeated.empty()) {
    fail(path, "refers to one file so often that it would take more than " +
                   std::to_string(kMaxRepeatedBytes >> 20) + " MiB: " + directory.repeated);
  }
  if (!is_good) fail(path, "is not a valid glTF file: " + one_line(errors));
  for (const std::string& extension : model.extensionsRequired) {
    if (!is_known_extension(extension)) {
      fail(path, "requires the extension " + extension + ", which is not supported");
    }
  }
  for (tinygltf::Accessor& accessor : model.accessors) {
    if (accessor.bufferView >= 0 &&
        static_cast<std::size_t>(accessor.bufferView) < model.bufferViews.size() &&
        model.bufferViews[static_cast<std::size_t>(accessor.bufferView)].name == kPlaceholder) {
      accessor.bufferView = -1;
    }
  }
  decompress_views(path, model);
  return model;
}

std::span<const unsigned char> view_bytes(const std::string& path, const tinygltf::Model& model,
                                          int view_index, std::string_view what) {
  const std::string name(what);
  const tinygltf::BufferView& view = element(path, model.bufferViews, view_index, name + " buffer view");
  const std::vector<unsigned char>& buffer = element(path, model.buffers, view.buffer, name + " buffer").data;
  if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset) {
    fail(path, name + " buffer view " + std::to_string(view_index) + " ends beyond its buffer of " +
                   std::to_string(buffer.size()) + " bytes");
  }
  return std::span(buffer).subspan(view.byteOffset, view.byteLength);
}

std::size_t element_count(const std::string& path, const tinygltf::Model& model, int accessor,
                          std::string_view what) {
  return element(path, model.accessors, accessor, std::string(what) + " accessor").count;
}

Numbers read_numbers(const std::string& path, const tinygltf::Model& model, int index, int wanted,
                     std::string_view what) {
  const std::string name(what);
  const tinygltf::Accessor& accessor = element(path, model.accessors, index, name + " accessor");
  const std::size_t size = static_cast<std::size_t>(component_size(accessor.componentType));
  if (accessor.type != wanted || size == 0) {
    fail(path, name + " accessor " + std::to_string(index) + " has the wrong type");
  }
  Numbers numbers;
  numbers.count = accessor.count;
  numbers.components = component_count(wanted);
  const std::size_t components = static_cast<std::size_t>(numbers.components);
  const Elements elements =
      locate(path, model, accessor.bufferView, accessor.byteOffset, accessor.count, components * size, name);
  numbers.values.resize(numbers.count * components);
  for (std::size_t i = 0; i < numbers.count; ++i) {
    for (std::size_t k = 0; k < components; ++k) {
      numbers.values[i * components + k] =
          decode(elements.data + i * elements.stride + k * size, accessor.componentType, accessor.normalized);
    }
  }
  apply_sparse(path, model, accessor, name, components * size, [&](std::size_t i, const unsigned char* from) {
    for (std::size_t k = 0; k < components; ++k) {
      numbers.values[i * components + k] =
          decode(from + k * size, accessor.componentType, accessor.normalized);
    }
  });
  return numbers;
}

std::vector<std::uint32_t> read_indices(const std::string& path, const tinygltf::Model& model, int index,
                                        std::string_view what) {
  const std::string name(what);
  const tinygltf::Accessor& accessor = element(path, model.accessors, index, name + " accessor");
  if (accessor.type != TINYGLTF_TYPE_SCALAR || !is_index_type(accessor.componentType)) {
    fail(path,
         name + " accessor " + std::to_string(index) + " has the wrong type, expected unsigned integers");
  }
  const std::size_t size = static_cast<std::size_t>(component_size(accessor.componentType));
  const Elements elements =
      locate(path, model, accessor.bufferView, accessor.byteOffset, accessor.count, size, name);
  std::vector<std::uint32_t> indices(accessor.count);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    indices[i] = decode_index(elements.data + i * elements.stride, accessor.componentType);
  }
  apply_sparse(path, model, accessor, name, size, [&](std::size_t i, const unsigned char* from) {
    indices[i] = decode_index(from, accessor.componentType);
  });
  return indices;
}

}  // namespace mirrorbake::gltf
