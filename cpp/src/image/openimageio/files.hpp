#pragma once

#include <OpenImageIO/imageio.h>

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "image_files.hpp"
#include "openimageio.hpp"

namespace mirrorbake::image_files {

/// Opens a file, or what `proxy` reads, its alpha unassociated, and describes it. Throws FileError.
std::unique_ptr<OIIO::ImageInput> open_input(const std::string& path, FileKind kind,
                                             OIIO::Filesystem::IOProxy* proxy, Header& header);

/// Opens a file by its content. Throws FileError for what load_image refuses, but for damaged pixels.
std::unique_ptr<OIIO::ImageInput> open_checked(const std::string& path, const ImageLimits& limits,
                                               Header& header);

// The functions of the interface OpenImageIo.
std::unique_ptr<Reader> open_file(const std::string& path, FileKind kind,
                                  std::optional<std::span<const unsigned char>> memory);
SaveReport save_file(const SaveRequest& request);
std::unique_ptr<Texture> open_texture_file(const std::string& path, Transfer transfer,
                                           const ImageLimits& limits);
void set_cache_bytes(std::uint64_t bytes);

}  // namespace mirrorbake::image_files
