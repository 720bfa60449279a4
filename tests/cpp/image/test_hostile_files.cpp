#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/image/atomic_file.hpp"
#include "mirrorbake/image/image_io.hpp"

namespace mirrorbake {
namespace {

namespace fs = std::filesystem;

std::vector<std::byte> bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  std::vector<std::byte> bytes(static_cast<std::size_t>(in.tellg()));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return bytes;
}

// Loading gives an image whose parts agree, or a FileError: any other exception fails the test, a crash ends
// it.
void load_must_not_crash(const std::string& path) {
  const ImageLimits limits{.max_side = 4096, .max_bytes = std::uint64_t{64} << 20};
  try {
    const Image image = load_image(path, limits);
    EXPECT_EQ(image.pixels.size(), static_cast<std::size_t>(image.width) *
                                       static_cast<std::size_t>(image.height) * image.channels.size());
  } catch (const FileError&) {
  }
}

class HostileFiles : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("mirrorbake_hostile_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    whole_ = (folder_ / GetParam()).string();
    Image image(48, 24, {"R", "G", "B"});
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
      image.pixels[i] = unit_float(std::uint32_t(hash64(i)));
    save_image(whole_, image);
    broken_ = (folder_ / (std::string("broken_") + GetParam())).string();
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
  std::string whole_, broken_;
};

TEST_P(HostileFiles, TruncatedAnywhereIsAnError) {
  const std::vector<std::byte> bytes = bytes_of(whole_);
  for (std::size_t length : {std::size_t{0}, std::size_t{1}, std::size_t{5}, std::size_t{40},
                             bytes.size() / 4, bytes.size() / 2, bytes.size() * 3 / 4}) {
    write_file(broken_, std::span(bytes).first(length));
    EXPECT_THROW(load_image(broken_), FileError) << length << " of " << bytes.size() << " bytes";
  }
}

TEST_P(HostileFiles, ChangedBytesGiveAnImageOrAnError) {
  const std::vector<std::byte> bytes = bytes_of(whole_);
  for (std::uint64_t trial = 0; trial < 400; ++trial) {
    std::vector<std::byte> changed = bytes;
    const std::uint64_t changes = 1 + hash64(trial, 0) % 8;
    // Every other trial aims at the header, where sizes and offsets are.
    const std::size_t range = trial % 2 == 0 ? std::min<std::size_t>(bytes.size(), 512) : bytes.size();
    for (std::uint64_t i = 0; i < changes; ++i) {
      changed[hash64(trial, 2 * i + 1) % range] = static_cast<std::byte>(hash64(trial, 2 * i + 2) & 255u);
    }
    write_file(broken_, changed);
    load_must_not_crash(broken_);
  }
}

TEST_P(HostileFiles, RandomBytesAfterTheMagicNumberGiveAnError) {
  const std::vector<std::byte> bytes = bytes_of(whole_);
  for (std::uint64_t trial = 0; trial < 100; ++trial) {
    std::vector<std::byte> random(8 + hash64(trial, 0) % 2000);
    for (std::size_t i = 0; i < random.size(); ++i) {
      random[i] = i < 8 ? bytes[i] : static_cast<std::byte>(hash64(trial, i) & 255u);
    }
    write_file(broken_, random);
    load_must_not_crash(broken_);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, HostileFiles, testing::Values("a.exr", "a.hdr", "a.tif", "a.png", "a.jpg"),
                         [](const auto& kind) { return std::string(kind.param).substr(2); });

}  // namespace
}  // namespace mirrorbake
