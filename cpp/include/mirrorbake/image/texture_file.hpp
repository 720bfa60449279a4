#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mirrorbake/core/enum_names.hpp"
#include "mirrorbake/image/image_io.hpp"

namespace mirrorbake {

/// How a coordinate outside [0,1] finds a texel: tiled, the border's, or tiled with every second tile
/// mirrored.
enum class TextureWrap { repeat, clamp, mirror };

template <>
struct EnumNames<TextureWrap> {
  static constexpr std::string_view what = "wrap";
  static constexpr auto names = enum_names("repeat", "clamp", "mirror");
};

/// An image file whose texels are read when a lookup needs them, through OpenImageIO's texture system: tiles
/// of 64 × 64 texels of MIP levels in a cache of bounded size that all texture files share. Files without MIP
/// levels get theirs by averaging 2 × 2 linear texels. Lookups may run from several threads at once.
class TextureFile {
 public:
  /// Reads the file once from end to end to check it. Colour or grey in [0,1]; alpha is dropped. 8-bit texels
  /// that are decoded from sRGB are kept as halves: within 5e-4 of load_image's. Throws FileError for what
  /// load_image refuses, values outside [0,1], and images that are cropped or have other channels.
  explicit TextureFile(const std::string& path, Transfer transfer = Transfer::automatic,
                       const ImageLimits& limits = {});
  ~TextureFile();
  TextureFile(const TextureFile&) = delete;
  TextureFile& operator=(const TextureFile&) = delete;

  const std::string& path() const;
  int width() const;
  int height() const;
  glm::vec3 mean() const;  ///< of the finest level's texels

  /// Value at `uv`, v up. `footprint` is the width of the filter in texture coordinates: 0 interpolates the
  /// finest level bilinearly, larger ones two MIP levels. Throws FileError if the file has gone or changed
  /// since.
  glm::vec3 lookup(glm::vec2 uv, float footprint, TextureWrap wrap_u, TextureWrap wrap_v) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Bounds the cache of all texture files together; 1 GiB until it is set. At least 16 MiB, or throws
/// InvalidArgument.
void set_texture_cache_bytes(std::uint64_t bytes);

}  // namespace mirrorbake
