#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "loaded_mesh.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/scene/load.hpp"

/// What the readers of whole scenes have in common.
namespace mirrorbake {

/// Counts what a scene does not show.
class Warnings {
 public:
  void add(const std::string& message, std::uint64_t count = 1);
  std::vector<SceneWarning> take() { return std::move(warnings_); }

 private:
  std::map<std::string, std::size_t> index_;
  std::vector<SceneWarning> warnings_;
};

/// Decodes images within the options' limits on all of them together.
class TextureReader {
 public:
  TextureReader(const SceneOptions& options, Warnings& warnings) : options_(options), warnings_(warnings) {}

  /// Colour or grey in [0,1], without alpha. Values beyond 1, which only images of floats have, are divided
  /// by the largest, which is returned in `largest` (1 if there are none), or else cut off and counted.
  /// Throws FileError for what decode_image refuses, values that are not finite or negative, and when the
  /// limits are exceeded.
  Image read(const std::string& name, std::span<const unsigned char> bytes, Transfer transfer,
             float* largest = nullptr);

  /// The alpha channel of an image, or else, if `grey_counts`, its first channel; none if the surface is
  /// opaque everywhere. Errors as for read().
  std::optional<Image> read_opacity(const std::string& name, std::span<const unsigned char> bytes,
                                    bool grey_counts);

  /// The texture of an image file that is used as it is: in memory, or through the cache if it is large.
  /// Large ones beyond 1 are an error.
  Texture read_file_texture(const std::string& path, Transfer transfer, float* largest = nullptr);

  /// Takes room for a texture that is made here. Throws FileError(name) beyond the limits.
  void reserve(const std::string& name, int width, int height, int channels);
  /// Gives the room of an image back that is not kept.
  void release(const Image& image);

 private:
  Image decode(const std::string& name, std::span<const unsigned char> bytes, Transfer transfer,
               AlphaUse alpha);

  const SceneOptions& options_;
  Warnings& warnings_;
  std::uint64_t bytes_ = 0;
};

/// Throws FileError unless each component is finite and at least 0; what is above 1 is taken as 1 and
/// counted.
glm::vec3 reflectance(const std::string& path, const std::string& what, glm::vec3 value, Warnings& warnings);
/// Throws FileError unless each component is finite and at least 0.
glm::vec3 radiance(const std::string& path, const std::string& what, glm::vec3 value);

/// One object per owner and material, in the order in which they first occur. `material_of` gives the scene's
/// material for the file's; the names of materials are the scene's.
std::vector<Object> split_into_objects(LoadedMesh&& loaded, const std::vector<Material>& materials,
                                       const std::map<int, int>& material_of);

}  // namespace mirrorbake
