// Parts, layers and colours of EXR files that OpenEXR's own writers make.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/image_io.hpp"

namespace mirrorbake {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

class ExrChoice : public testing::Test {
 protected:
  void SetUp() override {
    path_ = (fs::temp_directory_path() / ("mirrorbake_exr_choice_" + std::to_string(::getpid()) + ".exr"))
                .string();
  }
  void TearDown() override { fs::remove(path_); }

  // One pixel; channel c has the value c + 1.
  void write(const std::vector<std::string>& channels, const std::function<void(Imf::Header&)>& change = {}) {
    Imf::Header header(1, 1);
    if (change) change(header);
    write_parts({channels}, {header});
  }
  void write_parts(const std::vector<std::vector<std::string>>& parts, std::vector<Imf::Header> headers) {
    std::vector<std::vector<float>> values;
    std::vector<Imf::FrameBuffer> frames(parts.size());
    for (std::size_t p = 0; p < parts.size(); ++p) {
      headers[p].setName("part" + std::to_string(p));
      headers[p].setType(Imf::SCANLINEIMAGE);
      values.emplace_back(parts[p].size());
      for (std::size_t c = 0; c < parts[p].size(); ++c) {
        values[p][c] = static_cast<float>(10 * p + c + 1);
        headers[p].channels().insert(parts[p][c], Imf::Channel(Imf::FLOAT));
        frames[p].insert(parts[p][c], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(&values[p][c]), 4, 4));
      }
    }
    Imf::MultiPartOutputFile file(path_.c_str(), headers.data(), static_cast<int>(headers.size()));
    for (std::size_t p = 0; p < parts.size(); ++p) {
      Imf::OutputPart part(file, static_cast<int>(p));
      part.setFrameBuffer(frames[p]);
      part.writePixels(1);
    }
  }
  std::string error_of(const std::function<void()>& work) const {
    try {
      work();
    } catch (const FileError& e) {
      return e.what();
    }
    return "no error";
  }
  Image colours(const ImageChoice& choice = {}) const {
    return colours_of(path_, load_image(path_, {}, choice));
  }

  std::string path_;
};

TEST_F(ExrChoice, TheFirstPartWithColoursIsReadOrTheOneThatIsNamed) {
  write_parts({{"Z"}, {"R", "G", "B"}}, {Imf::Header(1, 1), Imf::Header(1, 1)});
  EXPECT_EQ(load_image(path_).pixels, (std::vector<float>{11, 12, 13}));
  EXPECT_EQ(load_image(path_, {}, {"part0", ""}).pixels, (std::vector<float>{1}));
  EXPECT_EQ(load_image(path_, {}, {"1", ""}).pixels, (std::vector<float>{11, 12, 13}));
  EXPECT_THAT(error_of([&] { load_image(path_, {}, {"beauty", ""}); }), HasSubstr("one of part0, part1"));
}

TEST_F(ExrChoice, ALayerIsReadWithoutItsName) {
  write({"View.Combined.R", "View.Combined.G", "View.Combined.B", "View.Depth.Z"});
  const Image image = load_image(path_, {}, {"", "View.Combined"});
  EXPECT_THAT(image.channels, ElementsAre("R", "G", "B"));
  EXPECT_EQ(image.pixels, (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(colours().pixels, (std::vector<float>{1, 2, 3}));  // the only layer that has them
  EXPECT_THAT(error_of([&] {
                load_image(path_, {}, {"", "Glossy"});
              }),
              HasSubstr("one of View.Combined, View.Depth"));
}

TEST_F(ExrChoice, ColoursInSeveralLayersHaveToBeChosen) {
  write({"a.R", "a.G", "a.B", "b.R", "b.G", "b.B"});
  EXPECT_THAT(error_of([&] { colours(); }), HasSubstr("layers a, b"));
  EXPECT_EQ(colours({"", "b"}).pixels, (std::vector<float>{4, 5, 6}));
}

TEST_F(ExrChoice, DepthAndAlphaAreNotColours) {
  write({"R", "G", "B", "A", "Z"});
  EXPECT_EQ(colours().pixels, (std::vector<float>{1, 2, 3}));
  write({"Y", "A"});
  EXPECT_EQ(colours().pixels, (std::vector<float>{1}));
  for (const std::vector<std::string>& channels :
       {std::vector<std::string>{"Z"}, std::vector<std::string>{"X", "Y", "Z"},
        std::vector<std::string>{"A"}}) {
    write(channels);
    EXPECT_THAT(error_of([&] { colours(); }), HasSubstr("expected colours"));
  }
}

TEST_F(ExrChoice, ADotBeforeANameIsNoLayer) {
  write({".R", ".G", ".B"});
  EXPECT_THAT(load_image(path_).channels, ElementsAre("R", "G", "B"));
}

TEST_F(ExrChoice, NamesThatAreNotUtf8BecomeSo) {
  write({"caf\xe9"});
  EXPECT_THAT(load_image(path_).channels, ElementsAre("caf\xef\xbf\xbd"));
}

// Of XYZ as primaries, the white of Rec. 709 is (0.9505, 1, 1.0891) (IEC 61966-2-1).
TEST_F(ExrChoice, ChromaticitiesAreApplied) {
  const Imf::Chromaticities xyz({1, 0}, {0, 1}, {0, 0}, {1 / 3.0F, 1 / 3.0F});
  const auto add = [&](Imf::Header& header) { Imf::addChromaticities(header, xyz); };
  write({"R", "G", "B", "Z"}, add);
  const Image image = load_image(path_);
  // 1, 2, 3 times the matrix of IEC 61966-2-1.
  EXPECT_NEAR(image.pixels[0], 3.2406F - 1.5372F * 2 - 0.4986F * 3, 2e-3F);
  EXPECT_NEAR(image.pixels[1], -0.9689F + 1.8758F * 2 + 0.0415F * 3, 2e-3F);
  EXPECT_NEAR(image.pixels[2], 0.0557F - 0.2040F * 2 + 1.0570F * 3, 2e-3F);
  EXPECT_EQ(image.pixels[3], 4.0F);
  write({"R", "G", "B"}, [](Imf::Header& h) { Imf::addChromaticities(h, Imf::Chromaticities()); });
  EXPECT_EQ(load_image(path_).pixels, (std::vector<float>{1, 2, 3}));  // Rec. 709 as it is
  write({"R", "G", "B"}, [](Imf::Header& h) {
    Imf::addChromaticities(h, Imf::Chromaticities({0, 0}, {0, 0}, {0, 0}, {0, 0}));
  });
  EXPECT_THAT(error_of([&] { load_image(path_); }), HasSubstr("chromaticities"));
}

TEST_F(ExrChoice, LuminanceAndChromaBecomeColours) {
  const Imath::Box2i window(Imath::V2i(4, -2), Imath::V2i(19, 13));
  std::vector<Imf::Rgba> pixels(16 * 16, Imf::Rgba(0.5F, 0.25F, 1.0F, 1.0F));
  {
    Imf::RgbaOutputFile file(path_.c_str(), window, window, Imf::WRITE_YC);
    file.setFrameBuffer(pixels.data() - 4 + 2 * 16, 1, 16);
    file.writePixels(16);
  }
  const Image image = load_image(path_);
  EXPECT_THAT(image.channels, ElementsAre("R", "G", "B"));
  for (int i = 0; i < 256; ++i) {
    EXPECT_NEAR(image.pixels[3 * static_cast<std::size_t>(i)], 0.5F, 5e-3F);
    EXPECT_NEAR(image.pixels[3 * static_cast<std::size_t>(i) + 1], 0.25F, 5e-3F);
    EXPECT_NEAR(image.pixels[3 * static_cast<std::size_t>(i) + 2], 1.0F, 5e-3F);
  }
}

TEST_F(ExrChoice, AnAttributeLongerThanTheFileIsRefusedBeforeItIsRead) {
  std::string bytes("\x76\x2f\x31\x01\x02\0\0\0Software\0string\0", 24);
  bytes += std::string("\x0a\x00\x68\x61", 4) + std::string(40, 'n');  // 1.6 GB
  EXPECT_THAT(error_of([&] {
                decode_image("memory", {reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()});
              }),
              HasSubstr("an attribute of its header claims"));
}

TEST_F(ExrChoice, AnEmptyHeaderIsRefusedBeforeWhatFollowsIsRead) {
  // Single, and of several parts; behind the empty header the same claim of 1.6 GB.
  for (const char parts : {'\x00', '\x10'}) {
    std::string bytes("\x76\x2f\x31\x01\x02", 5);
    bytes += parts;
    bytes += std::string("\0\0\0Software\0string\0", 19) + std::string("\x0a\x00\x68\x61", 4) +
             std::string(40, 'n');
    EXPECT_THAT(
        error_of([&] {
          decode_image("memory", {reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()});
        }),
        HasSubstr("its header is empty"));
  }
}

TEST_F(ExrChoice, AnAttributeWhoseValueHasAnotherLengthThanItSaysIsRefused) {
  const auto attribute = [](const std::string& type, const std::string& value) {
    const auto size = static_cast<std::uint32_t>(value.size());
    std::string bytes = std::string("\x76\x2f\x31\x01\x02\0\0\0some", 12) + '\0' + type + '\0';
    bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
    // Where OpenEXR would read on, an attribute may claim anything.
    return bytes + value + std::string(64, '\x7f');
  };
  const std::string zeros(40, '\0');
  const std::pair<const char*, std::string> wrong[] = {
      {"chlist", std::string("R\0", 2) + zeros.substr(0, 30)},
      {"box2i", zeros.substr(0, 15)},
      {"compression", zeros.substr(0, 2)},
      {"preview", std::string("\x10\0\0\0\x10\0\0\0", 8) + zeros.substr(0, 8)},
      {"stringvector", std::string("\xff\xff\xff\x7f", 4) + zeros},
      {"idmanifest", std::string("\xff\xff\xff\x7f", 4) + zeros},
  };
  for (const auto& [type, value] : wrong) {
    const std::string bytes = attribute(type, value);
    EXPECT_THAT(
        error_of([&] {
          decode_image("memory", {reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()});
        }),
        testing::AnyOf(HasSubstr("not the size of its type"), HasSubstr("a text of its header claims")))
        << type;
  }
}

}  // namespace
}  // namespace mirrorbake
