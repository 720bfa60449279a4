#include "image_files.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <initializer_list>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake::image_files {

// Only these readers ever see a file: OpenImageIO left to itself tries all of its plugins on one it does not
// recognise.
FileKind kind_of(const std::string& name, const Bytes& bytes) {
  std::array<unsigned char, 12> head{};
  const std::size_t size = bytes.read(0, head);
  const auto has = [&](std::size_t place, std::initializer_list<int> magic) {
    return size >= place + magic.size() &&
           std::equal(magic.begin(), magic.end(), head.begin() + static_cast<std::ptrdiff_t>(place),
                      [](int a, unsigned char b) { return a == b; });
  };
  const auto starts_with = [&](std::initializer_list<int> magic) { return has(0, magic); };
  if (starts_with({0x76, 0x2f, 0x31, 0x01})) return FileKind::exr;
  if (starts_with({'#', '?'})) return FileKind::hdr;
  if (starts_with({'I', 'I', 42, 0}) || starts_with({'I', 'I', 43, 0}) || starts_with({'M', 'M', 0, 42}) ||
      starts_with({'M', 'M', 0, 43})) {
    return FileKind::tiff;
  }
  if (starts_with({0x89, 'P', 'N', 'G', 0x0d, 0x0a, 0x1a, 0x0a})) return FileKind::png;
  if (starts_with({0xff, 0xd8, 0xff})) return FileKind::jpeg;
  if (starts_with({'R', 'I', 'F', 'F'}) && has(8, {'W', 'E', 'B', 'P'})) return FileKind::webp;
  throw FileError(name, "is not an EXR, HDR, TIFF, PNG, JPEG or WebP image");
}

std::optional<FileKind> known_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".exr") return FileKind::exr;
  if (extension == ".hdr") return FileKind::hdr;
  if (extension == ".tif" || extension == ".tiff") return FileKind::tiff;
  if (extension == ".png") return FileKind::png;
  if (extension == ".jpg" || extension == ".jpeg") return FileKind::jpeg;
  return std::nullopt;
}

FileKind kind_from_extension(const std::string& path) {
  if (const std::optional<FileKind> kind = known_extension(path)) return *kind;
  throw FileError(path, "has an unknown extension, expected .exr, .hdr, .tif, .tiff, .png, .jpg or .jpeg");
}

Guard guard_of(const std::string& name, FileKind kind, const Bytes& bytes) {
  switch (kind) {
    case FileKind::png: return guard_png(name, bytes);
    case FileKind::jpeg: return guard_jpeg(name, bytes);
    case FileKind::tiff: return guard_tiff(name, bytes);
    case FileKind::exr:
    case FileKind::hdr:
    case FileKind::webp: break;
  }
  return {};
}

void check_limits(const std::string& path, const Header& header, const ImageLimits& limits) {
  const int channels = header.channel_count();
  for (const Window& window :
       {header.data, header.display, header.tile == Window{} ? header.data : header.tile}) {
    const std::string size = size_text(window.width, window.height, channels);
    if (window.width < 1 || window.height < 1 || channels < 1) throw FileError(path, "is empty: " + size);
    const bool too_wide =
        window.width > limits.max_side || window.height > limits.max_side || channels > limits.max_channels;
    // Sides and channels are bounded by then, so that the product cannot overflow.
    if (too_wide || static_cast<std::uint64_t>(window.width) * static_cast<std::uint64_t>(window.height) *
                            static_cast<std::uint64_t>(channels) * sizeof(float) >
                        limits.max_bytes) {
      throw FileError(path, "is too large: " + size + ", the limits are " + std::to_string(limits.max_side) +
                                " a side, " + std::to_string(limits.max_channels) + " channels and " +
                                std::to_string(limits.max_bytes >> 20) + " MiB");
    }
  }
}

void check_expansion(const std::string& name, const Header& header, std::uint64_t size) {
  if (header.expansion == 0) return;
  const auto texels = [](const Window& window) {
    return static_cast<std::uint64_t>(window.width) * static_cast<std::uint64_t>(window.height);
  };
  const std::uint64_t claimed =
      std::max(texels(header.data), header.expands_to_display ? texels(header.display) : 0);
  if (claimed * header.pixel_bits / 8 / header.expansion > size) {
    throw FileError(name, "claims " +
                              size_text(header.data.width, header.data.height, header.channel_count()) +
                              ", more than its " + std::to_string(size) + " bytes can hold");
  }
}

bool is_srgb(const Header& header, Transfer transfer) {
  if (transfer == Transfer::automatic) return header.is_integer && !header.says_linear;
  return transfer == Transfer::srgb;
}

std::string size_text(std::int64_t width, std::int64_t height, int channels) {
  return std::to_string(width) + " x " + std::to_string(height) + " pixels of " + std::to_string(channels) +
         " channels";
}

std::string one_line(std::string text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.pop_back();
  for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at)) {
    text.replace(at, 1, "; ");
  }
  return text;
}

}  // namespace mirrorbake::image_files
