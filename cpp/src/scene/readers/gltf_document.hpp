#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tiny_gltf.h>

#include <glm/vec3.hpp>

/// A parsed .gltf or .glb file that is distrusted until each access has been checked.
namespace mirrorbake::gltf {

/// Parses the file and reads its buffers. Buffers and images outside the file's directory are refused. Images
/// of data URIs are kept as encoded bytes, others not at all. Throws FileError for anything malformed, JSON
/// nested deeper than 256 levels, and extensions that the file requires but this reader does not know.
tinygltf::Model read_document(const std::string& path);

/// The name of a file that a URI of the document means: "%20" is a space, and so on.
std::string percent_decoded(const std::string& uri);

/// Bytes of a base64 text, as data URIs have them.
std::vector<unsigned char> base64_decoded(std::string_view text);

/// Whether the name is that of an extension that this reader applies.
bool is_known_extension(std::string_view name);

/// Bytes of a buffer view, its place checked.
std::span<const unsigned char> view_bytes(const std::string& path, const tinygltf::Model& model, int view,
                                          std::string_view what);

/// Numbers of one accessor, row by row, as glTF defines them: integers that are `normalized` become [0,1] or
/// [−1,1]; sparse replacements are applied.
struct Numbers {
  std::size_t count = 0;
  int components = 0;
  std::vector<float> values;  ///< count × components
};

/// Reads an accessor of floating-point or integer components. `wanted` is its type, TINYGLTF_TYPE_…, `what`
/// names the use in errors. Throws FileError if any index, offset, stride or count is out of range.
Numbers read_numbers(const std::string& path, const tinygltf::Model& model, int accessor, int wanted,
                     std::string_view what);

/// Number of elements of an accessor, its index checked.
std::size_t element_count(const std::string& path, const tinygltf::Model& model, int accessor,
                          std::string_view what);

/// Reads an accessor of unsigned integers.
std::vector<std::uint32_t> read_indices(const std::string& path, const tinygltf::Model& model, int accessor,
                                        std::string_view what);

/// Element of one of the model's arrays, or FileError.
template <typename Element>
const Element& element(const std::string& path, const std::vector<Element>& elements, int index,
                       std::string_view what);

[[noreturn]] void fail(const std::string& path, std::string_view problem);

template <typename Element>
const Element& element(const std::string& path, const std::vector<Element>& elements, int index,
                       std::string_view what) {
  if (index < 0 || static_cast<std::size_t>(index) >= elements.size()) {
    fail(path, std::string(what) + " index is " + std::to_string(index) + ", the file has " +
                   std::to_string(elements.size()));
  }
  return elements[static_cast<std::size_t>(index)];
}

}  // namespace mirrorbake::gltf
