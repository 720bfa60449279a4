#include "mirrorbake/inference/display_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "mirror_sphere.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/surface/lookup.hpp"
#include "mirrorbake/surface/shells.hpp"

namespace mirrorbake {
namespace {

const Proxy kBox{Box{{0.1F, 0.0F, 0.2F}, {4.0F, 3.0F, 5.0F}}, {0.0F, 0.2F, 0.0F}};
const Proxy kEllipsoid{Ellipsoid{{0.0F, 0.0F, 0.0F}, {1.5F, 1.2F, 1.3F}}, {0.0F, 0.0F, 0.0F}};
const TexelTopology kMap = TexelTopology::cube(16);
// Both parts have a map of their own before one that they share.
const std::vector<FitPart> kParts{{{kEllipsoid, 0}, {kBox, 2}}, {{kEllipsoid, 1}, {kBox, 2}}};
const std::vector<TexelTopology> kMaps{kMap, kMap, kMap};

// A mirror ball under changing Fresnel reflectance, whose shells show what `light(sample, shell)` says.
template <typename Light>
SurfaceSamples ball(int size, int samples_per_pixel, const Light& light) {
  SurfaceSamples samples = testing::mirror_sphere_samples(size, samples_per_pixel);
  samples.shells = {{"near", {}, {}}, {"far", {}, {}}};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const float f = 0.2F + 0.8F * std::pow(1.0F - samples.normal[i].z, 2.0F);
    samples.fresnel[i] = {f, 0.9F * f, 0.5F * f};
    samples.diffuse.emplace_back(0.05F);
    for (std::size_t k = 0; k < 2; ++k) samples.shells[k].radiance.push_back(light(samples, i, k));
  }
  return samples;
}

// Light of maps, so that some maps show it exactly.
glm::vec4 from_maps(std::span<const float> texels, const SurfaceSamples& samples, std::size_t i,
                    std::size_t k, const RunTimeModel& model = web_run_time()) {
  const FitShell& shell = kParts[samples.part[i]][k];
  glm::vec4 sum(0.0F);
  for (const TexelWeight& read : lookup(samples, i, shell.proxy, kMap, model)) {
    const float* texel =
        texels.data() + 4 * (static_cast<std::size_t>(shell.map) * kMap.texels() + read.texel);
    sum += read.weight * glm::vec4(texel[0], texel[1], texel[2], texel[3]);
  }
  return sum;
}

// Random maps, the first two premultiplied with α, the last opaque.
std::vector<float> random_maps(std::uint64_t seed) {
  std::vector<float> texels = testing::random_values(4 * 3 * kMap.texels(), seed);
  for (std::size_t i = 0; i < texels.size(); i += 4) {
    if (i / 4 >= 2 * kMap.texels()) texels[i + 3] = 1.0F;
    for (std::size_t k = 0; k < 3 && i / 4 < 2 * kMap.texels(); ++k) texels[i + k] *= texels[i + 3];
  }
  return texels;
}

// As a display shows it: the sRGB curve above its foot, where the ball's own light of 0.05 keeps all pixels.
float shown(float radiance) { return 1.055F * std::pow(std::min(radiance, 1.0F), 1.0F / 2.4F) - 0.055F; }

// Root mean square of the difference between what is drawn from the maps and the targets, as displayed.
double display_error(const SurfaceSamples& samples, const ViewTargets& targets,
                     const std::vector<float>& texels, const RunTimeModel& model = web_run_time()) {
  std::vector<glm::vec3> sum(static_cast<std::size_t>(samples.width * samples.height), glm::vec3(0.0F));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ShellComposite composite;
    for (std::size_t k = 0; k < 2; ++k) composite.add(from_maps(texels, samples, i, k, model));
    sum[samples.pixel[i]] += samples.fresnel[i] * composite.light();
  }
  double squares = 0.0;
  int count = 0;
  for (std::size_t p = 0; p < sum.size(); ++p) {
    if (targets.count(p) == 0) continue;
    const glm::vec3 drawn = sum[p] / static_cast<float>(targets.count(p)) + targets.diffuse(p);
    const glm::vec3 wanted = targets.reflected(p) + targets.diffuse(p);
    for (int k = 0; k < 3; ++k) {
      const double error = static_cast<double>(shown(drawn[k]) - shown(wanted[k]));
      squares += error * error;
    }
    count += 3;
  }
  return std::sqrt(squares / count);
}

DisplayFitOptions precise() {
  DisplayFitOptions options;
  options.solve = {.smoothness = 1e-6F,
                   .level_agreement = 1e-6F,
                   .prior_weight = 1e-6F,
                   .tolerance = 1e-5F,
                   .max_iterations = 2000};
  return options;
}

ViewTargets targets_of(const SurfaceSamples& samples) {
  ViewTargets targets(samples.width, samples.height, 2, 2);
  targets.add(samples);
  return targets;
}

TEST(ViewTargets, LeavesOutSamplesThatAreNotFiniteAndCountsThem) {
  const std::vector<float> truth = random_maps(1);
  const auto light = [&](const SurfaceSamples& s, std::size_t i, std::size_t k) {
    return from_maps(truth, s, i, k);
  };
  const SurfaceSamples samples = ball(24, 4, light);
  SurfaceSamples broken = samples;
  const std::size_t n = samples.size() / 2;
  broken.shells[0].radiance[n].x = std::numeric_limits<float>::quiet_NaN();
  broken.shells[1].radiance[n + 1].y = std::numeric_limits<float>::infinity();
  broken.diffuse[n + 2].z = std::numeric_limits<float>::quiet_NaN();
  const ViewTargets whole = targets_of(samples);
  const ViewTargets rest = targets_of(broken);
  EXPECT_EQ(whole.rejected(), 0u);
  EXPECT_EQ(rest.rejected(), 3u);
  const std::set<std::uint32_t> touched{samples.pixel[n], samples.pixel[n + 1], samples.pixel[n + 2]};
  for (std::size_t p = 0; p < 24 * 24; ++p) {
    ASSERT_TRUE(is_finite(rest.reflected(p)) && is_finite(rest.diffuse(p)));
    if (touched.contains(static_cast<std::uint32_t>(p))) {
      // What is left of a pixel that the ball covers wholly still covers it.
      if (whole.coverage(p) == 1.0F && rest.count(p) > 0) {
        EXPECT_EQ(rest.coverage(p), 1.0F);
      }
    } else {
      EXPECT_EQ(rest.reflected(p), whole.reflected(p));
      EXPECT_EQ(rest.coverage(p), whole.coverage(p));
    }
  }
}

TEST(DisplayFit, FindsMapsOfAllShellsAndPartsThatShowTheTarget) {
  const std::vector<float> truth = random_maps(1);
  const SurfaceSamples samples = ball(48, 4, [&](const SurfaceSamples& s, std::size_t i, std::size_t k) {
    return from_maps(truth, s, i, k);
  });
  const ViewTargets targets = targets_of(samples);
  const DisplayView view{&samples, &targets};
  const DisplayFit fit = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), precise());
  ASSERT_EQ(fit.texels.size(), truth.size());
  ASSERT_EQ(fit.passes.size(), 2U);
  // White noise in maps of 16², which the smoothness pulls at; a constant is 0.1 off.
  EXPECT_LT(display_error(samples, targets, fit.texels), 4e-3);
  for (std::size_t i = 0; i < fit.texels.size(); ++i) {
    ASSERT_GE(fit.texels[i], 0.0F);
    if (i % 4 == 3) {
      ASSERT_LE(fit.texels[i], 1.0F);
    }
  }
}

// A renderer of another filter, of which the fit sees nothing but pictures: the ball over nothing.
MapRenderer renderer_of(const SurfaceSamples& samples, const RunTimeModel& model) {
  return [&samples, &model](std::span<const float> texels) {
    const auto pixels = static_cast<std::size_t>(samples.width * samples.height);
    std::vector<float> picture(4 * pixels * static_cast<std::size_t>(samples.samples_per_pixel));
    std::size_t lookup_number = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      lookup_number = i > 0 && samples.pixel[i] == samples.pixel[i - 1] ? lookup_number + 1 : 0;
      ShellComposite composite;
      for (std::size_t k = 0; k < 2; ++k) composite.add(from_maps(texels, samples, i, k, model));
      const glm::vec3 light = samples.fresnel[i] * composite.light();
      float* pixel = picture.data() + 4 * (lookup_number * pixels + samples.pixel[i]);
      for (int c = 0; c < 3; ++c) pixel[c] = light[c];
      pixel[3] = 1.0F;
    }
    return picture;
  };
}

TEST(DisplayFit, FindsMapsForARendererFromItsPictures) {
  RunTimeModel model = web_run_time();
  model.filter = LookupFilter::trilinear;
  model.footprint_scale = 3.0F;
  const std::vector<float> truth = random_maps(7);
  const SurfaceSamples samples = ball(48, 4, [&](const SurfaceSamples& s, std::size_t i, std::size_t k) {
    return from_maps(truth, s, i, k, model);
  });
  const ViewTargets targets = targets_of(samples);
  DisplayView view{&samples, &targets};
  const DisplayFit by_formula = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), precise());
  EXPECT_EQ(by_formula.probing.renderings, 0);
  view.render = renderer_of(samples, model);
  const DisplayFit by_pictures = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), precise());
  EXPECT_LE(by_pictures.probing.most_of_a_map, 64);
  // Two maps in front, and the one that they share probed once more behind them.
  EXPECT_LE(by_pictures.probing.renderings, 4 * by_pictures.probing.most_of_a_map);
  EXPECT_LE(by_pictures.probing.unresolved, targets.width() * targets.height() / 50U);
  // As near as by the formula of its own filter, in spite of F whose channels differ within a pixel.
  EXPECT_LT(display_error(samples, targets, by_pictures.texels, model), 8e-3);
  EXPECT_GT(display_error(samples, targets, by_formula.texels, model), 2e-2);
}

TEST(DisplayFit, RefusesARendererThatMapsTones) {
  const std::vector<float> truth = random_maps(8);
  const SurfaceSamples samples = ball(24, 4, [&](const SurfaceSamples& s, std::size_t i, std::size_t k) {
    return from_maps(truth, s, i, k);
  });
  const ViewTargets targets = targets_of(samples);
  DisplayView view{&samples, &targets};
  const RunTimeModel model = web_run_time();
  const MapRenderer linear = renderer_of(samples, model);
  view.render = [&](std::span<const float> texels) {
    std::vector<float> picture = linear(texels);
    for (float& value : picture) value = std::sqrt(value);
    return picture;
  };
  EXPECT_THROW(fit_display({&view, 1}, kParts, kMaps, 1, web_run_time()), InvalidArgument);
  view.render = [](std::span<const float>) { return std::vector<float>(12); };
  EXPECT_THROW(fit_display({&view, 1}, kParts, kMaps, 1, web_run_time()), InvalidArgument);
}

// Light that no map can show, different in every sample: fitting the pixel spends the texels on what is seen
// of each layer, F and what is in front of it taken into account, and so comes nearer than fitting the
// layers.
TEST(DisplayFit, ComesNearerToThePixelsThanLayersApart) {
  const SurfaceSamples samples = ball(40, 4, [](const SurfaceSamples& s, std::size_t i, std::size_t k) {
    const float x = 0.5F + 0.5F * std::sin(40.0F * s.position[i].x) * std::cos(30.0F * s.position[i].y);
    return k == 0 ? glm::vec4(0.2F * x, 0.1F * x, 0.0F, x) : glm::vec4(1.0F - x, x, 0.3F + x * x, 1.0F);
  });
  const ViewTargets targets = targets_of(samples);
  const DisplayView view{&samples, &targets};
  DisplayFitOptions together = precise();
  together.solve.max_iterations = 300;
  DisplayFitOptions apart = together;
  apart.layer_weight = 1e6F;
  const DisplayFit joint = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), together);
  const DisplayFit layers = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), apart);
  EXPECT_LT(display_error(samples, targets, joint.texels),
            0.8 * display_error(samples, targets, layers.texels));
}

TEST(DisplayFit, LayersThatOnlyStartLeaveNoRowsBesideThePixels) {
  const SurfaceSamples samples = ball(32, 4, [](const SurfaceSamples& s, std::size_t i, std::size_t k) {
    const float x = 0.5F + 0.5F * std::sin(40.0F * s.position[i].x) * std::cos(30.0F * s.position[i].y);
    return k == 0 ? glm::vec4(0.2F * x, 0.1F * x, 0.0F, x) : glm::vec4(1.0F - x, x, 0.3F + x * x, 1.0F);
  });
  const ViewTargets targets = targets_of(samples);
  DisplayView view{&samples, &targets};
  const DisplayFit beside = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), precise());
  DisplayFitOptions weightless = precise();
  weightless.layer_weight = 0.0F;
  const DisplayFit expected = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), weightless);
  view.layers = LayerUse::start;
  const DisplayFit fit = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), precise());
  const double error = display_error(samples, targets, fit.texels);
  // The two solves end at different places within the tolerance.
  EXPECT_NEAR(error, display_error(samples, targets, expected.texels), 1e-4);
  EXPECT_LT(error, 0.98 * display_error(samples, targets, beside.texels));
  for (std::size_t i = 3; i < fit.texels.size(); i += 4) ASSERT_EQ(fit.texels[i], beside.texels[i]);
}

// Lamps of a hundred times white in every seventh of the directions, small beside what reads a texel.
SurfaceSamples lamplit_ball() {
  return ball(40, 4, [](const SurfaceSamples& s, std::size_t i, std::size_t k) {
    const float lamp = std::sin(45.0F * s.position[i].x) * std::cos(35.0F * s.position[i].y) > 0.7F;
    return k == 0 ? glm::vec4(0.0F) : glm::vec4(0.2F + 100.0F * lamp, 0.3F + 100.0F * lamp, 0.1F, 1.0F);
  });
}

TEST(DisplayFit, SparesWhatADisplayShowsAsWhite) {
  const SurfaceSamples samples = lamplit_ball();
  const ViewTargets targets = targets_of(samples);
  const DisplayView view{&samples, &targets};
  DisplayFitOptions as_shown = precise();
  as_shown.solve.max_iterations = 300;
  DisplayFitOptions as_traced = as_shown;
  as_traced.over_white = 1.0F;
  const DisplayFit shown_fit = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), as_shown);
  const DisplayFit traced_fit = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), as_traced);
  EXPECT_LT(display_error(samples, targets, shown_fit.texels),
            0.9 * display_error(samples, targets, traced_fit.texels));
  // Lamps stay far brighter than white, for other exposures.
  EXPECT_GT(*std::max_element(shown_fit.texels.begin(), shown_fit.texels.end()), 10.0F);
}

// Three views of blends of two nodes: the nodes' maps blend to what each view wants.
TEST(DisplayFit, MapsOfNodesBlendToTheViewsBetweenThem) {
  const std::vector<float> ends[2] = {random_maps(3), random_maps(4)};
  std::vector<SurfaceSamples> samples;
  std::vector<ViewTargets> targets;
  std::vector<DisplayView> views;
  for (const float t : {0.0F, 0.5F, 1.0F}) {
    std::vector<float> blended(ends[0].size());
    for (std::size_t i = 0; i < blended.size(); ++i) blended[i] = (1.0F - t) * ends[0][i] + t * ends[1][i];
    samples.push_back(ball(32, 4, [&](const SurfaceSamples& s, std::size_t i, std::size_t k) {
      return from_maps(blended, s, i, k);
    }));
    targets.push_back(targets_of(samples.back()));
  }
  for (std::size_t v = 0; v < 3; ++v) {
    const float t = 0.5F * static_cast<float>(v);
    views.push_back({&samples[v], &targets[v], {{0, 1.0F - t}, {1, t}}});
  }
  const DisplayFit fit = fit_display(views, kParts, kMaps, 2, web_run_time(), precise());
  const std::size_t size = ends[0].size();
  ASSERT_EQ(fit.texels.size(), 2 * size);
  for (std::size_t v = 0; v < 3; ++v) {
    const float t = 0.5F * static_cast<float>(v);
    std::vector<float> blended(size);
    for (std::size_t i = 0; i < size; ++i) blended[i] = (1.0F - t) * fit.texels[i] + t * fit.texels[size + i];
    EXPECT_LT(display_error(samples[v], targets[v], blended), 1e-2) << v;
  }
}

// A part with fewer shells than were traced shows all of them in its last: one uniform light over another.
TEST(DisplayFit, TheLastShellHoldsWhatIsBehindItToo) {
  const SurfaceSamples samples = ball(24, 4, [](const SurfaceSamples&, std::size_t, std::size_t k) {
    return k == 0 ? glm::vec4(0.1F, 0.1F, 0.1F, 0.5F) : glm::vec4(2.0F, 1.0F, 0.5F, 1.0F);
  });
  const ViewTargets targets = targets_of(samples);
  const DisplayView view{&samples, &targets};
  const std::vector<FitPart> parts{{{kBox, 0}}, {{kBox, 0}}};
  DisplayFitOptions options = precise();
  options.layer_weight = 1.0F;
  const DisplayFit fit = fit_display({&view, 1}, parts, {&kMap, 1}, 1, web_run_time(), options);
  const float expected[3] = {0.1F + 0.5F * 2.0F, 0.1F + 0.5F * 1.0F, 0.1F + 0.5F * 0.5F};
  for (std::size_t i = 0; i < fit.texels.size(); i += 4) {
    for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(fit.texels[i + k], expected[k], 1e-3F);
    ASSERT_NEAR(fit.texels[i + 3], 1.0F, 1e-4F);
  }
}

TEST(DisplayFit, SameBitsOnOneThread) {
  const std::vector<float> truth = random_maps(5);
  const SurfaceSamples samples = ball(32, 4, [&](const SurfaceSamples& s, std::size_t i, std::size_t k) {
    return from_maps(truth, s, i, k);
  });
  const ViewTargets targets = targets_of(samples);
  const DisplayView view{&samples, &targets};
  const DisplayFit all = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time());
  const ThreadLimit limit(1);
  EXPECT_EQ(all.texels, fit_display({&view, 1}, kParts, kMaps, 1, web_run_time()).texels);
}

TEST(DisplayFit, NothingSeenLeavesThePrior) {
  SurfaceSamples nothing;
  nothing.width = nothing.height = 8;
  nothing.samples_per_pixel = 1;
  const ViewTargets targets(8, 8, 2, 2);
  const DisplayView view{&nothing, &targets};
  const std::vector<float> prior = testing::random_values(3 * 3 * kMap.texels(), 6);
  const DisplayFit fit = fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), {}, prior);
  for (std::size_t i = 0; 3 * i < prior.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(fit.texels[4 * i + k], prior[3 * i + k]);
  }
}

TEST(ViewTargets, WindowsAddUpToTheWholeView) {
  const auto light = [](const SurfaceSamples& s, std::size_t i, std::size_t) {
    return glm::vec4(s.reflection[i] + 1.0F, 1.0F);
  };
  const SurfaceSamples whole = ball(16, 2, light);
  const ViewTargets expected = targets_of(whole);
  ViewTargets parts(16, 16, 2, 2);
  for (int y = 0; y < 16; y += 4) {
    SurfaceSamples window = whole;
    window.height = 4;
    for (std::size_t i = window.size(); i-- > 0;) {
      const int row = static_cast<int>(window.pixel[i]) / 16 - y;
      if (row >= 0 && row < 4) {
        window.pixel[i] -= static_cast<std::uint32_t>(16 * y);
        continue;
      }
      const auto erase = [i](auto& array) { array.erase(array.begin() + static_cast<std::ptrdiff_t>(i)); };
      erase(window.pixel), erase(window.part), erase(window.fresnel), erase(window.diffuse);
      for (ShellLight& shell : window.shells) erase(shell.radiance);
    }
    parts.add(window, 0, y);
  }
  for (std::size_t pixel = 0; pixel < 256; ++pixel) {
    ASSERT_EQ(parts.count(pixel), expected.count(pixel));
    ASSERT_EQ(parts.reflected(pixel), expected.reflected(pixel));
    ASSERT_EQ(parts.shell(pixel, 0, 1), expected.shell(pixel, 0, 1));
  }
}

TEST(DisplayFit, RefusesWhatDoesNotFitTogether) {
  const auto light = [](const SurfaceSamples&, std::size_t, std::size_t) { return glm::vec4(1.0F); };
  SurfaceSamples samples = ball(8, 1, light);
  const ViewTargets targets = targets_of(samples);
  const DisplayView view{&samples, &targets};
  DisplayFitOptions never;
  never.passes = 0;
  DisplayFitOptions blind;
  blind.over_white = 0.0F;
  const std::vector<FitPart> unknown_map{{{kBox, 3}}, {{kBox, 0}}};
  EXPECT_THROW(fit_display({&view, 1}, unknown_map, kMaps, 1, web_run_time()), InvalidArgument);
  EXPECT_THROW(fit_display({&view, 1}, {kParts.data(), 1}, kMaps, 1, web_run_time()), InvalidArgument);
  EXPECT_THROW(fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), never), InvalidArgument);
  EXPECT_THROW(fit_display({&view, 1}, kParts, kMaps, 1, web_run_time(), blind), InvalidArgument);
  const ViewTargets larger(9, 8, 2, 2);
  const DisplayView other{&samples, &larger};
  EXPECT_THROW(fit_display({&other, 1}, kParts, kMaps, 1, web_run_time()), InvalidArgument);
}

}  // namespace
}  // namespace mirrorbake
