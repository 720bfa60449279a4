#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "mirrorbake/image/image.hpp"
#include "mirrorbake/inference/display_fit.hpp"
#include "mirrorbake/proxy/proxy.hpp"
#include "mirrorbake/surface/run_time_model.hpp"

/// Maps from images of layers, which mb-trace writes and other renderers can ([PEM] §4 "EM Inference").
namespace mirrorbake {

/// A view's layers with the channels of lookup_image(), in a file of this name.
struct LayerImage {
  std::string name;
  Image image;
};

struct LayerShell {
  std::string name;  ///< of the traced shell: NAME of `specular_NAME.R`
  Proxy proxy;
};

/// Whether all parts of the reflector read the same maps, or each its own.
enum class MapSharing { all_parts, per_part };

struct LayerInferenceOptions {
  /// Front to back, the last one opaque. Empty: what the images have, at infinity. A shell that is left out
  /// is held by the next one behind it.
  std::vector<LayerShell> shells;
  TexelTopology map = TexelTopology::cube(128);
  RunTimeModel run_time = web_run_time();
  MapSharing sharing = MapSharing::all_parts;
  DisplayFitOptions fit;
  std::string reflector;  ///< that the channels start with; empty: the only one
};

struct InferredMap {
  std::string name;  ///< the shell's; of maps per part `NAME.partN`
  bool has_alpha = false;
  std::vector<float> texels;  ///< texels × 3, or premultiplied and × 4 with α
};

struct LayerInference {
  std::vector<InferredMap> maps;
  SolveReport report;        ///< of the last pass
  std::size_t pixels = 0;    ///< that the maps were fitted to
  std::size_t rejected = 0;  ///< pixels left out, since their light is not finite
};

/// Infers maps of one node from the views in `images` by fit_display. Channels of a view: `coverage`,
/// `fresnel.R` …, `specular_NAME.R` … (all but the last shell with `.A`), lookups as many as the run time
/// has; and, 0 where they are missing, `diffuse.R` …, `covariance.R` …, `part`. What reaches the eye is
/// fitted from means over a pixel and so without error; μ's rows of a pixel that sees several parts count it
/// to the most frequent one.
///
/// Throws FileError, naming the image, for channels that are missing or make no sense; InvalidArgument for
/// options that do not fit to them.
LayerInference infer_from_layers(std::span<const LayerImage> images,
                                 const LayerInferenceOptions& options = {});

}  // namespace mirrorbake
