#include "gltf_document.hpp"
#include "readers.hpp"

namespace mirrorbake {
namespace {

void add_uri(References& found, const std::string& uri) {
  if (!uri.empty() && !uri.starts_with("data:")) found.add(gltf::percent_decoded(uri));
}

}  // namespace

void find_gltf_references(const std::string& path, FileContent content, References& found) {
  const tinygltf::Model model = gltf::read_document(path);
  for (const tinygltf::Buffer& buffer : model.buffers) add_uri(found, buffer.uri);
  if (content == FileContent::mesh) return;
  for (const tinygltf::Image& image : model.images) add_uri(found, image.uri);
}

}  // namespace mirrorbake
