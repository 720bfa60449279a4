#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>

#include "bind.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/envmap/cube_pyramid.hpp"
#include "mirrorbake/envmap/texel_topology.hpp"
#include "mirrorbake/inference/map_solver.hpp"
#include "mirrorbake/inference/rendering_matrix.hpp"
#include "signature.hpp"

namespace mirrorbake::bindings {
namespace {

using Matrix = FloatMatrix;
using Vector = nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

std::span<const float> flat(const Matrix& values) { return {values.data(), values.size()}; }

std::span<const float> flat(const std::optional<Matrix>& values) {
  return values ? flat(*values) : std::span<const float>{};
}

// The array has to outlive the selection.
SampleSelection select(int part, const std::optional<ByteArray>& triangles) {
  if (!triangles) return {part};
  return {part, {triangles->data(), triangles->size()}};
}

void bind_topology(nb::module_& m) {
  nb::class_<CubePyramidLayout>(
      m, "CubePyramidLayout",
      R"(Order of the texels of a cube map with all its mip levels: the finest level first, in a level
the six faces (+X -X +Y -Y +Z -Z), in a face the rows from the top.)")
      .def(
          "__init__",
          [](CubePyramidLayout* self, int size) {
            new (self) CubePyramidLayout(CubePyramidLayout::full(size));
          },
          nb::arg("size"), "Full pyramid for faces of `size` texels a side, 1 to 16384.")
      .def_ro("size", &CubePyramidLayout::size, "Texels along a side of the finest level.")
      .def_ro("levels", &CubePyramidLayout::levels, "Number of levels.")
      .def_prop_ro("texels", &CubePyramidLayout::texels, "Number of texels of all levels.")
      .def("level_size", &CubePyramidLayout::level_size, nb::arg("level"), "Texels along a side of a level.")
      .def("level_offset", &CubePyramidLayout::level_offset, nb::arg("level"),
           "Index of a level's first texel.");

  m.def(
      "build_cube_pyramid",
      [](nb::ndarray<const float, nb::shape<6, -1, -1, -1>, nb::c_contig, nb::device::cpu> faces) {
        const int channels = static_cast<int>(faces.shape(3));
        if (faces.shape(1) != faces.shape(2)) throw nb::value_error("faces: expected shape (6, N, N, C)");
        const CubePyramidLayout layout = CubePyramidLayout::full(static_cast<int>(faces.shape(1)));
        std::vector<float> pyramid;
        {
          const nb::gil_scoped_release unlocked;
          pyramid = build_cube_pyramid({faces.data(), faces.size()}, layout, channels);
        }
        return to_numpy(std::move(pyramid), {layout.texels(), static_cast<std::size_t>(channels)});
      },
      nb::arg("faces"),
      R"(All levels of a cube map.

faces: float32 (6, N, N, C). Returns float32 (texels, C): every level is the mean of the finer one's 2x2
texels weighted by their solid angles ([EMT] section 2.4).)");

  nb::class_<MapProjection> kept(m, "MapProjection", "A projection in which the maps of a PEM can be kept.");
  kept.def_prop_ro(
          "name", [](const MapProjection& p) { return std::string(p.name); }, "In scene files and in PEMs.")
      .def_prop_ro(
          "projection", [](const MapProjection& p) { return to_string({.kind = p.projection}); },
          "Of the EnvMap that such a map is.")
      .def_ro("faces", &MapProjection::faces)
      .def_ro("faces_in_a_row", &MapProjection::faces_in_a_row, "Of a level in the images of the web format.")
      .def_prop_ro(
          "order", [](const MapProjection& p) { return std::string(p.order); },
          "Of the faces, and of their texels, in words.");
  show(kept, {"name", "projection", "faces"});
  m.def(
      "map_projections",
      [] {
        nb::dict known;
        for (const MapProjection& projection : map_projections()) {
          known[nb::str(projection.name.data(), projection.name.size())] = projection;
        }
        return known;
      },
      nb::sig("def map_projections() -> dict[str, MapProjection]"),
      "The projections in which the maps of a PEM can be kept, by the names that scene files have for them.");

  nb::class_<TexelTopology>(m, "TexelTopology",
                            R"(How the texels of a map with mip levels lie to each other. Numbered as the
values of an EnvMap are: levels from the finest, in a level the faces, in a face the rows from the top.)")
      .def(nb::init_implicit<const CubePyramidLayout&>())
      .def_static("of", &TexelTopology::of, nb::arg("projection"), nb::arg("size"),
                  "Of a map kept in a projection; a power of two, 1 to 16384.")
      .def_static("cube", &TexelTopology::cube, nb::arg("size"), "Six faces; a power of two, 1 to 16384.")
      .def_static("dual_paraboloid", &TexelTopology::dual_paraboloid, nb::arg("size"),
                  "Two faces, front first; a power of two, 1 to 16384.")
      .def_static("atlas", &TexelTopology::atlas, nb::arg("width"), nb::arg("height"),
                  "One sheet on texture coordinates; powers of two, 1 to 16384.")
      .def_prop_ro("texels", &TexelTopology::texels, "Number of texels of all levels.")
      .def_prop_ro("levels", &TexelTopology::levels)
      .def_prop_ro("faces", &TexelTopology::faces)
      .def("level_offset", &TexelTopology::level_offset, nb::arg("level"), "Index of a level's first texel.")
      .def("width", &TexelTopology::width, nb::arg("level") = 0, "Texels of a face of a level.")
      .def("height", &TexelTopology::height, nb::arg("level") = 0, "Texels of a face of a level.")
      .def("__repr__",
           [](const TexelTopology& self) {
             return "TexelTopology(faces=" + std::to_string(self.faces()) +
                    ", width=" + std::to_string(self.width(0)) +
                    ", height=" + std::to_string(self.height(0)) + ")";
           })
      .def(
          "__eq__", [](const TexelTopology& a, const TexelTopology& b) { return a == b; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"));
  nb::implicitly_convertible<CubePyramidLayout, TexelTopology>();
}

void bind_matrix(nb::module_& m) {
  nb::class_<RenderingMatrix>(
      m, "RenderingMatrix",
      "Sparse matrix A of b = A x: one row per pixel, one column per texel of every mip level.")
      .def_prop_ro("rows", &RenderingMatrix::rows)
      .def_ro("columns", &RenderingMatrix::columns)
      .def_prop_ro("nonzeros", &RenderingMatrix::nonzeros)
      .def_prop_ro(
          "row_offsets",
          [](nb::handle self) {
            return scalars_view(nb::cast<const RenderingMatrix&>(self).row_offsets, self);
          },
          "uint64 (rows + 1,): where each row's entries start.")
      .def_prop_ro(
          "texels",
          [](nb::handle self) { return scalars_view(nb::cast<const RenderingMatrix&>(self).texels, self); },
          "uint32 (nonzeros,): column of each entry.")
      .def_prop_ro(
          "weights",
          [](nb::handle self) { return scalars_view(nb::cast<const RenderingMatrix&>(self).weights, self); },
          "float32 (nonzeros,): value of each entry.")
      .def_prop_ro(
          "row_pixels",
          [](nb::handle self) {
            return scalars_view(nb::cast<const RenderingMatrix&>(self).row_pixels, self);
          },
          "uint32 (rows,): y * width + x of each row's pixel.")
      .def_prop_ro(
          "row_samples",
          [](const RenderingMatrix& self) {
            std::vector<std::uint32_t> counts(self.member_offsets.empty() ? 0 : self.rows());
            for (std::size_t r = 0; r < counts.size(); ++r) counts[r] = self.row_samples(r);
            const std::size_t rows = counts.size();
            return to_numpy(std::move(counts), {rows});
          },
          nb::rv_policy::move, "uint32 (rows,): how many samples of the pixel see the part.")
      .def(
          "row_means",
          [](const RenderingMatrix& self, Matrix values) {
            std::vector<float> target;
            {
              const nb::gil_scoped_release unlocked;
              target = average_over_rows(self, flat(values), static_cast<int>(values.shape(1)));
            }
            return to_numpy(std::move(target), {self.rows(), values.shape(1)});
          },
          nb::arg("values"),
          "Mean of per-sample values, float32 (samples, C), over each row's samples: float32 (rows, C).")
      .def(
          "multiply",
          [](const RenderingMatrix& self, Matrix x) {
            std::vector<float> b;
            {
              const nb::gil_scoped_release unlocked;
              b = multiply(self, flat(x), static_cast<int>(x.shape(1)));
            }
            return to_numpy(std::move(b), {self.rows(), x.shape(1)});
          },
          nb::arg("x"), "b = A x for x float32 (columns, C): float32 (rows, C).");
}

void bind_matrix_uses(nb::module_& m) {
  m.def(
      "build_rendering_matrix",
      [](const SurfaceSamples& samples, int part, const Proxy& proxy, const TexelTopology& topology,
         const RunTimeModel& run_time, const std::optional<ByteArray>& triangles) {
        const SampleSelection selection = select(part, triangles);
        const nb::gil_scoped_release unlocked;
        return build_rendering_matrix(samples, selection, proxy, topology, run_time);
      },
      nb::arg("samples"), nb::arg("part"), nb::arg("proxy"), nb::arg("topology"),
      nb::arg("run_time") = reference_run_time(), nb::arg("triangles") = nb::none(),
      signature<R"(def build_rendering_matrix(samples: SurfaceSamples, part: int, proxy: Proxy,
topology: TexelTopology | CubePyramidLayout, run_time: RunTimeModel = ...,
triangles: numpy.typing.NDArray[numpy.uint8] | None = None) -> RenderingMatrix)">(),
      R"(Rendering matrix of the samples that lie on `part` ([PEM] section 4), built from their lookups.
`triangles`: uint8, 0 for each triangle of the reflector whose samples are left out; None: all count.)");

  m.def(
      "display_row_weights",
      [](const RenderingMatrix& matrix, int samples_per_pixel, Matrix target,
         const std::vector<std::uint32_t>& pixel_samples) {
        const int channels = static_cast<int>(target.shape(1));
        return to_numpy(display_row_weights(matrix, samples_per_pixel, flat(target), channels, pixel_samples),
                        {matrix.rows(), target.shape(1)});
      },
      nb::arg("matrix"), nb::arg("samples_per_pixel"), nb::arg("target"),
      nb::arg("pixel_samples") = std::vector<std::uint32_t>{},
      R"(Row weights for a target that will be looked at on a display: coverage / (1 + luminance)^2,
float32 (rows, C). `pixel_samples` as SurfaceSamples has it stands in for samples_per_pixel.)");
}

void bind_solver_options(nb::module_& m) {
  nb::class_<SolveOptions> solve_options(m, "SolveOptions", "Weights of the regulariser and when to stop.");
  std::vector<const char*> attributes;
  std::string keywords = "def __init__(self, *, ";
  nb::list weights;
  for (const SolveWeight& weight : kSolveWeights) {
    solve_options.def_prop_rw(
        weight.name, [value = weight.value](const SolveOptions& options) { return options.*value; },
        [value = weight.value](SolveOptions& options, float number) { options.*value = number; }, weight.help,
        nb::for_setter(nb::name(weight.name)));
    attributes.push_back(weight.name);
    keywords += std::string(weight.name) + ": float = " + text_of(SolveOptions{}.*weight.value) + ", ";
    weights.append(weight.name);
  }
  keywords += "tolerance: float = " + text_of(SolveOptions{}.tolerance) +
              ", max_iterations: int = " + std::to_string(SolveOptions{}.max_iterations) + ") -> None";
  solve_options
      .def_rw("tolerance", &SolveOptions::tolerance,
              "Stop when the gradient has shrunk to this fraction, > 0.")
      .def_rw("max_iterations", &SolveOptions::max_iterations, "0 to 100000.");
  attributes.insert(attributes.end(), {"tolerance", "max_iterations"});
  keyword_init(solve_options, keywords);
  record(solve_options, attributes);
  m.attr("SOLVE_WEIGHTS") = nb::tuple(weights);

  nb::class_<SolveReport> solve_report(m, "SolveReport", "What a solve did.");
  solve_report.def_ro("iterations", &SolveReport::iterations)
      .def_ro("rounds", &SolveReport::rounds, "Of the active set that keeps the map within its bounds.")
      .def_ro("converged", &SolveReport::converged,
              "The gradient met the tolerance, and the bounds are settled.")
      .def_ro("relative_gradient", &SolveReport::relative_gradient, "What `tolerance` is compared with.")
      .def_ro("unknowns", &SolveReport::unknowns, "Texels that some row sees.")
      .def_ro("rms_error", &SolveReport::rms_error, "Weighted root mean square of A x - b.");
  show(solve_report, {"iterations", "rounds", "converged", "relative_gradient", "unknowns", "rms_error"});
}

void bind_solver(nb::module_& m) {
  using Nodes = std::vector<std::pair<int, float>>;
  nb::class_<MapSolver>(m, "MapSolver",
                        R"(Regularised least squares for the maps of one or several nodes, seen by one or
several views ([PEM] section 4): what all solves share is computed once.)")
      .def(
          "__init__",
          [](MapSolver* self, const std::vector<std::pair<const RenderingMatrix*, Nodes>>& views,
             const std::vector<TexelTopology>& maps, int nodes, const SolveOptions& options) {
            std::vector<SolverView> solver_views;
            for (const auto& [matrix, blend] : views) {
              SolverView& view = solver_views.emplace_back(SolverView{matrix, {}});
              for (const auto& [node, weight] : blend) view.nodes.push_back({node, weight});
            }
            const nb::gil_scoped_release unlocked;
            new (self) MapSolver(solver_views, maps, nodes, options);
          },
          nb::arg("views"), nb::arg("maps"), nb::arg("nodes") = 1, nb::arg("options") = SolveOptions{},
          signature<R"(def __init__(self,
views: collections.abc.Sequence[tuple[RenderingMatrix, collections.abc.Sequence[tuple[int, float]]]],
maps: collections.abc.Sequence[TexelTopology | CubePyramidLayout], nodes: int = 1,
options: SolveOptions = ...) -> None)">(),
          R"(views: matrices, each with the nodes whose maps it sees and their weights in the blend: [(0,
1.0)] for the only one. maps: those of a node, stacked as the columns are.)")
      .def(
          "solve",
          [](const MapSolver& self, const std::vector<Matrix>& targets,
             const std::vector<Matrix>& row_weights, std::optional<Matrix> prior,
             std::optional<Matrix> initial) {
            if (targets.size() != row_weights.size())
              throw nb::value_error("row_weights: expected one per target");
            const std::size_t channels = targets.empty() ? 1 : targets.front().shape(1);
            std::vector<ViewTarget> views;
            for (std::size_t v = 0; v < targets.size(); ++v) {
              views.push_back({flat(targets[v]), flat(row_weights[v])});
            }
            SolveProblem problem;
            problem.channels = static_cast<int>(channels);
            problem.views = views;
            problem.prior = flat(prior);
            problem.initial = flat(initial);
            MapSolution solution;
            {
              const nb::gil_scoped_release unlocked;
              solution = self.solve(problem);
            }
            const std::size_t texels = solution.texels.size() / channels;
            return nb::make_tuple(to_numpy(std::move(solution.texels), {texels, channels}), solution.report);
          },
          nb::arg("targets"), nb::arg("row_weights"), nb::arg("prior") = nb::none(),
          nb::arg("initial") = nb::none(), signature<R"(def solve(self,
targets: collections.abc.Sequence[numpy.typing.NDArray[numpy.float32]],
row_weights: collections.abc.Sequence[numpy.typing.NDArray[numpy.float32]],
prior: numpy.typing.NDArray[numpy.float32] | None = None,
initial: numpy.typing.NDArray[numpy.float32] | None = None) ->
tuple[numpy.typing.NDArray[numpy.float32], SolveReport])">(),
          R"(Solves for the maps.

targets, row_weights: of each view, float32 (rows, C), 1 to 4 channels, the fourth is coverage. prior,
initial: float32 (nodes * texels, C). Returns the maps, float32 (nodes * texels, C), within [0, inf)
(coverage in [0, 1]), and a report.)");
}

}  // namespace

void bind_inference(nb::module_& m) {
  bind_topology(m);
  bind_matrix(m);
  bind_matrix_uses(m);
  bind_solver_options(m);
  bind_solver(m);
}

}  // namespace mirrorbake::bindings
