// PNG, TIFF and JPEG files with what other programs put into them, written here byte by byte.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/image_io.hpp"

namespace mirrorbake {
namespace {

using testing::HasSubstr;

std::string big_endian(std::uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16), static_cast<char>(value >> 8),
          static_cast<char>(value)};
}

std::string chunk(const std::string& type, const std::string& data) {
  const std::string body = type + data;
  const auto crc = crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
  return big_endian(static_cast<std::uint32_t>(data.size())) + body +
         big_endian(static_cast<std::uint32_t>(crc));
}

std::string deflated(const std::string& data) {
  uLongf size = compressBound(data.size());
  std::string result(size, '\0');
  compress2(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(data.data()),
            data.size(), 9);
  result.resize(size);
  return result;
}

// `rows` are packed and preceded by their filter.
std::string png(std::uint32_t width, std::uint32_t height, char depth, char colour, const std::string& rows,
                const std::string& before_pixels = "") {
  return "\x89PNG\r\n\x1a\n" +
         chunk("IHDR", big_endian(width) + big_endian(height) + std::string{depth, colour, 0, 0, 0}) +
         before_pixels + chunk("IDAT", deflated(rows)) + chunk("IEND", "");
}

Image decoded(const std::string& bytes, const DecodeOptions& options = {}) {
  return decode_image("memory", {reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()},
                      options);
}

std::string error_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const FileError& e) {
    return e.what();
  }
  return "no error";
}

// A parser that recurses into each element needs a stack frame for every one of these.
std::string nested_xmp(int depth) {
  std::string text = "XML:com.adobe.xmp";
  text += std::string(5, '\0') + "<x:xmpmeta xmlns:x='adobe:ns:meta/'>";
  for (int i = 0; i < depth; ++i) text += "<a>";
  for (int i = 0; i < depth; ++i) text += "</a>";
  return text + "</x:xmpmeta>";
}

TEST(GuardedPng, NestedMetadataAreNotParsed) {
  const std::string row("\0\x7f\x7f\x7f\x7f\x7f\x7f", 7);
  const Image image = decoded(png(2, 1, 8, 2, row, chunk("iTXt", nested_xmp(200'000)) + chunk("zTXt", "a")));
  EXPECT_EQ(image.width, 2);
  EXPECT_NEAR(image.pixels[0], 0.2122F, 1e-3F);
}

TEST(GuardedPng, ATransparentColourAndGammaStillCount) {
  const std::string rows("\0\x00\xff", 3);
  // 100000 is a gamma of 1.
  const Image image =
      decoded(png(2, 1, 8, 0, rows, chunk("gAMA", big_endian(100'000)) + chunk("tRNS", {'\0', '\0'})));
  ASSERT_EQ(image.channels, (std::vector<std::string>{"Y", "A"}));
  EXPECT_EQ(image.pixels, (std::vector<float>{0.0F, 0.0F, 1.0F, 1.0F}));
}

// 512² pixels of one bit, all alike, are 130 bytes: a sixth of what three expanded channels may shrink to.
TEST(GuardedPng, FewBitsPerPixelAreMeasuredAsTheyAreStored) {
  const std::string palette = chunk("PLTE", std::string("\x00\xff\x00\xff\x00\x00", 6));
  std::string rows;
  for (int y = 0; y < 512; ++y) rows += std::string(1, '\0') + std::string(64, '\xff');
  const Image indexed = decoded(png(512, 512, 1, 3, rows, palette));
  ASSERT_EQ(indexed.channels.size(), 3U);
  EXPECT_EQ(indexed.pixels[0], 1.0F);
  EXPECT_EQ(indexed.pixels[1], 0.0F);
  const Image grey = decoded(png(512, 512, 1, 0, rows));
  EXPECT_EQ(grey.channels.size(), 1U);
  EXPECT_EQ(grey.pixels.back(), 1.0F);
}

// Little-endian TIFF 6.0 of one strip of 8-bit samples.
struct Tag {
  int number, type;
  std::uint32_t count, value;
};
std::string little(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i));
  return text;
}
std::string tiff(const std::vector<Tag>& tags, const std::string& data) {
  std::string text =
      "II*" + std::string(1, '\0') + little(static_cast<std::uint32_t>(8 + data.size()), 4) + data;
  text += little(static_cast<std::uint32_t>(tags.size()), 2);
  for (const Tag& t : tags) {
    text += little(static_cast<std::uint32_t>(t.number), 2) + little(static_cast<std::uint32_t>(t.type), 2) +
            little(t.count, 4) + little(t.value, 4);
  }
  return text + little(0, 4);
}
constexpr int kShort = 3;
constexpr int kLong = 4;

// 3 x 2 grey pixels that count from 0.
std::string small_tiff(std::uint32_t orientation, const Tag* extra = nullptr, const std::string& more = "") {
  std::vector<Tag> tags = {
      {256, kLong, 1, 3},  {257, kLong, 1, 2}, {258, kShort, 1, 8},           {259, kShort, 1, 1},
      {262, kShort, 1, 1}, {273, kLong, 1, 8}, {274, kShort, 1, orientation}, {277, kShort, 1, 1},
      {278, kLong, 1, 2},  {279, kLong, 1, 6}};
  if (extra != nullptr) tags.push_back(*extra);
  return tiff(tags, std::string("\0\1\2\3\4\5", 6) + more);
}

std::vector<int> steps(const Image& image) {
  std::vector<int> result;
  for (const float v : image.pixels) result.push_back(static_cast<int>(v * 255.0F + 0.5F));
  return result;
}

// The table of TIFF 6.0, Orientation: where the first row and column of the picture are.
TEST(GuardedTiff, EveryOrientationIsTurnedUpright) {
  const std::vector<std::vector<int>> expected = {{0, 1, 2, 3, 4, 5}, {2, 1, 0, 5, 4, 3}, {5, 4, 3, 2, 1, 0},
                                                  {3, 4, 5, 0, 1, 2}, {0, 3, 1, 4, 2, 5}, {3, 0, 4, 1, 5, 2},
                                                  {5, 2, 4, 1, 3, 0}, {2, 5, 1, 4, 0, 3}};
  DecodeOptions options;
  options.transfer = Transfer::linear;
  for (std::uint32_t orientation = 1; orientation <= 8; ++orientation) {
    const Image image = decoded(small_tiff(orientation), options);
    EXPECT_EQ(image.width, orientation < 5 ? 3 : 2);
    EXPECT_EQ(steps(image), expected[orientation - 1]) << orientation;
  }
}

TEST(GuardedTiff, NestedMetadataAreNotParsed) {
  const std::string xmp = nested_xmp(200'000).substr(22);
  const Tag tag{700, 1, static_cast<std::uint32_t>(xmp.size()), 14};
  EXPECT_EQ(decoded(small_tiff(1, &tag, xmp)).width, 3);
}

TEST(GuardedTiff, CmykInTilesIsRefusedByName) {
  const std::vector<Tag> tags = {{256, kLong, 1, 16},  {257, kLong, 1, 16}, {258, kShort, 1, 8},
                                 {259, kShort, 1, 1},  {262, kShort, 1, 5}, {277, kShort, 1, 4},
                                 {322, kLong, 1, 16},  {323, kLong, 1, 16}, {324, kLong, 1, 8},
                                 {325, kLong, 1, 1024}};
  EXPECT_THAT(error_of([&] { decoded(tiff(tags, std::string(1024, '\1'))); }),
              HasSubstr("CMYK inks in tiles"));
}

TEST(GuardedTiff, DirectoriesThatNeverEndAreAnError) {
  std::string bytes = small_tiff(1);
  const std::string first = bytes.substr(4, 4);
  bytes.replace(bytes.size() - 4, 4, first);  // its next directory is itself
  EXPECT_EQ(decoded(bytes).width, 3);
  bytes.replace(bytes.size() - 4, 4, little(1u << 30, 4));
  EXPECT_THAT(error_of([&] { decoded(bytes); }), HasSubstr("directory 1"));
}

class GuardedJpeg : public testing::Test {
 protected:
  void SetUp() override {
    const std::string path =
        (std::filesystem::temp_directory_path() / ("mirrorbake_guard_" + std::to_string(::getpid()) + ".jpg"))
            .string();
    Image image(32, 16, {"Y"});
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 32; ++x) *image.at(x, y) = x < 16 ? 1.0F : 0.0F;
    }
    save_image(path, image);
    std::ifstream in(path, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(in), {});
    std::filesystem::remove(path);
  }
  std::string with_segment(char marker, const std::string& data) const {
    const std::size_t size = data.size() + 2;
    return bytes_.substr(0, 2) +
           std::string{'\xff', marker, static_cast<char>(size >> 8), static_cast<char>(size)} + data +
           bytes_.substr(2);
  }
  std::string bytes_;
};

// Orientation 6: what is stored at the left is the top.
TEST_F(GuardedJpeg, ExifOrientationIsApplied) {
  const std::string exif = std::string("Exif\0\0", 6) + tiff({{274, kShort, 1, 6}}, "");
  const Image image = decoded(with_segment('\xe1', exif));
  ASSERT_EQ(image.width, 16);
  ASSERT_EQ(image.height, 32);
  EXPECT_NEAR(*image.at(8, 4), 1.0F, 0.05F);
  EXPECT_NEAR(*image.at(8, 28), 0.0F, 0.05F);
}

TEST_F(GuardedJpeg, MetadataAreNotParsed) {
  // As deep as the 64 KiB of a segment allow; 4,000 levels are enough to be slow in a parser that recurses.
  const std::string xmp = "http://ns.adobe.com/xap/1.0/" + std::string(1, '\0') + nested_xmp(4000).substr(22);
  EXPECT_EQ(decoded(with_segment('\xe1', xmp)).width, 32);
}

// Neither may wait for a writer or read without end.
TEST(SpecialFiles, AreRefusedByName) {
  const std::string pipe =
      (std::filesystem::temp_directory_path() / ("mirrorbake_pipe_" + std::to_string(::getpid()))).string();
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& path :
       {pipe, std::string("/dev/zero"), std::string("/dev"), std::string("/dev/null")}) {
    EXPECT_THAT(error_of([&] { load_image(path); }), HasSubstr("is not a regular file")) << path;
    EXPECT_THAT(error_of([&] { read_image_size(path); }), HasSubstr("is not a regular file")) << path;
  }
  std::filesystem::remove(pipe);
}

}  // namespace
}  // namespace mirrorbake
