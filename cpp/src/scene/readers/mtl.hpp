#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/vec3.hpp>

#include "mirrorbake/scene/scene.hpp"
#include "scene_builder.hpp"

/// Material libraries of OBJ files (Wavefront, "MTL material format", Advanced Visualizer 4.2 manual, 1995).
namespace mirrorbake::mtl {

/// The use of an image, without its number.
struct Map {
  std::string file;  ///< as written, "/" between folders; empty: none
  TextureReference transform;
  TextureWrap wrap = TextureWrap::repeat;
};

struct Definition {
  std::string name;
  std::optional<glm::vec3> diffuse;   ///< Kd
  glm::vec3 specular{0.0F};           ///< Ks
  glm::vec3 emission{0.0F};           ///< Ke
  std::optional<float> exponent;      ///< Ns
  std::optional<float> index;         ///< Ni
  std::optional<int> illumination;    ///< illum
  std::optional<float> dissolve;      ///< d
  std::optional<float> transparency;  ///< Tr, 1 − d; d counts where a file has both
  Map diffuse_map, specular_map, emission_map, dissolve_map;
};

/// The first word of a line, and the rest without the spaces around it.
std::pair<std::string_view, std::string_view> split_keyword(std::string_view line);

/// Reads a library. Lines with numbers that are missing, not finite or out of range are left out with a
/// warning: every loader does, and so do the programs that write such lines.
std::vector<Definition> parse(std::string_view text, Warnings& warnings);

/// The material with its maps' transforms, but not yet their textures.
Material material_from(const std::string& path, const Definition& definition, Warnings& warnings);

}  // namespace mirrorbake::mtl
