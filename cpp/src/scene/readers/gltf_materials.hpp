#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <glm/vec3.hpp>

#include <tiny_gltf.h>

#include "mirrorbake/scene/load.hpp"
#include "scene_builder.hpp"

namespace mirrorbake::gltf {

/// Finite number of a property of an extension's object, or the default if it is absent. Throws FileError.
double number_property(const std::string& path, const tinygltf::Value& object, const char* key,
                       double default_value, const std::string& what);

/// Turns glTF's metallic-roughness materials into the scene's, with their textures.
class MaterialReader {
 public:
  MaterialReader(const std::string& path, const tinygltf::Model& model, const SceneOptions& options,
                 Warnings& warnings, Scene& scene);

  /// Appends the material of this number (−1: the default one) and its textures to the scene; returns its
  /// place there.
  int add(int material);

  /// The set of texture coordinates that the material's textures use: the first one's; others are counted.
  int uv_set(int material);

 private:
  // A use of a texture: an image with its wrap modes and transform.
  struct Use {
    int image = -1;
    TextureWrap wrap_u = TextureWrap::repeat;
    TextureWrap wrap_v = TextureWrap::repeat;
    TextureReference transform;
    int uv_set = 0;

    bool same_coordinates(const Use& other) const;
  };
  struct Parameters;

  std::optional<Use> use_of(int texture, int uv_set, const tinygltf::ExtensionMap& extensions,
                            const std::string& what) const;
  Parameters parameters(const tinygltf::Material& material, const std::string& where);
  Material convert(const tinygltf::Material& material, const std::string& where);
  void set_colours(const Parameters& p, Material& result);
  void set_roughness(const Parameters& p, Material& result);
  void set_opacity(const tinygltf::Material& material, const Parameters& p, const std::string& where,
                   Material& result);
  void set_normal(const tinygltf::Material& material, const std::string& where, Material& result);
  void warn_of_what_is_lost(const tinygltf::Material& material);

  std::string image_file(const tinygltf::Image& image) const;
  /// read(name, bytes) of an image's file, wherever it is stored.
  template <typename Read>
  auto read_image(int image, const Read& read) const;
  Image decode(int image, Transfer transfer);
  TextureReference plain_texture(const Use& use);  ///< of a colour image as it is
  /// The texture of this name, made only once; `make` may give none.
  template <typename Make>
  TextureReference made_texture(const Use& use, const std::string& name, const Make& make);

  const std::string& path_;
  const tinygltf::Model& model_;
  Warnings& warnings_;
  Scene& scene_;
  float nits_per_radiance_;
  TextureReader reader_;
  std::map<std::string, int> texture_of_;
};

}  // namespace mirrorbake::gltf
