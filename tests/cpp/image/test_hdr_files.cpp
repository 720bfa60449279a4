// Radiance pictures, written here byte by byte.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/image_io.hpp"

namespace mirrorbake {
namespace {

using testing::HasSubstr;

Image decoded(const std::string& bytes) {
  return decode_image("memory", {reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()});
}

std::string error_of(const std::string& bytes) {
  try {
    decoded(bytes);
  } catch (const FileError& e) {
    return e.what();
  }
  return "no error";
}

// A red of mantissa `step` and exponent 136, whose unit is 1.
std::string red(int step) { return {static_cast<char>(step), '\0', '\0', static_cast<char>(136)}; }

std::string picture(const std::string& size, const std::string& pixels, const std::string& variables = "",
                    const std::string& newline = "\n") {
  return "#?RADIANCE" + newline + variables + "FORMAT=32-bit_rle_rgbe" + newline + newline + size + newline +
         pixels;
}

std::vector<int> reds(const Image& image) {
  std::vector<int> result;
  for (std::size_t i = 0; i < image.pixels.size(); i += 3)
    result.push_back(static_cast<int>(image.pixels[i]));
  return result;
}

// Radiance's file format: the first axis is the slower one; −Y goes down and +X to the right.
TEST(HdrFiles, EveryOrientationIsTurnedUpright) {
  std::string pixels;
  for (int i = 2; i < 8; ++i) pixels += red(i);
  const std::vector<std::pair<std::string, std::vector<int>>> expected = {
      {"-Y 2 +X 3", {2, 3, 4, 5, 6, 7}}, {"-Y 2 -X 3", {4, 3, 2, 7, 6, 5}}, {"+Y 2 +X 3", {5, 6, 7, 2, 3, 4}},
      {"+Y 2 -X 3", {7, 6, 5, 4, 3, 2}}, {"+X 3 -Y 2", {2, 4, 6, 3, 5, 7}}, {"-X 3 -Y 2", {6, 4, 2, 7, 5, 3}},
      {"+X 3 +Y 2", {3, 5, 7, 2, 4, 6}}, {"-X 3 +Y 2", {7, 5, 3, 6, 4, 2}}};
  for (const auto& [size, values] : expected) {
    const Image image = decoded(picture(size, pixels));
    EXPECT_EQ(image.width, 3) << size;
    EXPECT_EQ(reds(image), values) << size;
  }
}

TEST(HdrFiles, BothRunLengthEncodingsAreRead) {
  const std::string repeat3("\1\1\1\3", 4);
  EXPECT_EQ(reds(decoded(picture("-Y 1 +X 5", red(9) + repeat3 + red(4)))),
            (std::vector<int>{9, 9, 9, 9, 4}));
  // 4 pixels and then 256 · 1 more by the second of two counts in a row.
  const Image wide = decoded(picture("-Y 1 +X 260", red(9) + repeat3 + std::string("\1\1\1\1", 4)));
  EXPECT_EQ(reds(wide), std::vector<int>(260, 9));
  // New: 2 2 and the width; per component runs of 128 + n or n values.
  const std::string line = std::string("\2\2\0\x8", 4) + std::string("\x85\7\3\1\2\3", 6) +
                           std::string("\x88\0", 2) + std::string("\x88\0", 2) + std::string("\x88\x88", 2);
  EXPECT_EQ(reds(decoded(picture("-Y 1 +X 8", line))), (std::vector<int>{7, 7, 7, 7, 7, 1, 2, 3}));
}

TEST(HdrFiles, ExposuresAreDividedOut) {
  const Image image =
      decoded(picture("-Y 1 +X 1", red(8), "EXPOSURE=2.0\nEXPOSURE= 0.5\nEXPOSURE=4\nCOLORCORR=0.5 1 1\n"));
  EXPECT_EQ(image.pixels[0], 4.0F);
}

TEST(HdrFiles, LinesMayEndWithCarriageReturns) {
  EXPECT_EQ(reds(decoded(picture("-Y 1 +X 1", red(8), "# by hand\r\n", "\r\n"))), (std::vector<int>{8}));
}

// The white of Rec. 709, D65, is (0.9505, 1, 1.0891) in XYZ (IEC 61966-2-1).
TEST(HdrFiles, XyzBecomesRec709) {
  std::string file = picture("-Y 1 +X 1", std::string{'\x7a', '\x80', '\x8b', '\x88'});
  file.replace(file.find("rgbe"), 4, "xyze");
  const Image image = decoded(file);
  for (const float v : image.pixels) EXPECT_NEAR(v, 128.0F, 1.5F);  // mantissas of 8 bits
}

TEST(HdrFiles, WhatIsCutOffOrRunsTooFarIsAnError) {
  EXPECT_THAT(error_of(picture("-Y 2 +X 3", red(1) + red(2))), HasSubstr("truncated"));
  EXPECT_THAT(error_of(picture("-Y 1 +X 2", red(1) + std::string("\1\1\1\x9", 4))), HasSubstr("exceeds"));
  EXPECT_THAT(error_of(picture("-Y 1 +X 2", std::string("\1\1\1\1", 4) + red(1))), HasSubstr("exceeds"));
  EXPECT_THAT(error_of(picture("-Y 1 +Y 2", red(1) + red(2))), HasSubstr("-Y 1 +Y 2"));
  EXPECT_THAT(error_of(picture("-Y 1 +X 1", red(1), "EXPOSURE=0\n")), HasSubstr("EXPOSURE"));
  EXPECT_THAT(error_of("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"), HasSubstr("header does not end"));
  // 10,000 lines of two pixels for a repetition take 80,000 bytes at least.
  EXPECT_THAT(error_of(picture("-Y 10000 +X 10000", red(1))), HasSubstr("bytes can hold"));
}

}  // namespace
}  // namespace mirrorbake
