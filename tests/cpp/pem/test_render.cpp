#include "mirrorbake/pem/render.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mirror_sphere.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/inference/rendering_matrix.hpp"

namespace mirrorbake {
namespace {

const Proxy kBox{Box{{0.1F, 0.0F, 0.2F}, {4.0F, 3.0F, 5.0F}}, {0.0F, 0.2F, 0.0F}};
const Proxy kEllipsoid{Ellipsoid{{0.0F, 0.0F, 0.0F}, {1.5F, 1.2F, 1.3F}}, {0.0F, 0.0F, 0.0F}};

// The rendering matrix and the renderer are the same linear function: for random maps, and for maps with a
// single texel lit, which is how [PEM] §4 measures the matrix.
TEST(Render, AgreesWithTheRenderingMatrixForRandomMaps) {
  const SurfaceSamples samples = testing::mirror_sphere_samples(40, 5);
  const CubePyramidLayout layout = CubePyramidLayout::full(16);
  for (const Proxy& proxy : {kBox, kEllipsoid, Proxy{}}) {
    std::vector<float> maps[2];
    for (std::size_t p = 0; p < 2; ++p) maps[p] = testing::random_values(3 * layout.texels(), p);
    const PartShells parts[2] = {{{proxy, layout, maps[0]}}, {{proxy, layout, maps[1]}}};
    const Image image = render_reflector(samples, parts, {});
    std::vector<float> expected(image.pixels.size());
    for (int part : {0, 1}) {
      const RenderingMatrix a = build_rendering_matrix(samples, part, proxy, layout);
      const std::vector<float> b = multiply(a, maps[part], 3);
      for (std::size_t r = 0; r < a.rows(); ++r) {
        const float coverage = static_cast<float>(a.row_samples(r)) / 5.0F;
        for (std::size_t k = 0; k < 3; ++k) expected[4 * a.row_pixels[r] + k] += coverage * b[3 * r + k];
        expected[4 * a.row_pixels[r] + 3] += coverage;
      }
    }
    // Sums of up to 5 × 32 products in another order.
    for (std::size_t i = 0; i < expected.size(); ++i) ASSERT_NEAR(image.pixels[i], expected[i], 3e-6F) << i;
  }
}

TEST(Render, AgreesWithEveryColumnOfTheRenderingMatrix) {
  const SurfaceSamples samples = testing::mirror_sphere_samples(12, 2);
  const CubePyramidLayout layout = CubePyramidLayout::full(4);
  const RenderingMatrix matrices[2] = {build_rendering_matrix(samples, 0, kBox, layout),
                                       build_rendering_matrix(samples, 1, kBox, layout)};
  for (std::size_t texel = 0; texel < layout.texels(); ++texel) {
    std::vector<float> map(3 * layout.texels());
    map[3 * texel] = 1.0F;
    const PartShells part{{kBox, layout, map}};
    const PartShells parts[2] = {part, part};
    const Image image = render_reflector(samples, parts, {});
    std::vector<float> column(144);
    for (const RenderingMatrix& a : matrices) {
      for (std::size_t r = 0; r < a.rows(); ++r) {
        for (std::uint64_t e = a.row_offsets[r]; e < a.row_offsets[r + 1]; ++e) {
          if (a.texels[e] != texel) continue;
          column[a.row_pixels[r]] += a.weights[e] * static_cast<float>(a.row_samples(r)) / 2.0F;
        }
      }
    }
    for (std::size_t i = 0; i < column.size(); ++i) ASSERT_NEAR(image.pixels[4 * i], column[i], 1e-6F);
  }
}

TEST(Render, CompositesLocalOverDistantTimesFresnelPlusDiffuse) {
  SurfaceSamples samples = testing::mirror_sphere_samples(20, 3);
  const CubePyramidLayout layout = CubePyramidLayout::full(4);
  for (glm::vec3& f : samples.fresnel) f = {0.2F, 0.5F, 0.8F};
  std::vector<float> local, distant;
  for (std::size_t i = 0; i < layout.texels(); ++i) {
    local.insert(local.end(), {0.1F, 0.2F, 0.3F, 0.25F});
    distant.insert(distant.end(), {4.0F, 2.0F, 1.0F});
  }
  const std::vector<glm::vec3> diffuse(samples.size(), glm::vec3(0.01F, 0.02F, 0.03F));
  const PartShells part{{kEllipsoid, layout, local}, {kBox, layout, distant}};
  const PartShells parts[2] = {part, part};
  const Image image = render_reflector(samples, parts, diffuse);
  const float expected[3] = {(0.1F + 0.75F * 4.0F) * 0.2F + 0.01F, (0.2F + 0.75F * 2.0F) * 0.5F + 0.02F,
                             (0.3F + 0.75F * 1.0F) * 0.8F + 0.03F};
  int covered = 0;
  for (std::size_t i = 0; i < 400; ++i) {
    const float coverage = image.pixels[4 * i + 3];
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(image.pixels[4 * i + k], coverage * expected[k], 1e-5F);
    covered += coverage > 0.0F;
  }
  EXPECT_GT(covered, 300);
}

TEST(Render, TrianglesThatTheLocalLayerLeavesOutShowTheDistantOneAlone) {
  SurfaceSamples samples = testing::mirror_sphere_samples(20, 1);
  const CubePyramidLayout layout = CubePyramidLayout::full(4);
  samples.triangle.resize(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) samples.triangle[i] = static_cast<std::uint32_t>(i % 2);
  const std::vector<float> local = testing::random_values(4 * layout.texels(), 1);
  const std::vector<float> distant = testing::random_values(3 * layout.texels(), 2);
  const std::vector<std::uint8_t> covered{0, 1};
  const PartShells with{{kEllipsoid, layout, local}, {kBox, layout, distant}};
  const PartShells without{{kBox, layout, distant}};
  const PartShells split{{kEllipsoid, layout, local, covered}, {kBox, layout, distant}};
  const auto draw = [&](const PartShells& part) {
    const PartShells parts[2] = {part, part};
    return render_reflector(samples, parts, {});
  };
  const Image all = draw(with);
  const Image none = draw(without);
  const Image some = draw(split);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Image& expected = samples.triangle[i] == 1 ? all : none;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t at = std::size_t{4} * samples.pixel[i] + k;
      ASSERT_EQ(some.pixels[at], expected.pixels[at]);
    }
  }
  EXPECT_NE(all.pixels, none.pixels);
  const std::vector<std::uint8_t> too_few{1};
  const PartShells parts[2] = {split, {{kEllipsoid, layout, local, too_few}, {kBox, layout, distant}}};
  EXPECT_THROW(render_reflector(samples, parts, {}), InvalidArgument);
}

TEST(Render, SameBitsOnOneThread) {
  const SurfaceSamples samples = testing::mirror_sphere_samples(64, 4);
  const CubePyramidLayout layout = CubePyramidLayout::full(32);
  const std::vector<float> map = testing::random_values(3 * layout.texels(), 9);
  const PartShells part{{kBox, layout, map}};
  const PartShells parts[2] = {part, part};
  const Image all = render_reflector(samples, parts, {});
  const ThreadLimit limit(1);
  EXPECT_EQ(all.pixels, render_reflector(samples, parts, {}).pixels);
}

TEST(Render, RejectsMapsThatDoNotFit) {
  const SurfaceSamples samples = testing::mirror_sphere_samples(8, 1);
  const CubePyramidLayout layout = CubePyramidLayout::full(4);
  const std::vector<float> map(3 * layout.texels());
  const std::vector<float> small(3 * layout.texels() - 3);
  const PartShells good{{kBox, layout, map}};
  const PartShells bad{{kBox, layout, small}};
  const PartShells with_bad[2] = {good, bad};
  EXPECT_THROW(render_reflector(samples, with_bad, {}), InvalidArgument);
  EXPECT_THROW(render_reflector(samples, {&good, 1}, {}), InvalidArgument);
  const PartShells parts[2] = {good, good};
  const std::vector<glm::vec3> diffuse(3);
  EXPECT_THROW(render_reflector(samples, parts, diffuse), InvalidArgument);
}

TEST(Render, DiffuseIsAlbedoTimesInterpolatedIrradianceOverPi) {
  SurfaceSamples samples = testing::mirror_sphere_samples(8, 1);
  for (glm::vec3& albedo : samples.albedo) albedo = {0.5F, 0.25F, 1.0F};
  const glm::uvec3 triangles[1] = {{0, 1, 2}};
  const glm::vec3 irradiance[3] = {glm::vec3(1.0F), glm::vec3(2.0F), glm::vec3(5.0F)};
  // Barycentrics (¼, ¼): ½·1 + ¼·2 + ¼·5.
  const float mean = 2.25F / std::numbers::pi_v<float>;
  for (const glm::vec3& d : diffuse_from_irradiance(samples, triangles, irradiance)) {
    EXPECT_NEAR(d.x, 0.5F * mean, 1e-6F);
    EXPECT_NEAR(d.y, 0.25F * mean, 1e-6F);
    EXPECT_NEAR(d.z, mean, 1e-6F);
  }
  const glm::uvec3 out_of_range[1] = {{0, 1, 3}};
  EXPECT_THROW(diffuse_from_irradiance(samples, out_of_range, irradiance), InvalidArgument);
}

// Light that is linear in the coordinates is so between the middles of the texels.
TEST(Render, ALightmapIsReadBilinearlyRowsFromTheTop) {
  SurfaceSamples samples = testing::mirror_sphere_samples(8, 1);
  for (glm::vec3& albedo : samples.albedo) albedo = glm::vec3(0.5F);
  samples.back.assign(samples.size(), 0);
  samples.back[1] = 1;
  const glm::uvec3 triangles[1] = {{0, 1, 2}};
  const glm::vec2 uvs[3] = {{0.25F, 0.25F}, {0.75F, 0.25F}, {0.25F, 0.75F}};
  std::vector<glm::vec3> front, back;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      const float u = (static_cast<float>(column) + 0.5F) / 4.0F;
      const float v = 1.0F - (static_cast<float>(row) + 0.5F) / 4.0F;
      front.emplace_back(1.0F + u, 2.0F * v, u + v);
      back.emplace_back(7.0F);
    }
  }
  const std::vector<glm::vec3> diffuse = diffuse_from_lightmap(samples, triangles, uvs, 4, front, back);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const glm::vec2 b = samples.barycentric[i];
    const float u = 0.25F + 0.5F * b.x, v = 0.25F + 0.5F * b.y;
    const glm::vec3 expected = i == 1 ? glm::vec3(7.0F) : glm::vec3(1.0F + u, 2.0F * v, u + v);
    const glm::vec3 found = diffuse[i] * 2.0F * std::numbers::pi_v<float>;
    EXPECT_LT(glm::distance(found, expected), 1e-5F);
  }
  EXPECT_THROW(diffuse_from_lightmap(samples, triangles, uvs, 3, front), InvalidArgument);
  EXPECT_THROW(diffuse_from_lightmap(samples, triangles, uvs, 8, front), InvalidArgument);
  front.pop_back();
  EXPECT_THROW(diffuse_from_lightmap(samples, triangles, uvs, 4, front), InvalidArgument);
  EXPECT_THROW(diffuse_from_lightmap(samples, triangles, std::span(uvs, 2), 4, back), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
