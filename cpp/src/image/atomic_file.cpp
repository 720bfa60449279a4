#include "mirrorbake/image/atomic_file.hpp"

#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake {
namespace fs = std::filesystem;

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)) {
  if (path_.empty()) throw FileError("''", "an output path may not be empty");
  std::error_code error;
  if (fs::is_directory(path_, error)) throw FileError(path_, "is a directory");
  // A rename would replace the device itself.
  if (fs::is_other(path_, error)) throw FileError(path_, "is a device or a pipe, expected a file");
  const fs::path folder = fs::path(path_).parent_path();
  if (!folder.empty() && !fs::is_directory(folder, error)) {
    throw FileError(path_, "the folder " + folder.string() + " does not exist");
  }
  // Process and counter make the name unique among everyone who writes to the folder of one machine.
  static std::atomic<unsigned> counter{0};
  const std::string name = "." + fs::path(path_).filename().string() + "." + std::to_string(::getpid()) +
                           "-" + std::to_string(counter++) + ".part";
  temporary_ = (folder / name).string();
}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  if (!committed_) fs::remove(temporary_, ignored);
}

void AtomicFile::commit() {
  std::error_code error;
  fs::rename(temporary_, path_, error);
  if (error) throw FileError(path_, "cannot be written: " + error.message());
  committed_ = true;
}

void write_file(const std::string& path, std::span<const std::byte> bytes) {
  AtomicFile file(path);
  std::ofstream out(file.temporary(), std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw FileError(path, "cannot be written");
  file.commit();
}

}  // namespace mirrorbake
