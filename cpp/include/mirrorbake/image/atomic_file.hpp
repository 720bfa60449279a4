#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace mirrorbake {

/// A file that appears under its name only when it is complete: write to `temporary()`, which lies in the
/// same folder, then `commit()`. Without a commit the destructor removes the temporary file.
class AtomicFile {
 public:
  /// Throws FileError if `path` is empty, a directory, a device or a pipe, or if its folder does not exist.
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::string& temporary() const { return temporary_; }

  /// Renames the temporary file to the path, replacing what was there. Throws FileError.
  void commit();

 private:
  std::string path_;
  std::string temporary_;
  bool committed_ = false;
};

/// Writes `bytes` to `path` atomically. Throws FileError.
void write_file(const std::string& path, std::span<const std::byte> bytes);

}  // namespace mirrorbake
