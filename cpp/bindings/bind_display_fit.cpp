#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bind.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/inference/display_fit.hpp"
#include "mirrorbake/inference/layer_images.hpp"
#include "signature.hpp"

namespace mirrorbake::bindings {
namespace {

// Keeps the array of triangles alive.
struct OwnedFitShell {
  Proxy proxy;
  int map;
  std::optional<ByteArray> triangles;
};

struct OwnedDisplayView {
  const SurfaceSamples* lookups;
  const ViewTargets* targets;
  std::vector<std::pair<int, float>> nodes;
  float weight;
  nb::object render;
  LayerUse layers;
};

// Fits run without the interpreter's lock, which a renderer takes for each of its pictures.
MapRenderer renderer_of(const nb::object& render) {
  if (render.is_none()) return {};
  return [&render](std::span<const float> texels) {
    const nb::gil_scoped_acquire locked;
    std::vector<float> maps(texels.begin(), texels.end());
    const std::size_t count = maps.size() / 4;
    const auto picture = nb::cast<FloatArray>(render(to_numpy(std::move(maps), {count, 4})));
    return std::vector<float>(picture.data(), picture.data() + picture.size());
  };
}

void bind_targets(nb::module_& m) {
  nb::class_<ViewTargets>(
      m, "ViewTargets",
      R"(What maps should make a view look like: sums over traced samples, pixel by pixel, so that a view
of many samples never has to be in memory at once.)")
      .def(nb::init<int, int, int, int, const ViewTargets::Stacks&>(), nb::arg("width"), nb::arg("height"),
           nb::arg("parts"), nb::arg("shells"), nb::arg("stacks") = ViewTargets::Stacks{},
           R"(`stacks`: for each part, front to back, the number of the traced shell that each of its own
shells ends with; empty: the traced ones.)")
      .def("add", &ViewTargets::add, nb::arg("samples"), nb::arg("x") = 0, nb::arg("y") = 0,
           nb::call_guard<nb::gil_scoped_release>(),
           R"(Adds samples with traced light, at most one trace of every pixel; (x, y): where their
image's top left pixel lies in this one.)")
      .def_prop_ro("width", &ViewTargets::width)
      .def_prop_ro("height", &ViewTargets::height)
      .def_prop_ro("parts", &ViewTargets::parts)
      .def_prop_ro("shells", &ViewTargets::shells)
      .def_prop_ro("rejected", &ViewTargets::rejected,
                   "Samples that were left out so far, since their light is NaN or infinite.");
}

void bind_fit_inputs(nb::module_& m) {
  nb::class_<OwnedFitShell>(m, "FitShell", "A shell as a part of the reflector sees it.")
      .def(
          "__init__",
          [](OwnedFitShell* self, const Proxy& proxy, int map, std::optional<ByteArray> triangles) {
            new (self) OwnedFitShell{proxy, map, std::move(triangles)};
          },
          nb::arg("proxy"), nb::arg("map"), nb::arg("triangles") = nb::none(),
          R"(map: number of its map, which several parts may share. triangles: uint8, 0 for each triangle
of the reflector that the shell leaves out, or None if it covers all.)");
  nb::class_<OwnedDisplayView>(m, "DisplayView", "A traced view, as the run time will look up its maps.")
      .def(
          "__init__",
          [](OwnedDisplayView* self, const SurfaceSamples& lookups, const ViewTargets& targets,
             std::vector<std::pair<int, float>> nodes, float weight, nb::object render, bool layer_rows) {
            new (self) OwnedDisplayView{
                &lookups, &targets,          std::move(nodes),
                weight,   std::move(render), layer_rows ? LayerUse::beside_pixels : LayerUse::start};
          },
          nb::arg("lookups"), nb::arg("targets"),
          nb::arg("nodes") = std::vector<std::pair<int, float>>{{0, 1.0F}}, nb::arg("weight") = 1.0F,
          nb::arg("render") = nb::none(), nb::arg("layer_rows") = true, nb::keep_alive<1, 2>(),
          nb::keep_alive<1, 3>(),
          signature<R"(def __init__(self, lookups: SurfaceSamples, targets: ViewTargets,
nodes: collections.abc.Sequence[tuple[int, float]] = ((0, 1.0),), weight: float = 1.0,
render: collections.abc.Callable[[numpy.typing.NDArray[numpy.float32]], numpy.typing.NDArray[numpy.float32]] | None = None,
layer_rows: bool = True) -> None)">(),
          R"(lookups: where the run time's lookups meet the reflector (Tracer.trace_visibility at
RunTimeModel.places). nodes: whose maps are blended for the view, with their weights. weight: of its
rows, >= 0. render: draws the view with the texels of all maps of a node, float32 (texels, 4), premultiplied
radiance and alpha, all levels as given, and returns float32 (lookups, height, width, 4): the light that the
object reflects, times coverage, and coverage, of each lookup of a pixel; the view's rows are then probed from
such pictures. None: they are analytic. layer_rows: whether the rows of its layers, each by itself, stand
beside its pixels'; else they only help to find alpha and where to start.)");
  nb::class_<DisplayFitOptions>(m, "DisplayFitOptions", "How maps are fitted to displayed pixels.")
      .def(
          "__init__",
          [](DisplayFitOptions* self, const SolveOptions& solve, float layer_weight, float softening,
             float over_white, int passes) {
            new (self) DisplayFitOptions{solve, layer_weight, softening, over_white, passes};
          },
          nb::kw_only(), nb::arg("solve") = SolveOptions{},
          nb::arg("layer_weight") = DisplayFitOptions{}.layer_weight,
          nb::arg("softening") = DisplayFitOptions{}.softening,
          nb::arg("over_white") = DisplayFitOptions{}.over_white,
          nb::arg("passes") = DisplayFitOptions{}.passes)
      .def_ro("solve", &DisplayFitOptions::solve)
      .def_ro("layer_weight", &DisplayFitOptions::layer_weight,
              "Weight of the layers' own rows beside the pixels', >= 0.")
      .def_ro("softening", &DisplayFitOptions::softening,
              "Below this radiance the derivative of the display's curve is held, in (0, 1].")
      .def_ro("over_white", &DisplayFitOptions::over_white,
              "Of that derivative, the share kept where target and image are over white, in (0, 1].")
      .def_ro("passes", &DisplayFitOptions::passes,
              "How often the rows' weights are taken from the model's own image, 1 to 16.");
}

void bind_fit(nb::module_& m) {
  nb::class_<ProbingReport> probing(m, "ProbingReport", "What probing the views of a fit took and left.");
  probing.def_ro("renderings", &ProbingReport::renderings, "Pictures that were asked for.")
      .def_ro("most_of_a_map", &ProbingReport::most_of_a_map,
              "The most that one map of a view took at a time.")
      .def_ro("unresolved", &ProbingReport::unresolved,
              "Pixels that see the object and are left out, since they have no row.");
  show(probing, {"renderings", "most_of_a_map", "unresolved"});
  m.def(
      "fit_display",
      [](const std::vector<const OwnedDisplayView*>& views,
         const std::vector<std::vector<const OwnedFitShell*>>& parts, const std::vector<TexelTopology>& maps,
         int nodes, const RunTimeModel& run_time, const DisplayFitOptions& options,
         std::optional<FloatMatrix> prior) {
        std::vector<DisplayView> display_views;
        for (const OwnedDisplayView* view : views) {
          DisplayView& to = display_views.emplace_back(DisplayView{
              view->lookups, view->targets, {}, view->weight, view->layers, renderer_of(view->render)});
          for (const auto& [node, weight] : view->nodes) to.nodes.push_back({node, weight});
        }
        std::vector<FitPart> fit_parts;
        for (const auto& shells : parts) {
          FitPart& part = fit_parts.emplace_back();
          for (const OwnedFitShell* shell : shells) {
            part.push_back({shell->proxy, shell->map, {}});
            if (shell->triangles)
              part.back().triangles = {shell->triangles->data(), shell->triangles->size()};
          }
        }
        std::span<const float> prior_view;
        if (prior) prior_view = {prior->data(), prior->size()};
        DisplayFit fit;
        {
          const nb::gil_scoped_release unlocked;
          fit = fit_display(display_views, fit_parts, maps, nodes, run_time, options, prior_view);
        }
        const std::size_t texels = fit.texels.size() / 4;
        std::vector<SolveReport> reports{fit.layers};
        reports.insert(reports.end(), fit.passes.begin(), fit.passes.end());
        return nb::make_tuple(to_numpy(std::move(fit.texels), {texels, 4}), reports, fit.probing);
      },
      nb::arg("views"), nb::arg("parts"), nb::arg("maps"), nb::arg("nodes") = 1,
      nb::arg("run_time") = web_run_time(), nb::arg("options") = DisplayFitOptions{},
      nb::arg("prior") = nb::none(),
      signature<R"(def fit_display(views: collections.abc.Sequence[DisplayView],
parts: collections.abc.Sequence[collections.abc.Sequence[FitShell]],
maps: collections.abc.Sequence[TexelTopology], nodes: int = 1, run_time: RunTimeModel = ...,
options: DisplayFitOptions = ..., prior: numpy.typing.NDArray[numpy.float32] | None = None) ->
tuple[numpy.typing.NDArray[numpy.float32], list[SolveReport], ProbingReport])">(),
      R"(Infers the maps of all shells and parts, of one or several nodes, together, from the pixels that
the run time will show.

parts: the shells of each part, front to back, in the order of the traced shells; the last is opaque.
prior: float32 (nodes * texels, 3) or None. Returns the maps, float32 (nodes * texels, 4), premultiplied
radiance and alpha, those of a node stacked in the order of `maps`; reports of the layers' own fit, then of
each pass; and what probing the views that have a renderer took.)");
}

void bind_layer_inference(nb::module_& m) {
  nb::class_<LayerInference> inference(m, "LayerInference", "Maps that were inferred from images of layers.");
  inference
      .def_prop_ro(
          "maps",
          [](LayerInference& self) {
            nb::dict maps;
            for (InferredMap& map : self.maps) {
              const std::size_t channels = map.has_alpha ? 4 : 3;
              std::vector<float> texels = map.texels;
              const std::size_t count = texels.size() / channels;
              maps[map.name.c_str()] = to_numpy(std::move(texels), {count, channels});
            }
            return maps;
          },
          nb::sig("def maps(self) -> dict[str, NDArray[numpy.float32]]"),
          "By name, float32 (texels, 3), or (texels, 4), premultiplied, with alpha. A new copy every time.")
      .def_ro("report", &LayerInference::report, "Of the solver's last pass.")
      .def_ro("pixels", &LayerInference::pixels, "To which the maps were fitted.")
      .def_ro("rejected", &LayerInference::rejected, "Pixels left out, since their light is not finite.");
  show(inference, {"pixels", "rejected", "report"});
  m.def(
      "infer_from_layers",
      [](const std::vector<PathText>& paths, const std::vector<std::pair<std::string, Proxy>>& shells,
         const TexelTopology& map, const RunTimeModel& run_time, bool maps_per_part,
         const std::string& reflector, const DisplayFitOptions& fit) {
        LayerInferenceOptions options;
        for (const auto& [name, proxy] : shells) options.shells.push_back({name, proxy});
        options.map = map;
        options.run_time = run_time;
        options.sharing = maps_per_part ? MapSharing::per_part : MapSharing::all_parts;
        options.reflector = reflector;
        options.fit = fit;
        const nb::gil_scoped_release unlocked;
        std::vector<LayerImage> images;
        for (const PathText& path : paths) images.push_back({path.text, load_image(path.text)});
        return infer_from_layers(images, options);
      },
      nb::arg("paths"), nb::kw_only(), nb::arg("shells") = std::vector<std::pair<std::string, Proxy>>{},
      nb::arg("map") = TexelTopology::cube(128), nb::arg("run_time") = web_run_time(),
      nb::arg("maps_per_part") = false, nb::arg("reflector") = "", nb::arg("options") = DisplayFitOptions{},
      signature<R"(def infer_from_layers(paths: collections.abc.Sequence[str | os.PathLike[str]], *,
shells: collections.abc.Sequence[tuple[str, Proxy]] = (), map: TexelTopology = ...,
run_time: RunTimeModel = ..., maps_per_part: bool = False, reflector: str = '',
options: DisplayFitOptions = ...) -> LayerInference)">(),
      "Infers maps from the images of layers that mb-trace writes. Use `mirrorbake.inference.infer_maps`.");
}

}  // namespace

void bind_display_fit(nb::module_& m) {
  bind_targets(m);
  bind_fit_inputs(m);
  bind_fit(m);
  bind_layer_inference(m);
}

}  // namespace mirrorbake::bindings
