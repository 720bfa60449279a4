#pragma once

#include <functional>
#include <string>

#include <tiny_gltf.h>

#include "loaded_mesh.hpp"

namespace mirrorbake::gltf {

/// The set of texture coordinates (TEXCOORD_n) that a material's textures use; −1 is the default material.
using UvSetOfMaterial = std::function<int(int material)>;

/// All meshes of the document's default scene, relative to `origin`, instances copied. Throws FileError.
LoadedMesh read_meshes(const std::string& path, const tinygltf::Model& model, const MeshLimits& limits,
                       glm::dvec3 origin, const UvSetOfMaterial& uv_set);

}  // namespace mirrorbake::gltf
