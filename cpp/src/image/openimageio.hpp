#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "image_files.hpp"
#include "mirrorbake/image/texture_file.hpp"

/// OpenImageIO behind an interface, in a library of its own that is loaded when one of these is needed first:
/// with what it depends on it takes a third of a second and 260 libraries to load, which EXR files do
/// without.
namespace mirrorbake::image_files {

/// What save_image was asked for, checked.
struct SaveRequest {
  std::string path;  ///< for errors
  std::string file;  ///< where to write
  FileKind kind = FileKind::hdr;
  PixelFormat format = PixelFormat::automatic;
  int width = 0;
  int height = 0;
  std::span<const std::string> channels;
  std::span<const float> pixels;
};

/// What TextureFile is made of.
class Texture {
 public:
  virtual ~Texture() = default;
  virtual int width() const = 0;
  virtual int height() const = 0;
  virtual glm::vec3 mean() const = 0;
  virtual glm::vec3 lookup(glm::vec2 uv, float footprint, TextureWrap wrap_u, TextureWrap wrap_v) const = 0;
};

/// All of them throw FileError. Objects of these types and exceptions cross from one library to the other:
/// both have to be built by one compiler, which the name of the entry point cannot say but the version in it
/// can.
class OpenImageIo {
 public:
  virtual ~OpenImageIo() = default;
  /// `name` stands for the path in errors.
  virtual std::unique_ptr<Reader> open(const std::string& name, FileKind kind,
                                       std::shared_ptr<const Bytes> bytes, Guard guard) const = 0;
  virtual SaveReport save(const SaveRequest& request) const = 0;
  virtual std::unique_ptr<Texture> open_texture(const std::string& path, Transfer transfer,
                                                const ImageLimits& limits) const = 0;
  virtual void set_texture_cache_bytes(std::uint64_t bytes) const = 0;
};

/// Loads the library once. Throws FileError that names it and says why it cannot be loaded.
const OpenImageIo& openimageio();

}  // namespace mirrorbake::image_files
