#include "mirrorbake/inference/rendering_matrix.hpp"

#include <gtest/gtest.h>

#include "mirror_sphere.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

const Proxy kBox{Box{{0.2F, 0.1F, 0.0F}, {3.0F, 2.0F, 4.0F}}, {0.0F, 0.0F, 0.0F}};

TEST(RenderingMatrix, EveryRowIsAMean) {
  const SurfaceSamples samples = testing::mirror_sphere_samples(48, 9);
  const CubePyramidLayout layout = CubePyramidLayout::full(32);
  for (int part : {0, 1}) {
    const RenderingMatrix a = build_rendering_matrix(samples, part, kBox, layout);
    ASSERT_GT(a.rows(), 700u);
    ASSERT_EQ(a.row_offsets.size(), a.rows() + 1);
    for (std::size_t r = 0; r < a.rows(); ++r) {
      float sum = 0;
      for (std::uint64_t e = a.row_offsets[r]; e < a.row_offsets[r + 1]; ++e) {
        sum += a.weights[e];
        ASSERT_GT(a.weights[e], 0.0F);
        ASSERT_LT(a.texels[e], layout.texels());
        if (e > a.row_offsets[r]) {
          ASSERT_GT(a.texels[e], a.texels[e - 1]);
        }
      }
      // Each of up to 9 × 8 weights is rounded once and added once.
      EXPECT_NEAR(sum, 1.0F, 5e-6F);
      EXPECT_TRUE(a.row_samples(r) >= 1 && a.row_samples(r) <= 9);
    }
  }
}

TEST(RenderingMatrix, AverageIsTheMeanOverTheRowsSamples) {
  const SurfaceSamples samples = testing::mirror_sphere_samples(16, 4);
  const CubePyramidLayout layout = CubePyramidLayout::full(8);
  const RenderingMatrix a = build_rendering_matrix(samples, 1, kBox, layout);
  std::vector<float> values(2 * samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    values[2 * i] = 1.0F;
    values[2 * i + 1] = static_cast<float>(samples.pixel[i]);
  }
  const std::vector<float> b = average_over_rows(a, values, 2);
  ASSERT_EQ(b.size(), 2 * a.rows());
  for (std::size_t r = 0; r < a.rows(); ++r) {
    EXPECT_EQ(b[2 * r], 1.0F);
    EXPECT_EQ(b[2 * r + 1], static_cast<float>(a.row_pixels[r]));
  }
}

TEST(RenderingMatrix, OfSomeTrianglesIsThatOfTheirSamplesAlone) {
  SurfaceSamples samples = testing::mirror_sphere_samples(24, 4);
  const CubePyramidLayout layout = CubePyramidLayout::full(16);
  samples.triangle.resize(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) samples.triangle[i] = static_cast<std::uint32_t>(i % 3);
  const std::vector<std::uint8_t> chosen{1, 0, 1};
  std::vector<float> values(samples.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i % 3);
  // The same by giving the samples of the other triangle to another part.
  SurfaceSamples moved = samples;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.triangle[i] == 1) moved.part[i] = 7;
  }
  const RenderingMatrix a = build_rendering_matrix(samples, {0, chosen}, kBox, layout);
  const RenderingMatrix b = build_rendering_matrix(moved, 0, kBox, layout);
  ASSERT_GT(a.rows(), 100u);
  EXPECT_EQ(a.texels, b.texels);
  EXPECT_EQ(a.weights, b.weights);
  EXPECT_EQ(a.member_offsets, b.member_offsets);
  EXPECT_EQ(average_over_rows(a, values, 1), average_over_rows(b, values, 1));
  EXPECT_LT(a.nonzeros(), build_rendering_matrix(samples, 0, kBox, layout).nonzeros());

  const std::vector<std::uint8_t> too_few{1, 1};
  EXPECT_THROW(build_rendering_matrix(samples, {0, too_few}, kBox, layout), InvalidArgument);
  samples.triangle.clear();
  EXPECT_THROW(build_rendering_matrix(samples, {0, chosen}, kBox, layout), InvalidArgument);
}

TEST(RenderingMatrix, SameBitsOnOneThread) {
  const SurfaceSamples samples = testing::mirror_sphere_samples(64, 4);
  const CubePyramidLayout layout = CubePyramidLayout::full(64);
  const RenderingMatrix all = build_rendering_matrix(samples, 0, kBox, layout);
  const ThreadLimit limit(1);
  const RenderingMatrix one = build_rendering_matrix(samples, 0, kBox, layout);
  EXPECT_EQ(all.texels, one.texels);
  EXPECT_EQ(all.weights, one.weights);
  EXPECT_EQ(all.row_offsets, one.row_offsets);
}

TEST(RenderingMatrix, APartThatNoPixelSeesHasNoRows) {
  const SurfaceSamples samples = testing::mirror_sphere_samples(16, 1);
  const CubePyramidLayout layout = CubePyramidLayout::full(8);
  const RenderingMatrix a = build_rendering_matrix(samples, 5, kBox, layout);
  EXPECT_EQ(a.rows(), 0u);
  EXPECT_EQ(a.nonzeros(), 0u);
  EXPECT_EQ(a.columns, layout.texels());
}

TEST(RenderingMatrix, RejectsArraysOfDifferentLengths) {
  SurfaceSamples samples = testing::mirror_sphere_samples(16, 1);
  samples.reflection.pop_back();
  EXPECT_THROW(build_rendering_matrix(samples, 0, kBox, CubePyramidLayout::full(8)), InvalidArgument);
}

TEST(RenderingMatrix, RejectsFootprintsOutOfRange) {
  const SurfaceSamples samples = testing::mirror_sphere_samples(16, 1);
  for (float scale : {0.0F, -1.0F, 1e6F, std::nanf("")}) {
    RunTimeModel model = web_run_time();
    model.footprint_scale = scale;
    EXPECT_THROW(build_rendering_matrix(samples, 0, kBox, CubePyramidLayout::full(8), model),
                 InvalidArgument);
  }
}

}  // namespace
}  // namespace mirrorbake
