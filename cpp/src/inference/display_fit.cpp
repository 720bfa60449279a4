#include "mirrorbake/inference/display_fit.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "display_rows.hpp"
#include "mirrorbake/core/check.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/surface/lookup.hpp"
#include "probed_rows.hpp"

namespace mirrorbake {
namespace {

FitModel check(std::span<const DisplayView> views, std::span<const FitPart> parts,
               std::span<const TexelTopology> maps, const RunTimeModel& run_time,
               const DisplayFitOptions& options) {
  validate(run_time);
  check_at_least("layer_weight", static_cast<double>(options.layer_weight), 0.0);
  check_above("softening", static_cast<double>(options.softening), 0.0, 1.0);
  check_above("over_white", static_cast<double>(options.over_white), 0.0, 1.0);
  check_range("passes", options.passes, 1, 16);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const std::string name = "parts[" + std::to_string(p) + "]";
    if (parts[p].empty()) throw InvalidArgument(name, "no shells", "at least one");
    for (const FitShell& shell : parts[p]) {
      check_range(name + ".map", shell.map, 0, static_cast<int>(maps.size()) - 1);
      validate(shell.proxy);
    }
  }
  for (std::size_t v = 0; v < views.size(); ++v) {
    const std::string name = "views[" + std::to_string(v) + "]";
    const SurfaceSamples& lookups = *views[v].lookups;
    const ViewTargets& targets = *views[v].targets;
    check_lookup_arrays(lookups);
    check_length("fresnel", lookups.fresnel.size(), lookups.size());
    check_at_least(name + ".weight", static_cast<double>(views[v].weight), 0.0);
    if (lookups.width != targets.width() || lookups.height != targets.height()) {
      throw InvalidArgument(name + ".lookups",
                            std::to_string(lookups.width) + "x" + std::to_string(lookups.height) + " pixels",
                            "those of the targets, " + std::to_string(targets.width()) + "x" +
                                std::to_string(targets.height()));
    }
    check_length(name + ".targets, parts", static_cast<std::size_t>(targets.parts()), parts.size());
    for (const FitPart& part : parts) {
      if (part.size() > static_cast<std::size_t>(targets.shells())) {
        throw InvalidArgument("parts", std::to_string(part.size()) + " shells",
                              "at most the " + std::to_string(targets.shells()) + " that were traced");
      }
      for (const FitShell& shell : part) {
        if (shell.triangles.empty()) continue;
        for (const std::uint32_t triangle : lookups.triangle) {
          check_range("lookups.triangle", triangle, 0U,
                      static_cast<std::uint32_t>(shell.triangles.size()) - 1U);
        }
      }
    }
    for (const std::uint16_t part : lookups.part) {
      check_range("lookups.part", static_cast<int>(part), 0, static_cast<int>(parts.size()) - 1);
    }
  }
  FitModel model{parts, maps, {0}, &run_time};
  for (const TexelTopology& map : maps) model.first_texel.push_back(model.first_texel.back() + map.texels());
  return model;
}

// Derivative of the sRGB curve (IEC 61966-2-1) for radiance 1 as white, held below `softening`.
float display_slope(float radiance, float softening) {
  return 1.055F / 2.4F * std::pow(std::max(radiance, softening), 1.0F / 2.4F - 1.0F);
}

// What a channel of a pixel is fitted to, and the derivative there.
struct DisplayedTarget {
  float radiance, slope;
};

// A display shows all radiance above 1 as white. A target above it asks of an image below it no more than
// white, and of one above it little; an image above it is pulled to a target below it as from white.
DisplayedTarget displayed_target(float image, float target, const DisplayFitOptions& options) {
  if (target <= 1.0F) return {target, display_slope(std::min(image, 1.0F), options.softening)};
  if (image < 1.0F) return {1.0F, display_slope(image, options.softening)};
  return {target, options.over_white * display_slope(image, options.softening)};
}

// How many times the tolerance a pass may end at whose image only gives the next one its weights.
constexpr float kLeadingSlack = 3.0F;

// The layers' own fit: all four channels of all maps.
MapSolution fit_layers(std::span<const DisplayView> views, const std::vector<LayerRows>& rows,
                       const FitModel& model, int nodes, const SolveOptions& options,
                       std::span<const float> prior) {
  std::vector<SolverView> solver_views;
  std::vector<std::vector<float>> targets(views.size()), weights(views.size());
  std::vector<ViewTarget> wanted;
  for (std::size_t v = 0; v < views.size(); ++v) {
    solver_views.push_back({&rows[v].matrix, views[v].nodes});
    for (std::size_t r = 0; r < rows[v].target.size(); ++r) {
      const glm::vec4 t = rows[v].target[r];
      // As a display does, which layers by themselves have no pixel to take it from.
      const float compression = 1.0F + std::max(0.2126F * t.x + 0.7152F * t.y + 0.0722F * t.z, 0.0F);
      const float w = views[v].weight * rows[v].coverage[r];
      targets[v].insert(targets[v].end(), {t.x, t.y, t.z, t.w});
      const float light = w / (compression * compression);
      weights[v].insert(weights[v].end(), {light, light, light, w});
    }
    wanted.push_back({targets[v], weights[v]});
  }
  std::vector<float> start;
  for (std::size_t i = 0; 3 * i < prior.size(); ++i) {
    start.insert(start.end(), {prior[3 * i], prior[3 * i + 1], prior[3 * i + 2], 0.0F});
  }
  // The prior is where this fit starts; what pulls towards it is the joint fit, since α has none.
  return MapSolver(solver_views, model.maps, nodes, options)
      .solve({.channels = 4, .views = wanted, .initial = start});
}

// The pixels' rows of a view with its layers' rows below them; of a view without layers' rows the matrix is
// that of its pixels, and none is here.
struct JointRows {
  RenderingMatrix matrix;
  std::vector<float> target, weights;  // rows × 3
  std::size_t pixels = 0;              // rows that are pixels'
};

void append(RenderingMatrix& to, const RenderingMatrix& from) {
  if (to.row_offsets.empty()) to.row_offsets.push_back(0);
  const std::uint64_t first = to.row_offsets.back();
  for (std::size_t r = 0; r < from.rows(); ++r) to.row_offsets.push_back(first + from.row_offsets[r + 1]);
  to.texels.insert(to.texels.end(), from.texels.begin(), from.texels.end());
  to.weights.insert(to.weights.end(), from.weights.begin(), from.weights.end());
  to.row_pixels.insert(to.row_pixels.end(), from.row_pixels.begin(), from.row_pixels.end());
  to.columns = from.columns;
}

JointRows stack(const DisplayRows& pixels, const LayerRows& layers) {
  JointRows rows;
  if (!layers.target.empty()) {
    append(rows.matrix, pixels.matrix);
    append(rows.matrix, layers.matrix);
  }
  rows.pixels = pixels.target.size();
  for (const glm::vec3& t : pixels.target) rows.target.insert(rows.target.end(), {t.x, t.y, t.z});
  for (const glm::vec4& t : layers.target) rows.target.insert(rows.target.end(), {t.x, t.y, t.z});
  rows.weights.resize(rows.target.size());
  return rows;
}

// Weights and pixels' targets at the image that `maps`, blended for the view, makes.
void weigh(const DisplayView& view, const DisplayRows& pixels, const LayerRows& layers,
           std::span<const float> maps, const DisplayFitOptions& options, JointRows& rows) {
  const std::vector<float> light = multiply(pixels.matrix, maps, 3);
  std::vector<glm::vec3> slope(static_cast<std::size_t>(view.lookups->width) *
                               static_cast<std::size_t>(view.lookups->height));
  for (std::size_t r = 0; r < rows.pixels; ++r) {
    for (int k = 0; k < 3; ++k) {
      const std::size_t i = 3 * r + static_cast<std::size_t>(k);
      const float f = pixels.fresnel[r][k];
      const float image = f * light[i] + pixels.diffuse[r][k];
      const float own = pixels.diffuse[r][k];
      const DisplayedTarget wanted = displayed_target(image, f * pixels.target[r][k] + own, options);
      const float d = wanted.slope * f;
      if (f > 0.0F) rows.target[i] = (wanted.radiance - own) / f;
      slope[pixels.matrix.row_pixels[r]][k] = display_slope(image, options.softening);
      rows.weights[i] = view.weight * pixels.coverage[r] * d * d;
    }
  }
  for (std::size_t r = 0; r < layers.target.size(); ++r) {
    for (int k = 0; k < 3; ++k) {
      const float d = slope[layers.matrix.row_pixels[r]][k] * layers.fresnel[r][k];
      rows.weights[3 * (rows.pixels + r) + static_cast<std::size_t>(k)] =
          options.layer_weight * view.weight * layers.coverage[r] * d * d;
    }
  }
}

// Σ weight · map over the nodes of a view.
std::vector<float> blend(std::span<const float> maps, const FitModel& model,
                         const std::vector<NodeWeight>& nodes, std::size_t channels) {
  const std::size_t size = model.texels() * channels;
  std::vector<float> result(size);
  for (const NodeWeight& node : nodes) {
    const float* map = maps.data() + size * static_cast<std::size_t>(node.node);
    for (std::size_t i = 0; i < size; ++i) result[i] += node.weight * map[i];
  }
  return result;
}

}  // namespace

DisplayFit fit_display(std::span<const DisplayView> views, std::span<const FitPart> parts,
                       std::span<const TexelTopology> maps, int nodes, const RunTimeModel& run_time,
                       const DisplayFitOptions& options, std::span<const float> prior) {
  const FitModel model = check(views, parts, maps, run_time, options);
  const std::size_t texels = model.texels() * static_cast<std::size_t>(nodes);
  if (!prior.empty()) check_length("prior", prior.size(), 3 * texels, "nodes × texels × 3");

  std::vector<LayerRows> layers;
  std::vector<std::optional<ProbedView>> probed(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v].render) {
      probed[v].emplace(model, views[v], options.probe);
      layers.push_back(probed[v]->layer_rows());
    } else {
      layers.push_back(build_layer_rows(model, views[v]));
    }
  }
  MapSolution start = fit_layers(views, layers, model, nodes, options.solve, prior);
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v].layers == LayerUse::start) layers[v] = {};
  }
  std::vector<float> light(3 * texels), alpha(texels);
  for (std::size_t i = 0; i < texels; ++i) {
    for (std::size_t k = 0; k < 3; ++k) light[3 * i + k] = start.texels[4 * i + k];
    alpha[i] = start.texels[4 * i + 3];
  }

  std::vector<DisplayRows> pixels;
  std::vector<JointRows> joint;
  std::vector<SolverView> solver_views;
  DisplayFit fit;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const std::vector<float> opacity = blend(alpha, model, views[v].nodes, 1);
    pixels.push_back(probed[v] ? probed[v]->display_rows(opacity)
                               : build_display_rows(model, views[v], opacity));
    joint.push_back(stack(pixels[v], layers[v]));
    if (!probed[v]) continue;
    const ProbingReport& report = probed[v]->report();
    fit.probing.renderings += report.renderings;
    fit.probing.most_of_a_map = std::max(fit.probing.most_of_a_map, report.most_of_a_map);
    fit.probing.unresolved += report.unresolved;
  }
  for (std::size_t v = 0; v < views.size(); ++v) {
    const RenderingMatrix& rows = layers[v].target.empty() ? pixels[v].matrix : joint[v].matrix;
    solver_views.push_back({&rows, views[v].nodes});
  }
  const MapSolver solver(solver_views, maps, nodes, options.solve);
  // It has taken what it needs of them.
  for (JointRows& rows : joint) rows.matrix = {};

  fit.layers = start.report;
  for (int pass = 0; pass < options.passes; ++pass) {
    std::vector<ViewTarget> wanted;
    for (std::size_t v = 0; v < views.size(); ++v) {
      weigh(views[v], pixels[v], layers[v], blend(light, model, views[v].nodes, 3), options, joint[v]);
      wanted.push_back({joint[v].target, joint[v].weights});
    }
    const bool last = pass + 1 == options.passes;
    MapSolution solution = solver.solve({.channels = 3,
                                         .views = wanted,
                                         .prior = prior,
                                         .initial = light,
                                         .unseen = last ? UnseenTexels::filled : UnseenTexels::as_before,
                                         .slack = last ? 1.0F : kLeadingSlack});
    light = std::move(solution.texels);
    fit.passes.push_back(solution.report);
  }
  fit.texels.resize(4 * texels);
  for (std::size_t i = 0; i < texels; ++i) {
    for (std::size_t k = 0; k < 3; ++k) fit.texels[4 * i + k] = light[3 * i + k];
    fit.texels[4 * i + 3] = alpha[i];
  }
  return fit;
}

}  // namespace mirrorbake
