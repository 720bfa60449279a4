#pragma once

#include <cstdint>
#include <string>

#include "mirrorbake/scene/scene.hpp"

/// Meshes from files (OBJ through tinyobjloader, glTF 2.0 through tinygltf, both behind this header).
namespace mirrorbake {

struct MeshLimits {
  std::uint64_t max_vertices = 50'000'000;
  std::uint64_t max_triangles = 50'000'000;
};

/// Reads every triangle of an .obj, .gltf or .glb file into one mesh (one part), polygons triangulated, node
/// transforms applied, instances copied. Vertex normals that the file lacks are made by angle-weighted averaging;
/// degenerate triangles and unused vertices are dropped. Throws FileError if the file is missing, corrupt, empty,
/// beyond `limits`, requires an unknown extension, refers to files outside its directory, has NaN or infinite
/// vertices or normals, indices or offsets out of range, or no triangle with an area. The memory it takes is bounded
/// by the sizes of the files and `limits`.
TriangleMesh load_mesh(const std::string& path, const MeshLimits& limits = {});

}  // namespace mirrorbake
