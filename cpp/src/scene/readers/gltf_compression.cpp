#include "gltf_compression.hpp"

#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "loaded_mesh.hpp"

namespace mirrorbake::gltf {
namespace {

std::uint64_t whole_number(const std::string& path, const tinygltf::Value& object, const char* key,
                           const char* extension) {
  const tinygltf::Value& value = object.Get(key);
  const double number = value.IsNumber() ? value.GetNumberAsDouble() : object.Has(key) ? -1.0 : 0.0;
  if (!(number >= 0.0 && number <= 4294967295.0) || number != std::floor(number)) {
    fail(path, std::string(extension) + " " + key + " is not a whole number of at least 0");
  }
  return static_cast<std::uint64_t>(number);
}

int index_number(const std::string& path, const tinygltf::Value& object, const char* key,
                 const char* extension) {
  const std::uint64_t number = whole_number(path, object, key, extension);
  return number > static_cast<std::uint64_t>(std::numeric_limits<int>::max()) ? -1 : static_cast<int>(number);
}

}  // namespace

struct DracoMesh::State {
  std::unique_ptr<draco::Mesh> mesh;
  tinygltf::Value attributes;
};

DracoMesh::DracoMesh(const std::string& path, const tinygltf::Model& model, const tinygltf::Value& extension,
                     const MeshLimits& limits)
    : path_(path), state_(std::make_unique<State>()) {
  const auto bytes = view_bytes(path, model, index_number(path, extension, "bufferView", kDraco), "Draco");
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  const auto type = draco::Decoder::GetEncodedGeometryType(&buffer);
  if (!type.ok() || type.value() != draco::TRIANGULAR_MESH) fail(path, "has a Draco mesh that is damaged");
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) fail(path, "has a Draco mesh that is damaged: " + decoded.status().error_msg_string());
  state_->mesh = std::move(decoded).value();
  check_limits(path, state_->mesh->num_points(), state_->mesh->num_faces(), limits);
  state_->attributes = extension.Get("attributes");
}

DracoMesh::~DracoMesh() = default;

std::vector<glm::uvec3> DracoMesh::triangles() const {
  const draco::Mesh& mesh = *state_->mesh;
  std::vector<glm::uvec3> result;
  for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh.face(f);
    const glm::uvec3 t(face[0].value(), face[1].value(), face[2].value());
    if (t.x >= mesh.num_points() || t.y >= mesh.num_points() || t.z >= mesh.num_points()) {
      fail(path_, "has a Draco mesh with an index beyond its vertices");
    }
    result.push_back(t);
  }
  return result;
}

namespace {

// Draco's own flag for fractions is not what counts, and its -128/127 is not in [-1, 1].
bool read_value(const draco::PointAttribute& source, draco::AttributeValueIndex value, bool is_normalized,
                std::span<float> to) {
  const auto count = static_cast<std::uint8_t>(to.size());
  if (!draco::IsDataTypeIntegral(source.data_type())) {
    return source.ConvertValue<float>(value, count, to.data());
  }
  std::array<std::int64_t, 4> whole{};
  if (!source.ConvertValue<std::int64_t>(value, count, whole.data())) return false;
  const int bits = 8 * draco::DataTypeLength(source.data_type());
  const bool is_signed = source.data_type() == draco::DT_INT8 || source.data_type() == draco::DT_INT16 ||
                         source.data_type() == draco::DT_INT32 || source.data_type() == draco::DT_INT64;
  const double one = std::ldexp(1.0, is_signed ? bits - 1 : bits) - 1.0;
  for (std::size_t k = 0; k < to.size(); ++k) {
    const auto number = static_cast<double>(whole[k]);
    to[k] = static_cast<float>(is_normalized ? std::max(number / one, -1.0) : number);
  }
  return true;
}

}  // namespace

Numbers DracoMesh::numbers(const std::string& attribute, int components,
                           const tinygltf::Accessor& accessor) const {
  if (!state_->attributes.IsObject() || !state_->attributes.Has(attribute)) return {};
  const draco::Mesh& mesh = *state_->mesh;
  const std::uint64_t id = whole_number(path_, state_->attributes, attribute.c_str(), kDraco);
  const draco::PointAttribute* source = mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(id));
  if (source == nullptr) fail(path_, "has a Draco mesh without the attribute " + attribute);
  const int count = source->num_components();
  const bool fits = components == 0 ? count == 3 || count == 4 : count == components;
  if (!fits || count > 4) {
    fail(path_, "has a Draco mesh whose " + attribute + " has " + std::to_string(count) + " components");
  }
  Numbers result;
  result.count = mesh.num_points();
  result.components = count;
  result.values.resize(result.count * static_cast<std::size_t>(count));
  for (draco::PointIndex point(0); point < mesh.num_points(); ++point) {
    const draco::AttributeValueIndex value = source->mapped_index(point);
    const auto to = std::span(result.values)
                        .subspan(std::size_t{point.value()} * static_cast<std::size_t>(count),
                                 static_cast<std::size_t>(count));
    if (value.value() >= source->size() || !read_value(*source, value, accessor.normalized, to)) {
      fail(path_, "has a Draco mesh whose " + attribute + " is damaged");
    }
  }
  return result;
}

void decompress_views(const std::string& path, tinygltf::Model& model) {
  for (std::size_t i = 0; i < model.bufferViews.size(); ++i) {
    tinygltf::BufferView& view = model.bufferViews[i];
    const auto found = view.extensions.find(kMeshopt);
    if (found == view.extensions.end() || !found->second.IsObject()) continue;
    const tinygltf::Value& e = found->second;
    const std::string where = "meshopt buffer view " + std::to_string(i);
    const auto number = [&](const char* key) { return whole_number(path, e, key, kMeshopt); };
    const std::vector<unsigned char>& source =
        element(path, model.buffers, index_number(path, e, "buffer", kMeshopt), where + " buffer").data;
    const std::uint64_t offset = number("byteOffset");
    const std::uint64_t length = number("byteLength");
    const std::uint64_t stride = number("byteStride");
    const std::uint64_t count = number("count");
    if (offset > source.size() || length > source.size() - offset)
      fail(path, where + " ends beyond its buffer");
    // Each block of the codec has a header of a quarter of a byte for 16 elements, so that sizes are bounded
    // by the file's.
    if (stride == 0 || stride > 256 || count > 64 * length || count * stride != view.byteLength) {
      fail(path, where + " has " + std::to_string(count) + " elements of " + std::to_string(stride) +
                     " bytes, which its sizes do not allow");
    }
    const std::string mode = e.Get("mode").IsString() ? e.Get("mode").Get<std::string>() : "";
    const std::string filter = e.Get("filter").IsString() ? e.Get("filter").Get<std::string>() : "NONE";
    std::vector<unsigned char> decoded(count * stride);
    const unsigned char* from = source.data() + offset;
    int failure = 1;
    if (mode == "ATTRIBUTES" && stride % 4 == 0) {
      failure = meshopt_decodeVertexBuffer(decoded.data(), count, stride, from, length);
    } else if (mode == "TRIANGLES" && (stride == 2 || stride == 4) && count % 3 == 0) {
      failure = meshopt_decodeIndexBuffer(decoded.data(), count, stride, from, length);
    } else if (mode == "INDICES" && (stride == 2 || stride == 4)) {
      failure = meshopt_decodeIndexSequence(decoded.data(), count, stride, from, length);
    }
    if (failure != 0) fail(path, where + " is damaged: mode '" + mode.substr(0, 40) + "'");
    if (filter == "OCTAHEDRAL" && (stride == 4 || stride == 8)) {
      meshopt_decodeFilterOct(decoded.data(), count, stride);
    } else if (filter == "QUATERNION" && stride == 8) {
      meshopt_decodeFilterQuat(decoded.data(), count, stride);
    } else if (filter == "EXPONENTIAL" && stride % 4 == 0) {
      meshopt_decodeFilterExp(decoded.data(), count, stride);
    } else if (filter != "NONE") {
      fail(path, where + " has the filter '" + filter.substr(0, 40) + "', which does not fit its stride");
    }
    tinygltf::Buffer buffer;
    buffer.data = std::move(decoded);
    view.buffer = static_cast<int>(model.buffers.size());
    view.byteOffset = 0;
    model.buffers.push_back(std::move(buffer));
  }
}

}  // namespace mirrorbake::gltf
