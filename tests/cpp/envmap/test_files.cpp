#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include <glm/geometric.hpp>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/sampling.hpp"
#include "mirrorbake/envmap/compare.hpp"
#include "mirrorbake/envmap/conventions.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/envmap/half_envmap.hpp"
#include "mirrorbake/envmap/ktx2.hpp"
#include "mirrorbake/envmap/mipmap.hpp"
#include "mirrorbake/envmap/resample.hpp"
#include "mirrorbake/image/atomic_file.hpp"
#include "mirrorbake/image/half.hpp"

namespace mirrorbake {
namespace {

namespace fs = std::filesystem;

class EnvMapFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("mirrorbake_envmap_files_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  fs::path folder_;
};

// Every texel holds the direction of its centre: what a labelled picture shows, to every texel.
EnvMap directions(const char* projection, int width, int height) {
  EnvMap map = make_envmap({parse_projection(projection), width, height, 1, 3}, default_channels(3));
  for (int face = 0; face < face_count(map.layout.projection); ++face) {
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column) {
        const glm::dvec3 d = direction_from_point(map.layout.projection, face, column_center(column, width),
                                                  row_center(row, height));
        for (int c = 0; c < 3; ++c) {
          map.values[map.layout.index(0, face, row, column) + static_cast<std::size_t>(c)] =
              static_cast<float>(d[c]);
        }
      }
    }
  }
  return map;
}

TEST(Half, EveryFiniteHalfSurvivesAndNeighboursRoundToEven) {
  for (std::uint32_t bits = 0; bits < 65536; ++bits) {
    const std::uint16_t half = static_cast<std::uint16_t>(bits);
    const float value = float_from_half(half);
    if (std::isnan(value)) {
      EXPECT_TRUE(std::isnan(float_from_half(half_from_float(value))));
      continue;
    }
    EXPECT_EQ(half_from_float(value), half);
    // Half way to the next larger magnitude: to the even one.
    const float next = float_from_half(static_cast<std::uint16_t>(bits + 1));
    if ((bits & 0x7fffu) < 0x7bffu) {
      EXPECT_EQ(half_from_float(0.5F * (value + next)) & 1u, 0u) << bits;
      EXPECT_EQ(half_from_float(std::nextafter(0.5F * (value + next), value)), half) << bits;
    }
  }
  EXPECT_EQ(half_from_float(65519.0F), 0x7bffu);
  EXPECT_EQ(half_from_float(65520.0F), 0x7c00u);
  EXPECT_EQ(half_from_float(1e-10F), 0u);
}

TEST(Half, AMapComesBackRoundedAndWhatIsTooLargeIsClampedAndCounted) {
  EnvMap map = directions("cube", 8, 8);
  map.values[0] = 1e30F;
  map.values[1] = -std::numeric_limits<float>::infinity();
  map.values[2] = 65519.0F;  // would round to 65504
  map.values[3] = std::numeric_limits<float>::quiet_NaN();
  std::size_t clamped = 0;
  const HalfEnvMap half = half_from_float(map, &clamped);
  const EnvMap again = float_from_half(half);
  EXPECT_EQ(clamped, 3u);
  EXPECT_EQ(again.layout, map.layout);
  EXPECT_EQ(again.channels, map.channels);
  EXPECT_EQ(again.values[0], 65504.0F);
  EXPECT_EQ(again.values[1], -65504.0F);
  EXPECT_EQ(again.values[2], 65504.0F);
  EXPECT_TRUE(std::isnan(again.values[3]));
  for (std::size_t i = 4; i < map.values.size(); ++i) {
    EXPECT_EQ(again.values[i], float_from_half(half_from_float(map.values[i])));
    EXPECT_NEAR(again.values[i], map.values[i], 0x1p-11F * std::abs(map.values[i]));
  }
  HalfEnvMap broken = half;
  broken.values.pop_back();
  EXPECT_THROW(float_from_half(broken), InvalidArgument);
}

TEST_F(EnvMapFiles, Ktx2ReturnsEveryLevelInTheFormatAskedFor) {
  for (const auto& [channels, format] : {std::pair{1, PixelFormat::half},
                                         {2, PixelFormat::half},
                                         {3, PixelFormat::half},
                                         {4, PixelFormat::automatic},
                                         {1, PixelFormat::float32},
                                         {3, PixelFormat::float32},
                                         {4, PixelFormat::float32}}) {
    EnvMap map = make_envmap({parse_projection("cube"), 20, 20, 1, channels});
    for (std::size_t i = 0; i < map.values.size(); ++i) {
      map.values[i] = 100.0F * unit_float(static_cast<std::uint32_t>(hash64(i)));
    }
    const EnvMap mips = build_mips(map, MipFilter::seamless);
    EXPECT_EQ(save_ktx2(path("a.KTX2"), mips, format).clamped_to_half, 0u);
    const EnvMap again = load_envmap(path("a.KTX2"));
    ASSERT_EQ(again.layout, mips.layout);
    for (std::size_t i = 0; i < mips.values.size(); ++i) {
      const float exact = mips.values[i];
      EXPECT_EQ(again.values[i],
                format == PixelFormat::float32 ? exact : float_from_half(half_from_float(exact)));
    }
  }
}

// Graphics hardware has no three-channel formats: the file stores RGBA.
TEST_F(EnvMapFiles, Ktx2StoresAlphaOneBesideThreeChannels) {
  EnvMap map = make_envmap({parse_projection("cube"), 1, 1, 1, 3});
  std::fill(map.values.begin(), map.values.end(), 0.5F);
  save_ktx2(path("a.ktx2"), map, PixelFormat::float32);
  std::ifstream in(path("a.ktx2"), std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  ASSERT_GE(bytes.size(), 6u * 16u);
  for (std::size_t texel = 0; texel < 6; ++texel) {
    float rgba[4];
    std::memcpy(rgba, bytes.data() + bytes.size() - 6 * 16 + texel * 16, sizeof rgba);
    EXPECT_THAT(rgba, testing::ElementsAre(0.5F, 0.5F, 0.5F, 1.0F));
  }
  // Without the note that alpha is to be read as 1 it is a channel like others.
  bytes.replace(bytes.find("KTXswizzle"), 3, "ktx");
  std::ofstream(path("b.ktx2"), std::ios::binary) << bytes;
  EXPECT_EQ(load_ktx2(path("b.ktx2")).layout.channels, 4);
}

TEST_F(EnvMapFiles, ContradictoryWishesAreErrorsAndWriteNothing) {
  const EnvMap cube = make_envmap({parse_projection("cube"), 2, 2, 1, 3});
  const EnvMap panorama = directions("latlong", 8, 4);
  EXPECT_THROW(save_envmap(path("a.ktx2"), cube, FaceLayout::cross), InvalidArgument);
  EXPECT_THROW(save_envmap(path("a.ktx2"), cube, FaceLayout::automatic, PixelFormat::uint8), FileError);
  EXPECT_THROW(save_envmap(path("a_{}.exr"), cube, FaceLayout::strip), InvalidArgument);
  EXPECT_THROW(save_envmap(path("a.exr"), cube, FaceLayout::files), InvalidArgument);
  EXPECT_THROW(save_envmap(path("a_{}.exr"), panorama), InvalidArgument);
  EXPECT_THROW(check_envmap_path(path("a.exr"), parse_projection("dual_paraboloid"), FaceLayout::cross),
               InvalidArgument);
  EXPECT_THROW(check_envmap_path(path("none/a.exr"), cube.layout.projection), FileError);
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(path("a")).parent_path()));
}

TEST_F(EnvMapFiles, Ktx2ClampsAndCounts) {
  EnvMap map = make_envmap({parse_projection("cube"), 1, 1, 1, 1});
  map.values = {1e6F, -1e6F, std::numeric_limits<float>::infinity(), 65504.0F, 0.0F, 1.0F};
  EXPECT_EQ(save_ktx2(path("a.ktx2"), map).clamped_to_half, 3u);
  EXPECT_EQ(load_ktx2(path("a.ktx2")).values,
            (std::vector<float>{65504.0F, -65504.0F, 65504.0F, 65504.0F, 0.0F, 1.0F}));
  EXPECT_THROW(save_ktx2(path("b.ktx2"), directions("latlong", 8, 4)), InvalidArgument);
}

TEST_F(EnvMapFiles, DamagedKtx2FilesAreErrorsAndNeverCrash) {
  save_ktx2(path("whole.ktx2"), build_mips(directions("cube", 8, 8), MipFilter::box));
  std::ifstream in(path("whole.ktx2"), std::ios::binary);
  const std::vector<char> text((std::istreambuf_iterator<char>(in)), {});
  std::vector<std::byte> bytes(text.size());
  std::transform(text.begin(), text.end(), bytes.begin(), [](char c) { return static_cast<std::byte>(c); });
  for (std::size_t length = 0; length < bytes.size(); length += 37) {
    write_file(path("broken.ktx2"), std::span(bytes).first(length));
    EXPECT_THROW(load_envmap(path("broken.ktx2")), FileError) << length;
  }
  int loaded = 0;
  for (std::uint64_t trial = 0; trial < 2000; ++trial) {
    std::vector<std::byte> changed = bytes;
    for (std::uint64_t i = 0; i < 1 + trial % 4; ++i) {
      changed[12 + hash64(trial, 2 * i) % 300] = static_cast<std::byte>(hash64(trial, 2 * i + 1) & 255u);
    }
    write_file(path("broken.ktx2"), changed);
    try {
      const EnvMap map = load_ktx2(path("broken.ktx2"), {.max_bytes = 1 << 24});
      EXPECT_EQ(map.values.size(), map.layout.size());
      ++loaded;
    } catch (const FileError&) {
    }
  }
  EXPECT_LT(loaded, 2000);
}

TEST_F(EnvMapFiles, EveryFaceLayoutComesBackAndIsRecognisedByItsShape) {
  const EnvMap cube = directions("cube", 6, 6);
  for (const FaceLayout layout : {FaceLayout::strip, FaceLayout::column, FaceLayout::grid, FaceLayout::cross,
                                  FaceLayout::vertical_cross}) {
    save_envmap(path("cube.exr"), cube, layout, PixelFormat::float32);
    EXPECT_EQ(load_envmap(path("cube.exr")).values, cube.values) << name_of(layout);
    EXPECT_EQ(load_envmap(path("cube.exr"), cube.layout.projection, layout).values, cube.values)
        << name_of(layout);
    EXPECT_EQ(parse_name<FaceLayout>(name_of(layout)), layout);
  }
  save_envmap(path("cube_{}.exr"), cube, FaceLayout::files, PixelFormat::float32);
  EXPECT_TRUE(fs::exists(path("cube_nz.exr")));
  EXPECT_EQ(load_envmap(path("cube_{}.exr")).values, cube.values);

  const EnvMap paraboloid = directions("dual_paraboloid", 5, 5);
  for (const FaceLayout layout : {FaceLayout::strip, FaceLayout::column}) {
    save_envmap(path("pair.exr"), paraboloid, layout, PixelFormat::float32);
    EXPECT_EQ(load_envmap(path("pair.exr"), paraboloid.layout.projection).values, paraboloid.values);
  }
  const EnvMap panorama = directions("latlong", 8, 4);
  save_envmap(path("panorama.exr"), panorama, FaceLayout::automatic, PixelFormat::float32);
  EXPECT_EQ(load_envmap(path("panorama.exr")).layout, panorama.layout);
}

// Texels that touch in a cross touch on the sphere: their directions differ by no more than a texel's size.
TEST_F(EnvMapFiles, FacesThatTouchInACrossTouchOnTheSphere) {
  for (const FaceLayout layout : {FaceLayout::cross, FaceLayout::vertical_cross}) {
    const Image image = pack_faces(directions("cube", 16, 16), 0, layout);
    int joints = 0;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const auto at = [&](int i, int j) {
          return glm::vec3(image.at(i, j)[0], image.at(i, j)[1], image.at(i, j)[2]);
        };
        const auto check = [&](int i, int j) {
          if (i >= image.width || j >= image.height || glm::length(at(x, y)) == 0.0F ||
              glm::length(at(i, j)) == 0.0F)
            return;
          EXPECT_LT(glm::length(at(x, y) - at(i, j)), 2.0F / 16 + 1e-6F) << x << ' ' << y;
          ++joints;
        };
        check(x + 1, y);
        check(x, y + 1);
      }
    }
    EXPECT_GT(joints, 6 * 2 * 15 * 16);
  }
}

TEST_F(EnvMapFiles, ShapesThatFitNothingAreErrorsThatNameTheFile) {
  save_image(path("odd.exr"), Image(7, 5, default_channels(3)));
  try {
    load_envmap(path("odd.exr"));
    FAIL() << "no error";
  } catch (const FileError& e) {
    EXPECT_THAT(e.what(), testing::AllOf(testing::HasSubstr("odd.exr"), testing::HasSubstr("7 x 5")));
  }
  EXPECT_THROW(load_envmap(path("odd.exr"), parse_projection("cube")), FileError);
  EXPECT_EQ(load_envmap(path("odd.exr"), parse_projection("angular")).layout.width, 7);
}

// Replaces the numbers of an EXR file's data and display windows by those of width × height.
void claim_size(const std::string& path, std::int32_t width, std::int32_t height) {
  std::string bytes;
  {
    std::ifstream in(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  for (const std::string window : {"dataWindow", "displayWindow"}) {
    const std::string attribute = window + std::string("\0box2i\0\x10\0\0\0", 11);
    const std::size_t at = bytes.find(attribute);
    ASSERT_NE(at, std::string::npos);
    const std::int32_t box[4] = {0, 0, width - 1, height - 1};
    std::memcpy(bytes.data() + at + attribute.size(), box, sizeof box);
  }
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// 60,000 × 30,000 are 21 GB, beyond the default limit; 60,000 × 4,000 are allowed, but the file ends first.
TEST_F(EnvMapFiles, AHeaderThatClaims60000ColumnsIsAnErrorBeforeItsPixelsAreAllocated) {
  for (const std::int32_t height : {30000, 4000}) {
    save_envmap(path("wide.exr"), directions("latlong", 8, 4));
    claim_size(path("wide.exr"), 60000, height);
    EXPECT_THROW(load_envmap(path("wide.exr")), FileError) << height;
  }
}

TEST_F(EnvMapFiles, SixtyThousandColumnsAreReadResampledAndSampled) {
  EnvMap wide = make_envmap({parse_projection("latlong"), 60000, 2, 1, 1}, std::vector<std::string>{"Y"});
  for (std::size_t i = 0; i < wide.values.size(); ++i) wide.values[i] = i % 60000 < 30000 ? 1.0F : 3.0F;
  save_envmap(path("wide.exr"), wide);
  const EnvMap read = load_envmap(path("wide.exr"), parse_projection("latlong"));
  EXPECT_EQ(read.values, wide.values);
  const EnvMap cube = resample(read, parse_projection("cube"), 16, 16);
  // −X and +X are the two halves.
  EXPECT_NEAR(cube.values[cube.layout.index(0, 1, 8, 8)], 1.0F, 1e-5F);
  EXPECT_NEAR(cube.values[cube.layout.index(0, 0, 8, 8)], 3.0F, 1e-5F);
  EXPECT_NEAR(integrate(cube)[0] / integrate(read)[0], 1.0, 1e-5);
}

// Directions per convention, from the documentation or source of each program: centre, right edge of the
// right quarter, top of its panorama.
TEST(Conventions, PanoramasLookWhereEachProgramLooks) {
  struct Case {
    const char* name;
    glm::vec3 center, right, up;
  };
  for (const Case& c :
       {Case{"mirrorbake", {0, 0, -1}, {1, 0, 0}, {0, 1, 0}},
        Case{"openexr", {0, 0, 1}, {-1, 0, 0}, {0, 1, 0}}, Case{"mitsuba", {0, 0, 1}, {-1, 0, 0}, {0, 1, 0}},
        Case{"oiio", {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, Case{"threejs", {1, 0, 0}, {0, 0, 1}, {0, 1, 0}}}) {
    const EnvMap foreign =
        convert_convention(directions("latlong", 64, 32), c.name, ConventionWay::to_foreign);
    const auto at = [&](int row, int column) {
      const float* texel = foreign.values.data() + foreign.layout.index(0, 0, row, column);
      return glm::vec3(texel[0], texel[1], texel[2]);
    };
    // The four texels around a point average to its direction, shortened a little.
    const auto around = [&](int row, int column) {
      return 0.25F * (at(row, column) + at(row - 1, column) + at(row, column - 1) + at(row - 1, column - 1));
    };
    EXPECT_LT(glm::length(around(16, 32) - c.center), 0.02F) << c.name;
    EXPECT_LT(glm::length(around(16, 48) - c.right), 0.02F) << c.name;
    EXPECT_LT(glm::length(at(0, 5) - c.up), 0.1F) << c.name;
  }
}

TEST(Conventions, CubesGoThereAndBackExactly) {
  const EnvMap cube = directions("cube", 8, 8);
  for (const char* name : {"mirrorbake", "openexr", "threejs", "ktx2"}) {
    const EnvMap there = convert_convention(cube, name, ConventionWay::to_foreign);
    EXPECT_EQ(convert_convention(there, name, ConventionWay::from_foreign).values, cube.values) << name;
  }
  EXPECT_THROW(convert_convention(cube, "oiio", ConventionWay::to_foreign), InvalidArgument);
  EXPECT_THROW(convert_convention(cube, "blender", ConventionWay::to_foreign), InvalidArgument);
  const EnvMap panorama = directions("latlong", 16, 8);
  for (const char* name : {"openexr", "mitsuba", "threejs"}) {
    const EnvMap there = convert_convention(panorama, name, ConventionWay::to_foreign);
    EXPECT_EQ(convert_convention(there, name, ConventionWay::from_foreign).values, panorama.values) << name;
  }
}

// ImfEnvmap.cpp of OpenEXR (CubeMap::pixelPosition): the top of ±X and ±Z is +y, of +Y it is +z, of −Y −z; to
// the right of +X is +z, of −X −z, of ±Y +x, of +Z −x, of −Z +x.
TEST(Conventions, OpenExrFacesAreOrientedAsInItsHeader) {
  const EnvMap exr = convert_convention(directions("cube", 8, 8), "openexr", ConventionWay::to_foreign);
  const auto at = [&](int face, int row, int column) {
    const float* texel = exr.values.data() + exr.layout.index(0, face, row, column);
    const glm::vec3 d(texel[0], texel[1], texel[2]);
    return d / std::max(std::max(std::abs(d.x), std::abs(d.y)), std::abs(d.z));
  };
  const float right = 0.625F;  // centre of column 6 of 8
  const float up = 0.875F;     // centre of row 0
  const glm::vec3 expected[6] = {{1, up, right},   {-1, up, -right}, {right, 1, up},
                                 {right, -1, -up}, {-right, up, 1},  {right, up, -1}};
  for (int face = 0; face < 6; ++face) {
    EXPECT_LT(glm::length(at(face, 0, 6) - expected[face]), 1e-5F) << "face " << face;
  }
}

TEST(Compare, MeasuresKnownDifferences) {
  EnvMap a = make_envmap({parse_projection("cube"), 4, 4, 1, 1});
  EnvMap b = a;
  std::fill(a.values.begin(), a.values.end(), 1.1F);
  std::fill(b.values.begin(), b.values.end(), 1.0F);
  const Comparison c = compare(a, b);
  EXPECT_NEAR(c.max_error, 0.1, 1e-6);
  EXPECT_NEAR(c.mean_error, 0.1, 1e-6);
  EXPECT_NEAR(c.rms_error, 0.1, 1e-6);
  EXPECT_NEAR(c.relative_l2, 0.1, 1e-6);
  EXPECT_NEAR(c.psnr, 20.0, 1e-4);
  EXPECT_NEAR(c.flux_ratio, 1.1, 1e-6);
  EXPECT_EQ(compare(a, a).psnr, std::numeric_limits<double>::infinity());
  a.values[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(compare(a, b).not_finite, 1u);
  EXPECT_NEAR(compare(a, b).mean_error, 0.1, 1e-6);
  EXPECT_THROW(compare(a, directions("latlong", 4, 4)), InvalidArgument);
}

// 64 texels a side show a direction to a quarter of a texel's 1.4 degrees where it is interpolated.
TEST_F(EnvMapFiles, APanoramaIsRecognisedByItsShapeWhateverCubeItIs) {
  const EnvMap cube = directions("cube", 64, 64);
  const EnvMap expected = directions("latlong", 256, 128);
  for (const auto& [name, layout] :
       {std::pair("strip.exr", FaceLayout::strip), std::pair("column.exr", FaceLayout::column),
        std::pair("cross.exr", FaceLayout::cross), std::pair("vertical.exr", FaceLayout::vertical_cross),
        std::pair("cube.ktx2", FaceLayout::automatic)}) {
    save_envmap(path(name), cube, layout, PixelFormat::float32);
    const Image panorama = load_panorama(path(name)).image;
    ASSERT_EQ(panorama.width, 256) << name;
    for (std::size_t i = 0; i < panorama.pixels.size(); ++i) {
      ASSERT_NEAR(panorama.pixels[i], std::max(expected.values[i], 0.0F), 0.01F) << name << ' ' << i;
    }
  }
  save_envmap(path("sky.exr"), expected, FaceLayout::automatic, PixelFormat::float32);
  const Panorama sky = load_panorama(path("sky.exr"));
  for (std::size_t i = 0; i < expected.values.size(); ++i) {
    ASSERT_EQ(sky.image.pixels[i], std::max(expected.values[i], 0.0F)) << i;
  }
}

TEST_F(EnvMapFiles, APictureThatIsNoPanoramaIsNoLight) {
  for (const auto& [width, height] :
       {std::pair(32, 32), std::pair(48, 32), std::pair(64, 48), std::pair(48, 64)}) {
    Image picture(width, height, {"R", "G", "B"});
    for (std::size_t i = 0; i < picture.pixels.size(); ++i) picture.pixels[i] = static_cast<float>(i % 7);
    save_image(path("picture.exr"), picture);
    try {
      load_panorama(path("picture.exr"));
      ADD_FAILURE() << width << " x " << height;
    } catch (const FileError& e) {
      EXPECT_NE(std::string(e.what()).find("expected a panorama"), std::string::npos);
    }
  }
}

TEST_F(EnvMapFiles, APanoramaIsFiniteAndNowhereBelow0) {
  Image image(2, 1, {"R", "G", "B"});
  image.pixels = {1, -2, 3, -0.5F, 5, 6};
  save_image(path("undershoots.exr"), image);
  const Panorama panorama = load_panorama(path("undershoots.exr"));
  EXPECT_EQ(panorama.image.pixels, (std::vector<float>{1, 0, 3, 0, 5, 6}));
  EXPECT_EQ(panorama.negative, 2U);
  image.pixels[4] = std::numeric_limits<float>::infinity();
  save_image(path("glows.exr"), image, PixelFormat::float32);
  EXPECT_THROW(load_panorama(path("glows.exr")), FileError);
  const Panorama repaired = load_panorama(path("glows.exr"), {.choice = {}, .repairs = true});
  EXPECT_EQ(repaired.image.pixels, (std::vector<float>{1, 0, 3, 0, 0, 6}));
  EXPECT_EQ(repaired.repaired, 1U);
}

TEST_F(EnvMapFiles, DepthAndAlphaAreNoLightAndGreyIsAllColours) {
  Image image(2, 1, {"R", "G", "B", "A", "Z"});
  image.pixels = {1, 2, 3, 0, 9, 4, 5, 6, 0, 9};
  save_image(path("deep.exr"), image);
  EXPECT_EQ(load_panorama(path("deep.exr")).image.pixels, (std::vector<float>{1, 2, 3, 4, 5, 6}));
  Image grey(2, 1, {"Y"});
  grey.pixels = {1, 2};
  save_image(path("grey.exr"), grey);
  EXPECT_EQ(load_panorama(path("grey.exr")).image.pixels, (std::vector<float>{1, 1, 1, 2, 2, 2}));
  Image depth(2, 1, {"Z"});
  save_image(path("z.exr"), depth);
  EXPECT_THROW(load_panorama(path("z.exr")), FileError);
}

}  // namespace
}  // namespace mirrorbake
