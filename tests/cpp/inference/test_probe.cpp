#include "mirrorbake/inference/probe.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "mirror_sphere.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"

namespace mirrorbake {
namespace {

const Proxy kBox{Box{{0.2F, 0.1F, 0.0F}, {3.0F, 2.0F, 4.0F}}, {0.0F, 0.0F, 0.0F}};
constexpr int kImage = 48;

// A renderer of the part's pixels: `tint` times what the matrix says, and `constant`.
struct KnownRenderer {
  RenderingMatrix matrix;
  glm::vec3 tint{1.0F};
  float constant = 0.0F;
  float step = 0.0F;
  int* calls = nullptr;

  std::vector<float> operator()(std::span<const float> texels) const {
    if (calls != nullptr) ++*calls;
    const std::vector<float> rows = multiply(matrix, texels, 3);
    std::vector<float> image(3 * kImage * kImage, constant);
    for (std::size_t r = 0; r < matrix.rows(); ++r) {
      for (std::size_t c = 0; c < 3; ++c) {
        float& value = image[3 * matrix.row_pixels[r] + c];
        value += tint[static_cast<int>(c)] * rows[3 * r + c];
        if (step > 0.0F) value = step * std::round(value / step);
      }
    }
    return image;
  }
};

// One sample a pixel, looked up as `model` does: what a renderer's fragment does.
RenderingMatrix fragments(const TexelTopology& topology, const RunTimeModel& model) {
  SurfaceSamples samples = testing::mirror_sphere_samples(kImage, 1);
  std::fill(samples.part.begin(), samples.part.end(), 0);
  return build_rendering_matrix(samples, 0, kBox, topology, model);
}

// Largest difference of any entry in rows that both have; −1 if a row of `b` is none of a's.
float largest_difference(const RenderingMatrix& a, const RenderingMatrix& b) {
  float largest = 0;
  std::vector<float> dense(a.columns);
  std::size_t q = 0;
  for (std::size_t r = 0; r < b.rows(); ++r) {
    while (q < a.rows() && a.row_pixels[q] != b.row_pixels[r]) ++q;
    if (q == a.rows()) return -1.0F;
    std::fill(dense.begin(), dense.end(), 0.0F);
    for (std::uint64_t e = a.row_offsets[q]; e < a.row_offsets[q + 1]; ++e)
      dense[a.texels[e]] += a.weights[e];
    for (std::uint64_t e = b.row_offsets[r]; e < b.row_offsets[r + 1]; ++e)
      dense[b.texels[e]] -= b.weights[e];
    for (const float value : dense) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

TEST(Probe, FindsEveryEntryOfARendererWithoutLookingInside) {
  for (const TexelTopology& topology :
       {TexelTopology::cube(64), TexelTopology::cube(128), TexelTopology::dual_paraboloid(64)}) {
    int calls = 0;
    const KnownRenderer renderer{
        fragments(topology, web_run_time()), {1.0F, 0.9F, 0.4F}, 0.25F, 0.0F, &calls};
    const ProbedMatrix probed = probe_rendering_matrix(topology, renderer);
    EXPECT_EQ(probed.renderings, calls);
    EXPECT_LE(calls, 64);
    EXPECT_EQ(probed.matrix.rows() + probed.missing.size(), renderer.matrix.rows());
    EXPECT_LE(probed.missing.size(), renderer.matrix.rows() / 100);
    // Values of up to 1.25 in float32, the constant taken off, over a tint of 0.4.
    EXPECT_GE(largest_difference(renderer.matrix, probed.matrix), 0.0F);
    EXPECT_LE(largest_difference(renderer.matrix, probed.matrix), 2e-6F);
    for (std::size_t r = 0; r < probed.matrix.rows(); ++r) {
      EXPECT_NEAR(probed.scales[3 * r + 2], 0.4F, 1e-6F);
    }
  }
}

TEST(Probe, NoticesARendererThatReadsElsewhereThanItSeems) {
  const TexelTopology topology = TexelTopology::cube(32);
  const KnownRenderer usual{fragments(topology, web_run_time())};
  // A second read on the opposite side, too faint to widen what the covariance shows by much.
  const TestRenderer odd = [&](std::span<const float> texels) {
    std::vector<float> image = usual(texels);
    std::vector<float> turned(texels.size());
    for (std::size_t t = 0; t < topology.texels(); ++t) {
      const TexelPlace place = topology.place(static_cast<std::uint32_t>(t));
      const std::uint32_t other = topology.index(
          {place.level, place.face ^ 1, place.row, topology.width(place.level) - 1 - place.column});
      std::copy_n(texels.begin() + 3 * static_cast<std::ptrdiff_t>(other), 3,
                  turned.begin() + 3 * static_cast<std::ptrdiff_t>(t));
    }
    const std::vector<float> ghost = usual(turned);
    for (std::size_t i = 0; i < image.size(); ++i) image[i] = 0.995F * image[i] + 0.005F * ghost[i];
    return image;
  };
  const ProbedMatrix probed = probe_rendering_matrix(topology, odd);
  // What is left reads the same texels on both ways, if any.
  EXPECT_GE(probed.missing.size(), usual.matrix.rows() * 9 / 10);
}

TEST(Probe, OfEightBitsIsAsGoodAsItsSteps) {
  const TexelTopology topology = TexelTopology::cube(32);
  const float step = 1.0F / 255.0F;
  const KnownRenderer renderer{fragments(topology, web_run_time()), glm::vec3(1.0F), 0.0F, step};
  const ProbedMatrix probed = probe_rendering_matrix(topology, renderer, {.step = step});
  // At the rim of the sphere footprints are wide, and their weights less than a step.
  EXPECT_LE(probed.missing.size(), renderer.matrix.rows() / 4);
  // Half a step each for what is lit, and as much for the sum that the row is divided by.
  EXPECT_LE(largest_difference(renderer.matrix, probed.matrix), 8.0F * step);
}

TEST(Probe, SaysWhichPixelsItCouldNotResolve) {
  const TexelTopology topology = TexelTopology::cube(64);
  const KnownRenderer renderer{fragments(topology, reference_run_time())};
  const ProbedMatrix few = probe_rendering_matrix(topology, renderer, {.most_renderings = 20});
  EXPECT_LE(few.renderings, 20);
  EXPECT_GT(few.missing.size(), 0u);
  EXPECT_EQ(few.matrix.rows() + few.missing.size(), renderer.matrix.rows());
  EXPECT_LE(largest_difference(renderer.matrix, few.matrix), 2e-6F);
}

TEST(Probe, HasTheSameBitsOnAnyNumberOfThreads) {
  const TexelTopology topology = TexelTopology::cube(32);
  const KnownRenderer renderer{fragments(topology, web_run_time())};
  const ProbedMatrix many = probe_rendering_matrix(topology, renderer);
  const ThreadLimit one(1);
  const ProbedMatrix alone = probe_rendering_matrix(topology, renderer);
  EXPECT_EQ(many.matrix.texels, alone.matrix.texels);
  EXPECT_EQ(many.matrix.weights, alone.matrix.weights);
  EXPECT_EQ(many.errors, alone.errors);
}

TEST(Probe, OfABlackPictureHasNoRows) {
  const ProbedMatrix probed = probe_rendering_matrix(
      TexelTopology::cube(4), [](std::span<const float>) { return std::vector<float>(12, 0.5F); });
  EXPECT_EQ(probed.matrix.rows(), 0u);
  EXPECT_EQ(probed.missing.size(), 0u);
}

TEST(Probe, RefusesRenderersThatAreNone) {
  const TexelTopology topology = TexelTopology::cube(4);
  const auto of = [](std::size_t first, std::size_t later, float value) {
    return [=, calls = 0](std::span<const float>) mutable {
      return std::vector<float>(calls++ == 0 ? first : later, value);
    };
  };
  EXPECT_THROW(probe_rendering_matrix(topology, of(0, 0, 0.0F)), InvalidArgument);
  EXPECT_THROW(probe_rendering_matrix(topology, of(4, 4, 0.0F)), InvalidArgument);
  EXPECT_THROW(probe_rendering_matrix(topology, of(6, 3, 0.0F)), InvalidArgument);
  EXPECT_THROW(probe_rendering_matrix(topology, of(3, 3, NAN)), InvalidArgument);
  const auto fine = of(3, 3, 0.0F);
  EXPECT_THROW(probe_rendering_matrix(topology, fine, {.most_renderings = 15}), InvalidArgument);
  EXPECT_THROW(probe_rendering_matrix(topology, fine, {.step = -0.1F}), InvalidArgument);
  EXPECT_THROW(probe_rendering_matrix(topology, fine, {.step = 0.2F}), InvalidArgument);
  EXPECT_THROW(probe_rendering_matrix(topology, fine, {.tolerance = 0.0F}), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
