#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mirrorbake/envmap/texel_topology.hpp"
#include "mirrorbake/inference/rendering_matrix.hpp"

/// The rendering matrix of a renderer of which only pictures are to be had ([PEM] §4 "EM Inference"; spec I1
/// ii): a graphics card with a filter of its own, an engine, a page.
namespace mirrorbake {

/// Draws one view with a map of the given texels, texels × 3 in the topology's order, values in [0, 1], every
/// mip level as given and none made from another. Returns linear values, pixels × 3, of the same image every
/// time. They have to be linear in the texels, or linear and a constant: no tone mapping, no clamping. The
/// weights of the three channels have to be the same but for a factor of each pixel and channel, such as F.
using TestRenderer = std::function<std::vector<float>(std::span<const float> texels)>;

struct ProbeOptions {
  int most_renderings = 64;  ///< 16…1024
  /// Step between the values that the renderer can return, in [0, 0.1]; 0: floats. 1/255 for eight bits.
  float step = 0.0F;
  /// A row is left out if its weights reproduce a picture of random texels worse than this, relative to the
  /// row's scale; the step comes on top. In (0, 1].
  float tolerance = 1e-4F;
};

struct ProbedMatrix {
  /// A row per pixel that sees the map; it has no members. Its weights sum to 1.
  RenderingMatrix matrix;
  std::vector<float> scales;  ///< rows × 3: what a white map shows there, less what a black one does
  std::vector<float> errors;  ///< of each row, on texels that nothing was decided by, relative to its scale
  int renderings = 0;         ///< asked for
  int colours = 0;            ///< groups of texels that were lit at a time
  std::vector<std::uint32_t> missing;  ///< pixels that see the map and have no row, ascending
};

/// Finds the weights from few pictures. First where a pixel looks: pictures of maps whose texels show their
/// direction, its products, their level and their face give every pixel the mean and the covariance of the
/// directions that it reads, and the levels and faces. Texels within three standard deviations may be seen.
/// Then what it reads: texels are coloured so that no pixel may see two of one colour, and every picture
/// lights three colours, one a channel, so that each of its values is the weight of one texel. Last pictures
/// of random texels, by which, and by the white one, every row is tested: a renderer that reads elsewhere
/// than it seems is noticed.
///
/// Throws InvalidArgument for options out of range, and if `render` returns another number of values than
/// before, none, or values that are not finite.
ProbedMatrix probe_rendering_matrix(const TexelTopology& topology, const TestRenderer& render,
                                    const ProbeOptions& options = {});

}  // namespace mirrorbake
