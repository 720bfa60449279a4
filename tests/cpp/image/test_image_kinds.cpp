#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "image_files.hpp"
#include "image_kinds.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/image_io.hpp"

/// What the table of image kinds says, held against what the library writes and reads.
namespace mirrorbake::image_files {
namespace {

namespace fs = std::filesystem;

class ImageKinds : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("mirrorbake_image_kinds_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(std::string_view extension) const {
    return (folder_ / "image").string() + std::string(extension);
  }
  fs::path folder_;
};

Image grey(std::vector<std::string> channels) {
  Image image(8, 8, std::move(channels));
  std::fill(image.pixels.begin(), image.pixels.end(), 0.5F);
  return image;
}

Image grey(const ImageKind& row) {
  return grey(row.holds == nullptr || row.holds(3, false) ? std::vector<std::string>{"R", "G", "B"}
                                                          : std::vector<std::string>{"Y"});
}

std::string head_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string head(kHeadBytes, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  return head;
}

TEST_F(ImageKinds, AreInTheOrderOfTheirEnumeration) {
  for (std::size_t i = 0; i < kImageKinds.size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(kImageKinds[i].kind), i) << kImageKinds[i].name;
    EXPECT_EQ(&row_of(kImageKinds[i].kind), &kImageKinds[i]);
  }
}

TEST_F(ImageKinds, ShareNoExtension) {
  std::set<std::string_view> seen;
  for (const ImageKind& row : kImageKinds) {
    for (const std::string_view extension : row.extensions) {
      if (extension.empty()) continue;
      EXPECT_TRUE(seen.insert(extension).second) << extension;
      EXPECT_EQ(known_extension(path(extension)), row.kind);
    }
  }
}

TEST_F(ImageKinds, AreToldByWhatTheirFilesBeginWithInEveryFormatTheyAreWrittenIn) {
  for (const ImageKind& row : kImageKinds) {
    if (row.extensions[0].empty()) continue;
    for (const PixelFormat format : row.formats) {
      const std::string file = path(row.extensions[0]);
      save_image(file, grey(row), format);
      const std::string head = head_of(file);
      for (const ImageKind& other : kImageKinds) {
        EXPECT_EQ(other.begins(head), &other == &row) << other.name << ", in a file of " << row.name;
      }
      EXPECT_EQ(load_image(file).channels, grey(row).channels) << row.name;
    }
  }
}

TEST_F(ImageKinds, RefuseFormatsThatTheyDoNotNameAndListThoseThatTheyDo) {
  for (const ImageKind& row : kImageKinds) {
    if (row.extensions[0].empty()) continue;
    for (std::size_t i = 1; i < EnumNames<PixelFormat>::names.size(); ++i) {
      const auto format = static_cast<PixelFormat>(i);
      if (std::find(row.formats.begin(), row.formats.end(), format) != row.formats.end()) continue;
      try {
        check_image_path(path(row.extensions[0]), format);
        ADD_FAILURE() << row.name << " takes " << name_of(format);
      } catch (const FileError& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr(std::string(name_of(row.formats[0]))));
      }
    }
  }
}

TEST_F(ImageKinds, HoldTheChannelsThatTheySay) {
  const std::vector<std::vector<std::string>> sets = {
      {"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}, {"R", "G", "B", "A", "Z"}};
  for (const ImageKind& row : kImageKinds) {
    if (row.extensions[0].empty()) continue;
    for (const std::vector<std::string>& channels : sets) {
      const std::string file = path(row.extensions[0]);
      if (row.holds == nullptr || row.holds(channels.size(), channels.back() == "A")) {
        save_image(file, grey(channels));
        // Channels of a colour image are R, G, B in every reader; EXR keeps all names.
        EXPECT_EQ(load_image(file).channels.size(), channels.size()) << row.name;
      } else {
        EXPECT_THROW(save_image(file, grey(channels)), FileError) << row.name << ' ' << channels.size();
      }
    }
  }
}

TEST_F(ImageKinds, WithoutExtensionAreNotWritten) {
  for (const ImageKind& row : kImageKinds) {
    EXPECT_EQ(row.extensions[0].empty(), row.formats[0] == PixelFormat::automatic) << row.name;
  }
  EXPECT_THROW(check_image_path(path(".webp"), PixelFormat::automatic), FileError);
}

}  // namespace
}  // namespace mirrorbake::image_files
