#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec3.hpp>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/scene/scene.hpp"

/// Meshes and scenes from files (OBJ, glTF 2.0 through tinygltf; their parsers stay behind this header).
/// Files are hostile until read: what the functions take is bounded by the sizes of the files and the limits
/// given, and they refer to nothing outside the file's own directory.
namespace mirrorbake {

struct MeshLimits {
  std::uint64_t max_vertices = 50'000'000;
  std::uint64_t max_triangles = 50'000'000;
};

/// Reads every triangle of an .obj, .gltf or .glb file into one mesh (one part), polygons triangulated, node
/// transforms applied, instances copied. Vertex normals that the file lacks are made by angle-weighted
/// averaging; degenerate triangles and unused vertices are dropped. Throws FileError if the file is missing,
/// corrupt, empty, beyond `limits`, requires an unknown extension, refers to files outside its directory, has
/// NaN or infinite vertices or normals, indices or offsets out of range, or no triangle with an area. The
/// memory it takes is bounded by the sizes of the files and `limits`. `origin`: as in SceneOptions.
TriangleMesh load_mesh(const std::string& path, const MeshLimits& limits = {},
                       glm::dvec3 origin = glm::dvec3(0.0));

struct SceneOptions {
  MeshLimits meshes;  ///< of all objects together
  int max_texture_side = 16384;
  std::uint64_t max_texture_bytes = std::uint64_t{4} << 30;  ///< of all textures in memory together
  /// Images in files of their own that would take more than this in memory are read through the cache of
  /// texture files instead; not those from which textures are made.
  std::uint64_t cache_textures_above = std::uint64_t{64} << 20;
  /// glTF measures light in candela, lux and nits. Its numbers are divided by this many lumens per watt: 1
  /// takes them as they are, 683 gives watts of green light, as Blender's exporter assumes.
  float luminous_efficacy = 1.0F;
  /// Place in the file's world that becomes the scene's zero, coordinates up to 1e12. It is subtracted before
  /// positions are rounded to float, so that a scene far from its file's origin keeps its details.
  glm::dvec3 origin{0.0};
};

/// A viewpoint that a scene file proposes.
struct SceneCamera {
  std::string name;
  glm::vec3 eye{0.0F};
  glm::vec3 direction{0.0F, 0.0F, -1.0F};  ///< unit, of the view
  glm::vec3 up{0.0F, 1.0F, 0.0F};          ///< unit, upright to `direction`
  float vertical_fov_degrees = 40.0F;
};

/// Something in a file that the scene does not show, and how often it occurs.
struct SceneWarning {
  std::string message;
  std::uint64_t count = 1;
};

struct LoadedScene {
  Scene scene;
  std::vector<SceneCamera> cameras;
  std::vector<SceneWarning> warnings;  ///< in the order of their first occurrence
};

/// Reads an .obj (with its .mtl), .gltf or .glb file. There is one object per glTF node or OBJ object and
/// material, with the node's or object's name; "/" and the material's follow where it has several, and "#2"
/// where a name repeats. docs/reference/scene-files.md has the whole mapping of materials and lights. The
/// result passes validate(). Throws FileError as load_mesh does, and for material and light parameters that
/// are not finite or out of range, images that are missing, corrupt or larger than the options allow;
/// InvalidArgument for options out of range.
LoadedScene load_scene(const std::string& path, const SceneOptions& options = {});

/// Which of the two functions reads a file.
enum class FileContent { mesh, scene };

template <>
struct EnumNames<FileContent> {
  static constexpr std::string_view what = "content";
  static constexpr auto names = enum_names("mesh", "scene");
};

/// The files beside `path` that load_mesh or load_scene would read: the external buffers of a glTF file and,
/// for a scene, its images, or the material libraries of an OBJ file and their images. Absolute, each once,
/// in the order of the references; not those that do not exist. Throws FileError if `path` or a library is
/// missing or corrupt.
std::vector<std::string> referenced_files(const std::string& path, FileContent content);

}  // namespace mirrorbake
