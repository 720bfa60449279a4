#include "mirrorbake/image/bytes.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "mirrorbake/core/error.hpp"

namespace mirrorbake::image_files {
namespace {

class FileBytes : public Bytes {
 public:
  explicit FileBytes(const std::string& path)
      : descriptor_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
    struct stat status {};
    if (descriptor_ < 0) {
      throw FileError(path, errno == ENOENT ? std::string("does not exist")
                                            : std::string("cannot be read: ") + std::strerror(errno));
    }
    if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
      ::close(descriptor_);
      throw FileError(path, "is not a regular file");
    }
    size_ = static_cast<std::uint64_t>(status.st_size);
  }
  ~FileBytes() override { ::close(descriptor_); }
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;

  std::uint64_t size() const override { return size_; }

  std::size_t read(std::uint64_t offset, std::span<unsigned char> to) const override {
    std::size_t done = 0;
    while (done < to.size() && offset + done < size_) {
      const ssize_t count =
          ::pread(descriptor_, to.data() + done, to.size() - done, static_cast<off_t>(offset + done));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) break;
      done += static_cast<std::size_t>(count);
    }
    return done;
  }

 private:
  int descriptor_;
  std::uint64_t size_ = 0;
};

class MemoryBytes : public Bytes {
 public:
  explicit MemoryBytes(std::span<const unsigned char> memory) : memory_(memory) {}

  std::uint64_t size() const override { return memory_.size(); }

  std::size_t read(std::uint64_t offset, std::span<unsigned char> to) const override {
    if (offset >= memory_.size()) return 0;
    const std::span<const unsigned char> rest = memory_.subspan(offset);
    const std::size_t count = std::min(rest.size(), to.size());
    std::copy_n(rest.begin(), count, to.begin());
    return count;
  }

 private:
  std::span<const unsigned char> memory_;
};

}  // namespace

std::unique_ptr<const Bytes> open_bytes(const std::string& path) { return std::make_unique<FileBytes>(path); }

std::unique_ptr<const Bytes> bytes_in(std::span<const unsigned char> memory) {
  return std::make_unique<MemoryBytes>(memory);
}

std::vector<unsigned char> all_of(const std::string& name, const Bytes& bytes) {
  std::vector<unsigned char> result(bytes.size());
  if (bytes.read(0, result) != result.size()) throw FileError(name, "cannot be read to its end");
  return result;
}

std::size_t read_patched(const Bytes& bytes, std::span<const Patch> patches, std::uint64_t offset,
                         std::span<unsigned char> to) {
  const std::size_t count = bytes.read(offset, to);
  const std::uint64_t end = offset + count;
  const auto first = std::partition_point(patches.begin(), patches.end(), [&](const Patch& patch) {
    return patch.offset + patch.bytes.size() <= offset;
  });
  for (auto patch = first; patch != patches.end() && patch->offset < end; ++patch) {
    const std::uint64_t begin = std::max(offset, patch->offset);
    const std::uint64_t stop = std::min(end, patch->offset + patch->bytes.size());
    std::copy_n(patch->bytes.begin() + static_cast<std::ptrdiff_t>(begin - patch->offset), stop - begin,
                to.begin() + static_cast<std::ptrdiff_t>(begin - offset));
  }
  return count;
}

}  // namespace mirrorbake::image_files
