#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "image_files.hpp"
#include "openimageio.hpp"

namespace mirrorbake::image_files {

/// What OpenImageIO reads a file by: its bytes, with metadata covered.
class GuardedBytes : public OIIO::Filesystem::IOProxy {
 public:
  GuardedBytes(const std::string& name, std::shared_ptr<const Bytes> bytes, std::vector<Patch> patches)
      : IOProxy(name, Read), bytes_(std::move(bytes)), patches_(std::move(patches)) {}
  const char* proxytype() const override { return "mirrorbake"; }
  std::size_t size() const override { return bytes_->size(); }
  std::size_t read(void* to, std::size_t count) override;
  std::size_t pread(void* to, std::size_t count, std::int64_t offset) override;

 private:
  std::shared_ptr<const Bytes> bytes_;
  std::vector<Patch> patches_;
};

/// An open file. The bytes outlive their reader.
struct OpenInput {
  /// Of JPEG files: their reader accepts no other proxy than one of memory
  std::vector<unsigned char> memory;
  std::unique_ptr<OIIO::Filesystem::IOProxy> bytes;
  std::unique_ptr<OIIO::ImageInput> input;
  OIIO::ImageInput* operator->() const { return input.get(); }
};

/// Opens a file, its alpha unassociated, and describes it. Throws FileError.
OpenInput open_input(const std::string& name, FileKind kind, std::shared_ptr<const Bytes> bytes, Guard guard,
                     Header& header);

/// Opens a file by its content. Throws FileError for what load_image refuses, but for damaged pixels.
OpenInput open_checked(const std::string& path, const ImageLimits& limits, Header& header);

// The functions of the interface OpenImageIo.
std::unique_ptr<Reader> open_file(const std::string& name, FileKind kind, std::shared_ptr<const Bytes> bytes,
                                  Guard guard);
SaveReport save_file(const SaveRequest& request);
std::unique_ptr<Texture> open_texture_file(const std::string& path, Transfer transfer,
                                           const ImageLimits& limits);
void set_cache_bytes(std::uint64_t bytes);

}  // namespace mirrorbake::image_files
