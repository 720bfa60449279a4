#pragma once

#include <memory>
#include <string>
#include <vector>

#include <tiny_gltf.h>

#include <glm/vec3.hpp>

#include "gltf_document.hpp"
#include "mirrorbake/scene/load.hpp"

/// Compressed meshes: KHR_draco_mesh_compression through Draco, EXT_meshopt_compression through
/// meshoptimizer.
namespace mirrorbake::gltf {

inline constexpr const char* kDraco = "KHR_draco_mesh_compression";
inline constexpr const char* kMeshopt = "EXT_meshopt_compression";

/// A decoded primitive.
class DracoMesh {
 public:
  /// `extension` is the object of that name in the primitive. Throws FileError for what Draco cannot decode
  /// and beyond `limits`.
  DracoMesh(const std::string& path, const tinygltf::Model& model, const tinygltf::Value& extension,
            const MeshLimits& limits);
  ~DracoMesh();
  DracoMesh(const DracoMesh&) = delete;
  DracoMesh& operator=(const DracoMesh&) = delete;

  std::vector<glm::uvec3> triangles() const;
  /// Rows of an attribute, empty if the primitive lacks it; `components` 0 stands for 3 or 4. What whole
  /// numbers stand for is the accessor's to say, as if they were not compressed.
  Numbers numbers(const std::string& attribute, int components, const tinygltf::Accessor& accessor) const;

 private:
  struct State;
  const std::string& path_;
  std::unique_ptr<State> state_;
};

/// Decodes the buffer views that are compressed by meshoptimizer into buffers of their own, and lets the
/// views refer to them. Throws FileError if one cannot be decoded.
void decompress_views(const std::string& path, tinygltf::Model& model);

}  // namespace mirrorbake::gltf
