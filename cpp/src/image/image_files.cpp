#include "image_files.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"

namespace mirrorbake::image_files {

namespace {

std::string lower_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

}  // namespace

const ImageKind& row_of(FileKind kind) {
  return *std::find_if(kImageKinds.begin(), kImageKinds.end(),
                       [&](const ImageKind& row) { return row.kind == kind; });
}

// Only these readers ever see a file: OpenImageIO left to itself tries all of its plugins on one it does not
// recognise.
FileKind kind_of(const std::string& name, const Bytes& bytes) {
  std::array<unsigned char, kHeadBytes> buffer{};
  const std::size_t size = bytes.read(0, buffer);
  const std::string head(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size));
  std::vector<std::string> known;
  for (const ImageKind& row : kImageKinds) {
    if (row.begins(head)) return row.kind;
    known.emplace_back(row.name);
  }
  throw FileError(name, "is not an " + listed(known) + " image");
}

std::optional<FileKind> known_extension(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension.empty()) return std::nullopt;
  for (const ImageKind& row : kImageKinds) {
    if (std::find(row.extensions.begin(), row.extensions.end(), extension) != row.extensions.end()) {
      return row.kind;
    }
  }
  return std::nullopt;
}

FileKind kind_from_extension(const std::string& path) {
  if (const std::optional<FileKind> kind = known_extension(path)) return *kind;
  std::vector<std::string> known;
  for (const ImageKind& row : kImageKinds) {
    for (const std::string_view extension : row.extensions) {
      if (!extension.empty()) known.emplace_back(extension);
    }
  }
  throw FileError(path, "has an unknown extension, expected " + listed(known));
}

Guard guard_of(const std::string& name, FileKind kind, const Bytes& bytes) {
  const ImageKind& row = row_of(kind);
  return row.guard == nullptr ? Guard{} : row.guard(name, bytes);
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
