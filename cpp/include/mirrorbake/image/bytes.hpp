#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

/// Bytes of a file or of memory that stands for one, read at any place.
namespace mirrorbake::image_files {

class Bytes {
 public:
  virtual ~Bytes() = default;
  virtual std::uint64_t size() const = 0;
  /// Returns how many of the bytes from `offset` on there are, at most to.size(). From several threads at
  /// once.
  virtual std::size_t read(std::uint64_t offset, std::span<unsigned char> to) const = 0;
};

/// A regular file: folders, devices and pipes are refused, without waiting for a pipe's writer. Throws
/// FileError.
std::unique_ptr<const Bytes> open_bytes(const std::string& path);

/// Memory, which has to outlive the result.
std::unique_ptr<const Bytes> bytes_in(std::span<const unsigned char> memory);

/// All of them. Throws FileError if they cannot be read to their end.
std::vector<unsigned char> all_of(const std::string& name, const Bytes& bytes);

/// Bytes that stand in for those of a file at `offset`.
struct Patch {
  std::uint64_t offset = 0;
  std::vector<unsigned char> bytes;
};

/// Reads with the patches, which are in the order of their offsets and do not overlap, in place.
std::size_t read_patched(const Bytes& bytes, std::span<const Patch> patches, std::uint64_t offset,
                         std::span<unsigned char> to);

}  // namespace mirrorbake::image_files
