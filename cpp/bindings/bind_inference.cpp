#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include <optional>

#include "bind.hpp"
#include "mirrorbake/envmap/cube_pyramid.hpp"
#include "mirrorbake/inference/map_solver.hpp"
#include "mirrorbake/inference/rendering_matrix.hpp"

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

}  // namespace

void bind_inference(nb::module_& m) {
  nb::class_<CubePyramidLayout>(
      m, "CubePyramidLayout",
      "Order of the texels of a cube map with all its mip levels: the finest level first, in a "
      "level the six faces (+X -X +Y -Y +Z -Z), in a face the rows from the top.")
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
      "All levels of a cube map.\n\nfaces: float32 (6, N, N, C). Returns float32 (texels, C): every level is "
      "the mean of the "
      "finer one's 2x2 texels weighted by their solid angles ([EMT] section 2.4).");

  nb::class_<LookupOptions>(m, "LookupOptions", "How a renderer reads the map.")
      .def(
          "__init__",
          [](LookupOptions* self, float footprint_scale) { new (self) LookupOptions{footprint_scale}; },
          nb::kw_only(), nb::arg("footprint_scale") = LookupOptions{}.footprint_scale)
      .def_rw(
          "footprint_scale", &LookupOptions::footprint_scale,
          "Size of a lookup's footprint in pixels, in (0, 1024]. 1: the pixel's, as graphics hardware does.");

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
          [](nb::handle self) {
            return scalars_view(nb::cast<const RenderingMatrix&>(self).row_samples, self);
          },
          "uint32 (rows,): how many samples of the pixel see the part.")
      .def(
          "average",
          [](const RenderingMatrix& self, const SurfaceSamples& samples, int part, Matrix values,
             const std::optional<ByteArray>& triangles) {
            const SampleSelection selection = select(part, triangles);
            std::vector<float> target;
            {
              const nb::gil_scoped_release unlocked;
              target = average_over_rows(self, samples, selection, flat(values),
                                         static_cast<int>(values.shape(1)));
            }
            return to_numpy(std::move(target), {self.rows(), values.shape(1)});
          },
          nb::arg("samples"), nb::arg("part"), nb::arg("values"), nb::arg("triangles") = nb::none(),
          "Mean of per-sample values, float32 (len(samples), C), over each row's samples: float32 (rows, C). "
          "`part` and\n`triangles` are those that the matrix was built of.")
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

  m.def(
      "build_rendering_matrix",
      [](const SurfaceSamples& samples, int part, const Proxy& proxy, const CubePyramidLayout& layout,
         const LookupOptions& options, const std::optional<ByteArray>& triangles) {
        const SampleSelection selection = select(part, triangles);
        const nb::gil_scoped_release unlocked;
        return build_rendering_matrix(samples, selection, proxy, layout, options);
      },
      nb::arg("samples"), nb::arg("part"), nb::arg("proxy"), nb::arg("layout"),
      nb::arg("options") = LookupOptions{}, nb::arg("triangles") = nb::none(),
      "Rendering matrix of the samples that lie on `part` ([PEM] section 4), built from their lookups. "
      "`triangles`: uint8,\n0 for each triangle of the reflector whose samples are left out; None: all "
      "count.");

  m.def(
      "display_row_weights",
      [](const RenderingMatrix& matrix, int samples_per_pixel, Matrix target) {
        const int channels = static_cast<int>(target.shape(1));
        return to_numpy(display_row_weights(matrix, samples_per_pixel, flat(target), channels),
                        {matrix.rows()});
      },
      nb::arg("matrix"), nb::arg("samples_per_pixel"), nb::arg("target"),
      "Row weights for a target that will be looked at on a display: coverage / (1 + luminance)^2, float32 "
      "(rows,).");

  nb::class_<SolveOptions>(m, "SolveOptions", "Weights of the regulariser and when to stop.")
      .def(
          "__init__",
          [](SolveOptions* self, float smoothness, float level_agreement, float prior_weight, float tolerance,
             int max_iterations) {
            new (self) SolveOptions{smoothness, level_agreement, prior_weight, tolerance, max_iterations};
          },
          nb::kw_only(), nb::arg("smoothness") = SolveOptions{}.smoothness,
          nb::arg("level_agreement") = SolveOptions{}.level_agreement,
          nb::arg("prior_weight") = SolveOptions{}.prior_weight,
          nb::arg("tolerance") = SolveOptions{}.tolerance,
          nb::arg("max_iterations") = SolveOptions{}.max_iterations)
      .def_rw("smoothness", &SolveOptions::smoothness,
              "Weight of squared differences of neighbouring texels, >= 0.")
      .def_rw("level_agreement", &SolveOptions::level_agreement,
              "Weight of a texel's squared difference from the mean of its children, >= 0.")
      .def_rw("prior_weight", &SolveOptions::prior_weight,
              "Weight of the squared difference from the prior, >= 0.")
      .def_rw("tolerance", &SolveOptions::tolerance,
              "Stop when the gradient has shrunk to this fraction, > 0.")
      .def_rw("max_iterations", &SolveOptions::max_iterations, "0 to 100000.");

  nb::class_<SolveReport>(m, "SolveReport", "What a solve did.")
      .def_ro("iterations", &SolveReport::iterations)
      .def_ro("rounds", &SolveReport::rounds, "Of the active set that keeps the map within its bounds.")
      .def_ro("relative_gradient", &SolveReport::relative_gradient, "What `tolerance` is compared with.")
      .def_ro("unknowns", &SolveReport::unknowns, "Texels that some row sees.")
      .def_ro("rms_error", &SolveReport::rms_error, "Weighted root mean square of A x - b.");

  nb::class_<MapSolver>(
      m, "MapSolver",
      "Regularised least squares for maps of one rendering matrix ([PEM] section 4): what all solves "
      "share is computed once.")
      .def(
          "__init__",
          [](MapSolver* self, const RenderingMatrix& matrix, Vector row_weights,
             const CubePyramidLayout& layout, const SolveOptions& options) {
            const nb::gil_scoped_release unlocked;
            new (self) MapSolver(matrix, {row_weights.data(), row_weights.size()}, layout, options);
          },
          nb::arg("matrix"), nb::arg("row_weights"), nb::arg("layout"), nb::arg("options") = SolveOptions{})
      .def(
          "solve",
          [](const MapSolver& self, Matrix target, std::optional<Matrix> prior,
             std::optional<Matrix> initial) {
            const std::size_t channels = target.shape(1);
            MapSolution solution;
            {
              const nb::gil_scoped_release unlocked;
              solution = self.solve(flat(target), static_cast<int>(channels), flat(prior), flat(initial));
            }
            const std::size_t texels = channels == 0 ? 0 : solution.texels.size() / channels;
            return nb::make_tuple(to_numpy(std::move(solution.texels), {texels, channels}), solution.report);
          },
          nb::arg("target"), nb::arg("prior") = nb::none(), nb::arg("initial") = nb::none(),
          nb::sig("def solve(self, target: numpy.typing.NDArray[numpy.float32], prior: "
                  "numpy.typing.NDArray[numpy.float32] "
                  "| None = None, initial: numpy.typing.NDArray[numpy.float32] | None = None) -> "
                  "tuple[numpy.typing.NDArray[numpy.float32], SolveReport]"),
          "Solves for a map.\n\ntarget: float32 (rows, C), 1 to 4 channels, the fourth is coverage. prior, "
          "initial: float32 "
          "(texels, C). Returns the map, float32 (texels, C), within [0, inf) (coverage in [0, 1]), and "
          "a report.");
}

}  // namespace mirrorbake::bindings
