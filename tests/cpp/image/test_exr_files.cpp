// Files that OpenEXR's own writers make, and files of ours that its reader reads.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledOutputFile.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/image/half.hpp"
#include "mirrorbake/image/image_io.hpp"

namespace mirrorbake {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

class ExrFiles : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              (std::string("mirrorbake_exr_") + info->name() + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  fs::path folder_;
};

// Values that halves hold, none like its neighbours, of channel c.
float value(int x, int y, int c) {
  return static_cast<float>(hash64(static_cast<std::uint64_t>(x + 1000 * y), static_cast<std::uint64_t>(c)) &
                            1023u) /
         64.0F;
}

const Imath::Box2i kWindow(Imath::V2i(-3, 5), Imath::V2i(66, 104));  // 70 x 100

// One float32 or half plane per channel, as big as the window.
struct Planes {
  std::vector<std::vector<float>> values;
  Imf::FrameBuffer frame;
  Planes(const Imath::Box2i& window, const std::vector<std::string>& channels) {
    const int width = window.max.x - window.min.x + 1;
    const int height = window.max.y - window.min.y + 1;
    values.resize(channels.size());
    for (std::size_t c = 0; c < channels.size(); ++c) {
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          values[c].push_back(value(window.min.x + x, window.min.y + y, static_cast<int>(c)));
        }
      }
      frame.insert(channels[c], Imf::Slice::Make(Imf::FLOAT, values[c].data(), window));
    }
  }
};

Imf::Header header_of(const Imath::Box2i& display, const Imath::Box2i& data,
                      const std::vector<std::string>& channels) {
  Imf::Header header(display, data);
  for (const std::string& channel : channels) header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
  return header;
}

// The image's display window is `display`; what lies in `data` has values, the rest is 0.
void expect_values(const Image& image, const Imath::Box2i& display, const Imath::Box2i& data) {
  ASSERT_EQ(image.width, display.max.x - display.min.x + 1);
  ASSERT_EQ(image.height, display.max.y - display.min.y + 1);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Imath::V2i place(display.min.x + x, display.min.y + y);
      for (int c = 0; c < image.channel_count(); ++c) {
        ASSERT_EQ(image.at(x, y)[c], data.intersects(place) ? value(place.x, place.y, c) : 0.0F)
            << x << ' ' << y << ' ' << c;
      }
    }
  }
}

std::vector<unsigned char> bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST_F(ExrFiles, EveryLosslessCompressionAndOrderOfLinesGivesTheSamePixels) {
  Planes planes(kWindow, {"R", "G", "B"});
  for (const auto compression : {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION,
                                 Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION}) {
    Imf::Header header = header_of(kWindow, kWindow, {"R", "G", "B"});
    header.compression() = compression;
    header.lineOrder() = compression == Imf::RLE_COMPRESSION ? Imf::DECREASING_Y : Imf::INCREASING_Y;
    {
      Imf::OutputFile file(path("a.exr").c_str(), header);
      file.setFrameBuffer(planes.frame);
      file.writePixels(100);
    }
    const Image image = load_image(path("a.exr"));
    EXPECT_THAT(image.channels, ElementsAre("R", "G", "B"));
    expect_values(image, kWindow, kWindow);
    const Image decoded = decode_image("a.exr", bytes_of(path("a.exr")));
    EXPECT_EQ(decoded.pixels, image.pixels) << compression;
  }
}

// Values of at most 16 and steps of 1/64: B44 keeps 6 bits of a block's range, DWA's default is visually
// lossless, PXR24 rounds to 24 bits.
TEST_F(ExrFiles, LossyCompressionsGiveNearlyTheSamePixelsOnAnyNumberOfThreads) {
  const Imath::Box2i window(Imath::V2i(0, 0), Imath::V2i(63, 599));
  std::vector<float> ramp(64 * 600);
  for (std::size_t i = 0; i < ramp.size(); ++i)
    ramp[i] = 1.0F + static_cast<float>(i) / static_cast<float>(ramp.size());
  for (const auto compression : {Imf::PXR24_COMPRESSION, Imf::B44_COMPRESSION, Imf::B44A_COMPRESSION,
                                 Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION}) {
    Imf::Header header(window, window);
    header.channels().insert("R", Imf::Channel(Imf::FLOAT));
    header.compression() = compression;
    {
      Imf::FrameBuffer frame;
      frame.insert("R", Imf::Slice::Make(Imf::FLOAT, ramp.data(), window));
      Imf::OutputFile file(path("a.exr").c_str(), header);
      file.setFrameBuffer(frame);
      file.writePixels(600);
    }
    const Image image = load_image(path("a.exr"));
    ASSERT_EQ(image.pixels.size(), ramp.size());
    for (std::size_t i = 0; i < ramp.size(); ++i)
      ASSERT_NEAR(image.pixels[i], ramp[i], 0.02F) << compression << ' ' << i;
    const ThreadLimit one(1);
    EXPECT_EQ(load_image(path("a.exr")).pixels, image.pixels) << compression;
  }
}

TEST_F(ExrFiles, TilesOfAllLevelModesAndSizesThatDoNotDivideTheImageAreReadAtFullResolution) {
  const std::vector<std::string> channels = {"R", "G"};
  Planes planes(kWindow, channels);
  for (const auto& [mode, size] : {std::pair{Imf::ONE_LEVEL, 16u}, std::pair{Imf::ONE_LEVEL, 256u},
                                   std::pair{Imf::MIPMAP_LEVELS, 32u}, std::pair{Imf::ONE_LEVEL, 1u}}) {
    Imf::Header header = header_of(kWindow, kWindow, channels);
    header.setTileDescription(Imf::TileDescription(size, size + 3, mode));
    {
      Imf::TiledOutputFile file(path("a.exr").c_str(), header);
      for (int level = 0; level < file.numLevels(); ++level) {
        file.setFrameBuffer(planes.frame);
        file.writeTiles(0, file.numXTiles(level) - 1, 0, file.numYTiles(level) - 1, level);
      }
    }
    expect_values(load_image(path("a.exr")), kWindow, kWindow);
    expect_values(decode_image("a.exr", bytes_of(path("a.exr"))), kWindow, kWindow);
  }
}

TEST_F(ExrFiles, TheDisplayWindowIsTheImageWhateverTheDataWindowCovers) {
  Planes planes(kWindow, {"R"});
  for (const Imath::Box2i& display :
       {Imath::Box2i(Imath::V2i(0, 0), Imath::V2i(199, 119)),      // around it
        Imath::Box2i(Imath::V2i(10, 20), Imath::V2i(30, 40)),      // in it
        Imath::Box2i(Imath::V2i(-20, 90), Imath::V2i(20, 200)),    // across a corner
        Imath::Box2i(Imath::V2i(500, 0), Imath::V2i(520, 10))}) {  // elsewhere
    {
      Imf::OutputFile file(path("a.exr").c_str(), header_of(display, kWindow, {"R"}));
      file.setFrameBuffer(planes.frame);
      file.writePixels(100);
    }
    expect_values(load_image(path("a.exr")), display, kWindow);
    const ImageSize size = read_image_size(path("a.exr"));
    EXPECT_EQ(size.width, display.max.x - display.min.x + 1);
    EXPECT_EQ(size.height, display.max.y - display.min.y + 1);
  }
}

TEST_F(ExrFiles, OfSeveralPartsTheFirstIsRead) {
  const Imath::Box2i other(Imath::V2i(0, 0), Imath::V2i(9, 9));
  Planes planes(kWindow, {"R", "G"});
  Planes others(other, {"Z"});
  std::vector<Imf::Header> headers = {header_of(kWindow, kWindow, {"R", "G"}),
                                      header_of(kWindow, other, {"Z"})};
  headers[0].setName("beauty");
  headers[1].setName("depth");
  for (Imf::Header& header : headers) header.setType(Imf::SCANLINEIMAGE);
  {
    Imf::MultiPartOutputFile file(path("a.exr").c_str(), headers.data(), 2);
    for (int part : {1, 0}) {
      Imf::OutputPart output(file, part);
      output.setFrameBuffer(part == 0 ? planes.frame : others.frame);
      output.writePixels(part == 0 ? 100 : 10);
    }
  }
  const Image image = load_image(path("a.exr"));
  EXPECT_THAT(image.channels, ElementsAre("R", "G"));
  expect_values(image, kWindow, kWindow);
}

TEST_F(ExrFiles, ChannelsOfAllTypesKeepTheirValues) {
  const std::uint32_t ids[] = {0, 1, 7, 1u << 24};
  const std::uint16_t halves[] = {half_from_float(0.5F), half_from_float(-65504.0F), half_from_float(6e-8F),
                                  0x7c00};
  const float floats[] = {1e-38F, -3e38F, 0.1F, 1e10F};
  Imf::Header header(4, 1);
  Imf::FrameBuffer frame;
  const auto add = [&](const char* name, Imf::PixelType type, const void* values) {
    header.channels().insert(name, Imf::Channel(type));
    frame.insert(name, Imf::Slice::Make(type, values, header.dataWindow()));
  };
  add("id", Imf::UINT, ids);
  add("R", Imf::HALF, halves);
  add("Z", Imf::FLOAT, floats);
  {
    Imf::OutputFile file(path("a.exr").c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(1);
  }
  const Image image = load_image(path("a.exr"));
  ASSERT_THAT(image.channels, ElementsAre("R", "Z", "id"));
  for (int x = 0; x < 4; ++x) {
    EXPECT_EQ(image.at(x, 0)[0], float_from_half(halves[x]));
    EXPECT_EQ(image.at(x, 0)[1], floats[x]);
    EXPECT_EQ(image.at(x, 0)[2], static_cast<float>(ids[x]));
  }
}

// What OpenImageIO 2.4 makes of the same files.
TEST_F(ExrFiles, ColoursComeBeforeAlphaAndDepthInEveryLayer) {
  const std::vector<std::vector<std::string>> orders = {
      {"R", "G", "B", "A"},
      {"Y", "A"},
      {"R", "G", "B", "A", "Z", "coverage", "id"},
      {"r", "g", "b", "alpha", "depth"},
      {"R", "N.X", "N.Y", "N.Z", "diffuse.R", "diffuse.G", "diffuse.B", "diffuse.A", "diffuse.direct.R"},
      {"X", "Y", "Z", "A"},
      {"X", "Z", "A"},
      {"A", "Z", "U", "V"},
      {"U", "V", "X"}};
  for (const auto& order : orders) {
    save_image(path("a.exr"), Image(2, 2, order));
    EXPECT_EQ(load_image(path("a.exr")).channels, order);
  }
}

TEST_F(ExrFiles, AlphaOfTheFirstLayerThatHasItIsDroppedOrKeptAlone) {
  Image image(2, 1, {"R", "G", "B", "A"});
  image.pixels = {1.0F, 2.0F, 3.0F, 0.5F, 4.0F, 5.0F, 6.0F, 0.25F};
  save_image(path("a.exr"), image);
  const auto bytes = bytes_of(path("a.exr"));
  EXPECT_EQ(decode_image("a", bytes).pixels, image.pixels);
  DecodeOptions options;
  options.alpha = AlphaUse::drop;
  EXPECT_EQ(decode_image("a", bytes, options).pixels, (std::vector<float>{1, 2, 3, 4, 5, 6}));
  options.alpha = AlphaUse::only;
  EXPECT_EQ(decode_image("a", bytes, options).pixels, (std::vector<float>{0.5F, 0.25F}));
}

TEST_F(ExrFiles, SubsampledAndDeepPixelsAreRefusedWithTheReason) {
  {
    Imf::Header header(4, 4);
    header.channels().insert("BY", Imf::Channel(Imf::HALF, 2, 2));
    const std::uint16_t zeros[4] = {};
    Imf::FrameBuffer frame;
    frame.insert("BY", Imf::Slice::Make(Imf::HALF, zeros, header.dataWindow(), 0, 0, 2, 2));
    Imf::OutputFile file(path("chroma.exr").c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(4);
  }
  {
    Imf::Header header(1, 1);
    header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    header.setType(Imf::DEEPSCANLINE);
    header.compression() = Imf::ZIPS_COMPRESSION;
    unsigned int count = 1;
    float depth = 2.0F;
    float* samples = &depth;
    Imf::DeepFrameBuffer frame;
    frame.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(&count), 4, 4));
    frame.insert("Z", Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(&samples), sizeof(samples),
                                     sizeof(samples), sizeof(float)));
    Imf::DeepScanLineOutputFile file(path("deep.exr").c_str(), header);
    file.setFrameBuffer(frame);
    file.writePixels(1);
  }
  for (const auto& [name, reason] :
       {std::pair{"chroma.exr", "BY is subsampled"}, std::pair{"deep.exr", "deep samples"}}) {
    try {
      load_image(path(name));
      FAIL() << name;
    } catch (const FileError& e) {
      EXPECT_THAT(e.what(), testing::StartsWith(path(name)));
      EXPECT_THAT(e.what(), HasSubstr(reason));
    }
  }
}

// The header of an image of 1 x 18000 is changed to claim 18000 x 18000, 2 GB.
TEST_F(ExrFiles, AClaimThatTheBytesCannotHoldIsRefusedBeforeItIsAllocated) {
  save_image(path("a.exr"), Image(1, 18000, {"R", "G", "B"}));
  std::vector<unsigned char> bytes = bytes_of(path("a.exr"));
  for (const std::string name : {"dataWindow", "displayWindow"}) {
    const std::string key = name + '\0' + "box2i" + '\0';
    const auto at = std::search(bytes.begin(), bytes.end(), key.begin(), key.end());
    ASSERT_NE(at, bytes.end());
    const std::int32_t last_column = 17999;
    // After the attribute's size: first column, first row, last column, last row.
    std::memcpy(&*at + key.size() + 4 + 8, &last_column, sizeof(last_column));
  }
  std::ofstream(path("b.exr"), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  for (const auto& read : {std::function<void()>([&] { load_image(path("b.exr")); }),
                           std::function<void()>([&] { decode_image(path("b.exr"), bytes); })}) {
    try {
      read();
      FAIL() << "no error";
    } catch (const FileError& e) {
      EXPECT_THAT(e.what(), HasSubstr("bytes can hold"));
    }
  }
}

TEST_F(ExrFiles, OpenExrReadsWhatWasWritten) {
  for (const bool as_half : {false, true}) {
    // Smooth at the top, which packs well, and noise below, which does not; the last block has 5 rows.
    Image image(33, 16 * 70 + 5, {"B", "id", "A", "a channel whose name is longer than 31 bytes"});
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      const auto noise = static_cast<std::uint32_t>(hash64(i));
      image.pixels[i] =
          i < image.pixels.size() / 2 ? 0.5F : unit_float(noise) * (1.0F + unit_float(noise * 7919u));
      if (as_half) image.pixels[i] = float_from_half(half_from_float(image.pixels[i]));
    }
    save_image(path("a.exr"), image, as_half ? PixelFormat::half : PixelFormat::float32);

    Imf::InputFile file(path("a.exr").c_str());
    EXPECT_TRUE(file.isComplete());
    EXPECT_EQ(file.header().compression(), Imf::ZIP_COMPRESSION);
    EXPECT_EQ(file.header().displayWindow(), Imath::Box2i(Imath::V2i(0, 0), Imath::V2i(32, 16 * 70 + 4)));
    EXPECT_EQ(file.header().typedAttribute<Imf::StringAttribute>("Software").value(), "mirrorbake");
    EXPECT_EQ(file.header().channels().findChannel("id")->type, as_half ? Imf::HALF : Imf::FLOAT);
    std::vector<float> pixels(image.pixels.size());
    Imf::FrameBuffer frame;
    for (std::size_t c = 0; c < 4; ++c) {
      frame.insert(image.channels[c],
                   Imf::Slice::Make(Imf::FLOAT, pixels.data() + c, file.header().dataWindow(), 16, 16 * 33));
    }
    file.setFrameBuffer(frame);
    file.readPixels(0, 16 * 70 + 4);
    EXPECT_EQ(pixels, image.pixels);
  }
}

TEST_F(ExrFiles, AreTheSameBytesOnAnyNumberOfThreads) {
  Image image(64, 300, {"R", "G", "B"});
  for (std::size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = unit_float(std::uint32_t(hash64(i)));
  save_image(path("none.exr"), image);
  set_exr_threads(3);
  save_image(path("three.exr"), image);
  set_exr_threads(0);
  EXPECT_EQ(bytes_of(path("none.exr")), bytes_of(path("three.exr")));
  EXPECT_THROW(set_exr_threads(-1), InvalidArgument);
  EXPECT_THROW(set_exr_threads(1025), InvalidArgument);
}

TEST_F(ExrFiles, RowsWhoseBlocksExceedTheFormatAreAnErrorAndLeaveNothing) {
  std::vector<std::string> channels;
  for (int c = 0; c < 256; ++c) channels.push_back("c" + std::to_string(c));
  const std::vector<float> row((std::size_t{1} << 25) + channels.size());
  const int width = static_cast<int>(row.size() / channels.size());
  EXPECT_THROW(save_image(path("a.exr"), width, 1, channels, row, PixelFormat::float32), FileError);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(ExrFiles, AChannelNameThatTheFormatCannotHoldIsAnErrorAndLeavesNothing) {
  for (const std::string& name : {std::string(), std::string(256, 'a'), std::string("a\0b", 3)}) {
    EXPECT_THROW(save_image(path("a.exr"), Image(1, 1, {name})), FileError);
  }
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace mirrorbake
