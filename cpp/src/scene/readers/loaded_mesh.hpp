#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "mirrorbake/scene/load.hpp"
#include "mirrorbake/scene/scene.hpp"

/// What the readers of OBJ and glTF have in common.
namespace mirrorbake {

/// A stretch of triangles that belong together in the file.
struct MeshGroup {
  std::string name;
  int owner = 0;                   ///< number of the glTF node or OBJ object
  int material = -1;               ///< index into the file's materials, −1: none
  std::size_t first_triangle = 0;  ///< up to the next group's
};

/// Everything in one mesh in world space, with its groups in order. Normals and uvs are complete or empty.
struct LoadedMesh {
  TriangleMesh mesh;
  std::vector<MeshGroup> groups;
};

/// What an OBJ file says besides its triangles.
struct ObjContent {
  std::vector<std::string> materials;  ///< names of those that its groups use, by number
  std::vector<std::string> libraries;  ///< what follows each `mtllib`
  std::uint64_t lines = 0;
  std::uint64_t points = 0;
  std::uint64_t curves = 0;       ///< and surfaces
  std::uint64_t short_faces = 0;  ///< of one or two corners
  std::uint64_t colors = 0;       ///< vertices that have one
};

/// As read_obj, with what else the file says.
LoadedMesh read_obj_content(const std::string& path, const MeshLimits& limits, glm::dvec3 origin,
                            ObjContent& content);

/// Throws InvalidArgument unless an origin is usable.
void check_origin(glm::dvec3 origin);

/// Throws FileError naming the first vertex, from number `first` on, that is not finite or beyond what a
/// scene accepts.
void check_positions(const std::string& path, const std::vector<glm::vec3>& positions, std::size_t first = 0);

/// Throws FileError if one vertex or triangle more than `vertices` and `triangles` is beyond `limits`.
void check_limits(const std::string& path, std::uint64_t vertices, std::uint64_t triangles,
                  const MeshLimits& limits);

/// Gives every vertex whose normal is missing (shorter than 1e-6) the mean of the facet normals around it,
/// weighted with the angle of the facet (Thürmer and Wüthrich, "Computing vertex normals from polygonal
/// facets", JGT 3(1), 1998). Vertices at the same place count as one (files often split them for texture
/// coordinates) if their entries of `smoothing`, one per vertex or none at all, are equal. Others are
/// normalised.
void complete_normals(TriangleMesh& mesh, std::span<const std::uint64_t> smoothing = {});

/// Drops triangles without area and then vertices that no triangle uses. Throws FileError if nothing remains.
void drop_degenerate(const std::string& path, LoadedMesh& loaded);

}  // namespace mirrorbake
