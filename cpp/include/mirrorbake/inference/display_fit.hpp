#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mirrorbake/inference/map_solver.hpp"
#include "mirrorbake/inference/probe.hpp"
#include "mirrorbake/inference/view_targets.hpp"
#include "mirrorbake/proxy/proxy.hpp"
#include "mirrorbake/surface/run_time_model.hpp"

/// The joint display fit: maps of all shells and parts, of one or several nodes, inferred together from the
/// pixels that a renderer will show. [PEM] §4 infers every layer by itself, and so spends texels on what no
/// pixel shows.
namespace mirrorbake {

/// A shell as a part sees it. Several parts may share a map.
struct FitShell {
  Proxy proxy;
  int map = 0;  ///< number of its map
  /// 0 for those that the shell leaves out; empty: it covers all
  std::span<const std::uint8_t> triangles = {};
};

/// Front to back, in the order of the targets' stack of the part; the last is opaque, and holds what arrives
/// from its own and all further shells.
using FitPart = std::vector<FitShell>;

/// Draws a view from maps: texels of one node's maps, one behind the other, × 4, premultiplied radiance and
/// α; every mip level as given. Returns linear values, lookups × pixels × 4: the light that the object
/// reflects, without its own, times coverage, and coverage; no tone mapping, no clamping. The pixel that is
/// shown is the mean over the lookups, each a picture of its own, as of a multisampled or an enlarged one:
/// what all of them read together would take too many colours to tell apart.
using MapRenderer = std::function<std::vector<float>(std::span<const float> texels)>;

/// What the layers of a view, each by itself, are for.
enum class LayerUse {
  beside_pixels,  ///< to find α and where to start, then as rows beside the pixels'
  start,          ///< the first alone: of views beside others, whose pixels are all that is asked of the maps
};

/// A traced view, as the run time will look up its maps.
struct DisplayView {
  const SurfaceSamples* lookups = nullptr;  ///< where the run time's lookups meet the reflector
  const ViewTargets* targets = nullptr;
  std::vector<NodeWeight> nodes = {{}};  ///< whose maps are blended for it
  float weight = 1.0F;                   ///< of its rows, ≥ 0
  LayerUse layers = LayerUse::beside_pixels;
  /// Its rows are probed from pictures of this renderer (`probe.hpp`); none: analytic, from the lookups.
  MapRenderer render = {};
};

struct DisplayFitOptions {
  SolveOptions solve;
  /// μ, weight of the layers' own rows beside the pixels', ≥ 0.
  float layer_weight = 0.03F;
  /// Below this radiance the derivative of the display's curve is held, in (0, 1].
  float softening = 0.03F;
  /// Of that derivative, the share that is kept where both target and image are over white, and the display
  /// shows no difference, in (0, 1].
  float over_white = 0.1F;
  /// How often the weights of the rows are taken from the model's own image, 1…16.
  int passes = 2;
  /// Of views that are drawn by a renderer. Within a lookup F of a coloured mirror may change channel by
  /// channel, which a row does not hold: a percent of that is let pass.
  ProbeOptions probe = {.tolerance = 1e-2F};
};

/// What probing the views of a fit took and left.
struct ProbingReport {
  int renderings = 0;          ///< pictures that were asked for
  int most_of_a_map = 0;       ///< the most that one map of a view took at a time
  std::size_t unresolved = 0;  ///< pixels that see the object and are left out, since they have no row
};

struct DisplayFit {
  /// nodes × texels of all maps × 4: premultiplied radiance, and α.
  std::vector<float> texels;
  SolveReport layers;               ///< of the layers' own fit, which finds α and where to start
  std::vector<SolveReport> passes;  ///< of the joint fit
  ProbingReport probing;
};

/// Row of a pixel: mean over its lookups of F · transmittance · reads, the transmittance Π(1 − α) of the
/// shells in front by the α of the layers' own fit; target: the traced pixel less its diffuse light; weight:
/// coverage times the squared derivative of the display's curve (sRGB) at the model's own image, since at a
/// noisy target it would prefer what came out dark. A target over white asks no more than white of an image
/// below it. Beside them, weighted by μ, the rows of every layer by itself, of the views whose `layers` say
/// so. `prior`: empty, or nodes × texels × 3.
///
/// F enters per channel: a row's weights follow the mean of its channels, each channel's scale its own, which
/// is exact where F has one hue within a pixel.
///
/// Throws InvalidArgument for parts, maps, images or options that do not fit together.
DisplayFit fit_display(std::span<const DisplayView> views, std::span<const FitPart> parts,
                       std::span<const TexelTopology> maps, int nodes, const RunTimeModel& run_time,
                       const DisplayFitOptions& options = {}, std::span<const float> prior = {});

}  // namespace mirrorbake
