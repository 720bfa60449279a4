#include "file_bytes.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace fs = std::filesystem;

std::string read_file(const fs::path& path) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (status.type() == fs::file_type::not_found) throw FileError(path.string(), "no such file");
  if (!fs::is_regular_file(status)) throw FileError(path.string(), "not a regular file");
  const std::uintmax_t size = fs::file_size(path, code);
  if (code) throw FileError(path.string(), "cannot be read: " + code.message());
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw FileError(path.string(), std::string("cannot be opened: ") + std::strerror(errno));
  std::string bytes(static_cast<std::size_t>(size), '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (static_cast<std::uintmax_t>(stream.gcount()) != size)
    throw FileError(path.string(), "cannot be read to its end");
  return bytes;
}

std::optional<fs::path> resolve_inside(const fs::path& directory, const std::string& reference) {
  const fs::path relative(reference);
  if (reference.empty() || reference.find('\0') != std::string::npos || relative.is_absolute())
    return std::nullopt;
  std::error_code code;
  const fs::path root = fs::weakly_canonical(directory.empty() ? fs::path(".") : directory, code);
  if (code) return std::nullopt;
  fs::path target = fs::weakly_canonical(root / relative, code);
  if (code) return std::nullopt;
  const auto [in_root, in_target] = std::mismatch(root.begin(), root.end(), target.begin(), target.end());
  if (in_root != root.end()) return std::nullopt;
  return target;
}

}  // namespace mirrorbake
