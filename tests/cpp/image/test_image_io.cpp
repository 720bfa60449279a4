#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/atomic_file.hpp"
#include "mirrorbake/image/color.hpp"
#include "mirrorbake/image/image_io.hpp"

namespace mirrorbake {
namespace {

namespace fs = std::filesystem;

class ImageFiles : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ =
        fs::temp_directory_path() / (std::string("mirrorbake_") + info->name() + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}));
  }
  fs::path folder_;
};

Image ramp(int width, int height, std::vector<std::string> channels, float largest) {
  Image image(width, height, std::move(channels));
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    image.pixels[i] = largest * static_cast<float>(i) / static_cast<float>(image.pixels.size());
  }
  return image;
}

TEST_F(ImageFiles, Float32ExrReturnsTheSameBitsAndChannelNames) {
  const Image image = ramp(37, 11, {"R", "G", "B", "A"}, 1e30F);
  save_image(path("a.exr"), image, PixelFormat::float32);
  const Image again = load_image(path("a.exr"));
  EXPECT_EQ(again.width, 37);
  EXPECT_EQ(again.height, 11);
  EXPECT_EQ(again.channels, image.channels);
  EXPECT_EQ(again.pixels, image.pixels);
}

TEST_F(ImageFiles, ExrKeepsEveryLayerUnderItsName) {
  const Image image =
      ramp(4, 3, {"coverage", "specular_local.R", "specular_local.A", "normal.X", "distance"}, 9.0F);
  save_image(path("layers.exr"), image, PixelFormat::float32);
  const Image again = load_image(path("layers.exr"));
  EXPECT_THAT(again.channels, testing::UnorderedElementsAreArray(image.channels));
  for (int c = 0; c < image.channel_count(); ++c) {
    for (int d = 0; d < again.channel_count(); ++d) {
      if (image.channels[static_cast<std::size_t>(c)] != again.channels[static_cast<std::size_t>(d)])
        continue;
      EXPECT_EQ(again.at(3, 2)[d], image.at(3, 2)[c]);
    }
  }
}

TEST_F(ImageFiles, HalfOverflowIsClampedAndCounted) {
  Image image(2, 2, {"R", "G", "B"});
  const float inf = std::numeric_limits<float>::infinity();
  image.pixels = {65504.0F, 65505.0F, -1e9F, inf, -inf, 1.0F, 0.0F, 65519.0F, 2.0F, 3.0F, 4.0F, 5.0F};
  const SaveReport report = save_image(path("a.exr"), image);
  EXPECT_EQ(report.clamped_to_half, 5u);
  const std::vector<float> expected = {65504.0F, 65504.0F, -65504.0F, 65504.0F, -65504.0F, 1.0F,
                                       0.0F,     65504.0F, 2.0F,      3.0F,     4.0F,      5.0F};
  EXPECT_EQ(load_image(path("a.exr")).pixels, expected);
}

// RGBE shares one exponent of eight-bit mantissas: a step is 1/128 of the largest component at worst.
TEST_F(ImageFiles, HdrKeepsRadianceWithinItsSharedExponent) {
  const Image image = ramp(64, 32, {"R", "G", "B"}, 5e4F);
  EXPECT_EQ(save_image(path("a.hdr"), image).clipped, 0u);
  const Image again = load_image(path("a.hdr"));
  ASSERT_EQ(again.pixels.size(), image.pixels.size());
  for (std::size_t i = 0; i < image.pixels.size(); i += 3) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(again.pixels[i + c], image.pixels[i + c], image.pixels[i + 2] / 128 + 1e-30F);
    }
  }
}

TEST_F(ImageFiles, HdrClipsWhatItCannotHoldAndCountsIt) {
  Image image(1, 1, {"R", "G", "B"});
  image.pixels = {-1.0F, std::numeric_limits<float>::quiet_NaN(), 4.0F};
  EXPECT_EQ(save_image(path("a.hdr"), image).clipped, 2u);
  EXPECT_EQ(load_image(path("a.hdr")).pixels, (std::vector<float>{0.0F, 0.0F, 4.0F}));
}

TEST_F(ImageFiles, IntegerFormatsStoreSrgbWithinHalfAStep) {
  const Image image = ramp(50, 20, {"R", "G", "B"}, 1.0F);
  for (const auto& [name, format, steps] :
       {std::tuple{"a.png", PixelFormat::uint8, 255.0F}, std::tuple{"b.png", PixelFormat::uint16, 65535.0F},
        std::tuple{"a.tif", PixelFormat::uint8, 255.0F},
        std::tuple{"b.tif", PixelFormat::uint16, 65535.0F}}) {
    EXPECT_EQ(save_image(path(name), image, format).clipped, 0u);
    const Image again = load_image(path(name));
    ASSERT_EQ(again.pixels.size(), image.pixels.size());
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      // Half a step, and the rounding of two powers in float32.
      EXPECT_NEAR(srgb_encode(again.pixels[i]), srgb_encode(image.pixels[i]), 0.5F / steps + 1e-6F) << name;
    }
  }
}

TEST_F(ImageFiles, AFloatTiffReturnsTheSameBits) {
  const Image image = ramp(33, 9, {"R", "G", "B"}, 1e6F);
  save_image(path("a.tif"), image);
  EXPECT_EQ(load_image(path("a.tif")).pixels, image.pixels);
}

TEST_F(ImageFiles, PngAlphaIsLinearAndColourComesBackPremultiplied) {
  Image image(3, 1, {"R", "G", "B", "A"});
  image.pixels = {0.25F, 0.1F, 0.0F, 0.5F, 1.0F, 0.5F, 0.25F, 1.0F, 0.0F, 0.0F, 0.0F, 0.0F};
  save_image(path("a.png"), image, PixelFormat::uint16);
  const Image again = load_image(path("a.png"));
  ASSERT_EQ(again.channels, image.channels);
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    EXPECT_NEAR(again.pixels[i], image.pixels[i], 3e-5F) << i;
}

TEST_F(ImageFiles, NaNBecomesBlackInAnIntegerFormatAndIsCounted) {
  Image image(1, 1, {"R", "G", "B"});
  image.pixels = {std::numeric_limits<float>::quiet_NaN(), 2.0F, -1.0F};
  EXPECT_EQ(save_image(path("a.png"), image).clipped, 3u);
  EXPECT_EQ(load_image(path("a.png")).pixels, (std::vector<float>{0.0F, 1.0F, 0.0F}));
}

TEST_F(ImageFiles, RefusesChannelsThatTheFormatWouldDropOrMistake) {
  EXPECT_THROW(save_image(path("a.png"), Image(1, 1, {"a", "b", "c", "d", "e"})), FileError);
  EXPECT_THROW(save_image(path("a.png"), Image(1, 1, {"X", "Y"})), FileError);
  EXPECT_THROW(save_image(path("a.jpg"), Image(1, 1, {"R", "G", "B", "A"})), FileError);
  EXPECT_THROW(save_image(path("a.hdr"), Image(1, 1, {"Y"})), FileError);
  EXPECT_THROW(save_image(path("a.bmp"), Image(1, 1, {"R", "G", "B"})), FileError);
  EXPECT_THROW(save_image(path("a.png"), Image(1, 1, {"R", "G", "B"}), PixelFormat::half), FileError);
  EXPECT_THROW(save_image(path("a.exr"), Image(1, 1, {"R", "R"})), InvalidArgument);
  EXPECT_THROW(save_image(path("a.exr"), Image()), InvalidArgument);
  EXPECT_EQ(files(), 0u);
}

TEST_F(ImageFiles, AFailedWriteLeavesTheOldFileAndNothingElse) {
  const Image image = ramp(8, 8, {"R", "G", "B"}, 1.0F);
  save_image(path("a.exr"), image, PixelFormat::float32);
  {
    AtomicFile abandoned(path("a.exr"));
    std::ofstream(abandoned.temporary()) << "half a file";
    EXPECT_EQ(files(), 2u);
  }
  EXPECT_EQ(files(), 1u);
  EXPECT_EQ(load_image(path("a.exr")).pixels, image.pixels);
  EXPECT_THROW(save_image(path("missing/a.exr"), image), FileError);
  EXPECT_THROW(save_image(folder_.string(), image), FileError);
}

TEST_F(ImageFiles, ErrorsNameTheFile) {
  try {
    load_image(path("nowhere.exr"));
    FAIL() << "no error";
  } catch (const FileError& e) {
    EXPECT_EQ(e.path(), path("nowhere.exr"));
    EXPECT_THAT(e.what(), testing::HasSubstr("does not exist"));
  }
}

TEST_F(ImageFiles, LimitsHoldBeforeAnythingIsAllocated) {
  save_image(path("wide.exr"), Image(60000, 2, {"R", "G", "B"}));
  EXPECT_EQ(load_image(path("wide.exr")).width, 60000);
  EXPECT_THROW(load_image(path("wide.exr"), {.max_side = 59999}), FileError);
  EXPECT_THROW(load_image(path("wide.exr"), {.max_channels = 2}), FileError);
  EXPECT_THROW(load_image(path("wide.exr"), {.max_bytes = 60000 * 2 * 3 * 4 - 1}), FileError);
}

TEST(Color, SrgbMeetsThePublishedPairs) {
  // Eight-bit codes and their linear values, from the formula in IEC 61966-2-1 at 50 digits.
  EXPECT_EQ(srgb_decode(0.0F), 0.0F);
  EXPECT_NEAR(srgb_decode(128.0F / 255), 0.21586050011389923F, 1e-7F);
  EXPECT_NEAR(srgb_decode(10.0F / 255), 0.0030352698354883752F, 1e-9F);
  EXPECT_EQ(srgb_decode(1.0F), 1.0F);
  for (int code = 0; code < 256; ++code) {
    EXPECT_NEAR(255.0F * srgb_encode(srgb_decode(static_cast<float>(code) / 255)), static_cast<float>(code),
                1e-3F);
  }
}

TEST_F(ImageFiles, HdrRoundsToTheNearestMantissaAndKeepsTheMean) {
  Image image(64, 64, {"R", "G", "B"});
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    // A golden-ratio sequence over four decades, so that no part of a step is preferred.
    image.pixels[i] = std::pow(10.0F, std::fmod(static_cast<float>(i) * 0.6180340F, 1.0F) * 4.0F - 2.0F);
  }
  image.pixels[0] = image.pixels[1] = image.pixels[2] =
      0x1.ffp3F;  // nearer to 16 than to what 8 bits hold below
  save_image(path("a.hdr"), image);
  const Image again = load_image(path("a.hdr"));
  double sum = 0.0;
  double sum_again = 0.0;
  for (std::size_t i = 0; i < image.pixels.size(); i += 3) {
    float largest = 0.0F;
    for (std::size_t c = 0; c < 3; ++c) largest = std::max(largest, image.pixels[i + c]);
    for (std::size_t c = 0; c < 3; ++c) {
      // Half a step of an 8-bit mantissa in [128, 256).
      EXPECT_LE(std::abs(again.pixels[i + c] - image.pixels[i + c]), largest / 256.0F) << i;
      sum += static_cast<double>(image.pixels[i + c]);
      sum_again += static_cast<double>(again.pixels[i + c]);
    }
  }
  // Cutting off loses half a step of each value on average, 5e-3. Rounding leaves the noise of some 2,000
  // bright values of ±0.2 % each, 5e-5, and more where neighbours go together.
  EXPECT_NEAR(sum_again / sum, 1.0, 5e-4);
}

TEST_F(ImageFiles, FullDiskLeavesNothingAndIsAnErrorInEveryFormat) {
  const Image image = [] {
    Image noise(256, 256, {"R", "G", "B"});
    for (std::size_t i = 0; i < noise.pixels.size(); ++i) {
      noise.pixels[i] = std::fmod(static_cast<float>(i) * 0.6180340F, 1.0F);
    }
    return noise;
  }();
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit small = before;
  small.rlim_cur = 8192;
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  std::vector<std::string> written;
  for (const std::string name : {"a.exr", "a.hdr", "a.tif", "a.png", "a.jpg"}) {
    try {
      save_image(path(name), image);
      written.push_back(name);
    } catch (const FileError&) {
    }
  }
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(written, testing::IsEmpty());
  EXPECT_EQ(files(), 0u);
  for (const std::string name : {"a.exr", "a.hdr", "a.tif", "a.png", "a.jpg"}) save_image(path(name), image);
  EXPECT_EQ(files(), 5u);
}

// OpenEXR says nothing of bytes that it writes when it is done.
TEST_F(ImageFiles, AnExrThatLacksRoomForItsLastByteIsAnError) {
  const Image image = ramp(40, 30, {"R", "G", "B"}, 1.0F);
  save_image(path("a.exr"), image);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit small = before;
  small.rlim_cur = std::filesystem::file_size(path("a.exr")) - 1;
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(save_image(path("b.exr"), image), FileError);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(files(), 1u);
}

TEST_F(ImageFiles, DamagedPngIsAnErrorOfOneLineAndPrintsNothing) {
  save_image(path("a.png"), ramp(40, 30, {"R", "G", "B"}, 1.0F));
  std::ifstream in(path("a.png"), std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  const std::size_t data = whole.find("IDAT");
  ASSERT_NE(data, std::string::npos);
  testing::internal::CaptureStderr();
  std::vector<std::string> messages;
  const auto load = [&](const std::string& bytes) {
    std::ofstream(path("b.png"), std::ios::binary) << bytes;
    try {
      load_image(path("b.png"));
      messages.emplace_back("loaded");
    } catch (const FileError& e) {
      messages.emplace_back(e.what());
    }
  };
  for (const std::size_t size : {std::size_t{9}, data, data + 20, whole.size() - 1})
    load(whole.substr(0, size));
  for (const std::size_t at : {std::size_t{13}, std::size_t{20}, data + 1, data + 12}) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    load(damaged);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ASSERT_EQ(messages.size(), 8u);
  for (const std::string& message : messages) {
    EXPECT_THAT(message, testing::StartsWith(path("b.png") + ": is "));
    EXPECT_THAT(message, testing::Not(testing::HasSubstr("\n")));
  }
}

TEST_F(ImageFiles, APathIsCheckedWithoutWritingToIt) {
  EXPECT_NO_THROW(check_image_path(path("a.exr"), PixelFormat::half));
  EXPECT_THROW(check_image_path(path("a.exr"), PixelFormat::uint8), FileError);
  EXPECT_THROW(check_image_path(path("a.doc")), FileError);
  EXPECT_THROW(check_image_path(path("none/a.exr")), FileError);
  EXPECT_THROW(check_image_path(""), FileError);
  EXPECT_EQ(files(), 0u);
}

// Root could rename a file over it.
TEST(AtomicFile, DoesNotReplaceDevices) {
  const std::string text = "text";
  EXPECT_THROW(write_file("/dev/null", std::as_bytes(std::span(text))), FileError);
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

}  // namespace
}  // namespace mirrorbake
