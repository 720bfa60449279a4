#include "bind.hpp"
#include "mirrorbake/inference/probe.hpp"
#include "signature.hpp"

namespace mirrorbake::bindings {

void bind_probe(nb::module_& m) {
  nb::class_<ProbedMatrix>(m, "ProbedMatrix", "What `probe_rendering_matrix` found out about a renderer.")
      .def_ro("matrix", &ProbedMatrix::matrix, "RenderingMatrix whose rows sum to 1; it has no row_samples.")
      .def_prop_ro(
          "scales",
          [](nb::handle self) {
            const auto& probed = nb::cast<const ProbedMatrix&>(self);
            const std::size_t shape[2] = {probed.errors.size(), 3};
            return nb::ndarray<nb::numpy, const float>(probed.scales.data(), 2, shape, self);
          },
          "float32 (rows, 3): what a white map shows in each row's pixel, less what a black one does.")
      .def_prop_ro(
          "errors",
          [](nb::handle self) { return scalars_view(nb::cast<const ProbedMatrix&>(self).errors, self); },
          "float32 (rows,): largest error of pictures of random texels, relative to the scale.")
      .def_ro("renderings", &ProbedMatrix::renderings, "How many pictures were drawn.")
      .def_ro("colours", &ProbedMatrix::colours, "Groups of texels, no two of one group in any row.")
      .def_prop_ro(
          "unresolved", [](const ProbedMatrix& self) { return self.missing.size(); },
          "How many pixels see the map and have no row.");

  m.def(
      "probe_rendering_matrix",
      [](const TexelTopology& topology, const nb::callable& render, int most_renderings, float step,
         float tolerance) {
        const TestRenderer renderer = [&](std::span<const float> texels) {
          const nb::gil_scoped_acquire locked;
          std::vector<float> map(texels.begin(), texels.end());
          const std::size_t count = map.size() / 3;
          const auto picture = nb::cast<FloatArray>(render(to_numpy(std::move(map), {count, 3})));
          return std::vector<float>(picture.data(), picture.data() + picture.size());
        };
        const nb::gil_scoped_release unlocked;
        return probe_rendering_matrix(topology, renderer, {most_renderings, step, tolerance});
      },
      nb::arg("topology"), nb::arg("render"), nb::kw_only(),
      nb::arg("most_renderings") = ProbeOptions{}.most_renderings, nb::arg("step") = ProbeOptions{}.step,
      nb::arg("tolerance") = ProbeOptions{}.tolerance,
      signature<R"(def probe_rendering_matrix(topology: TexelTopology | CubePyramidLayout,
render: collections.abc.Callable[[numpy.typing.NDArray[numpy.float32]], numpy.typing.NDArray[numpy.float32]],
*, most_renderings: int = 64, step: float = 0.0, tolerance: float = 1e-4) -> ProbedMatrix)">(),
      R"(Rendering matrix of a renderer of which only pictures are to be had ([PEM] section 4).

topology: of the map. render: draws the view with the map's texels, float32 (texels, 3) in [0, 1], all levels as
given, and returns float32 (height, width, 3), linear in the texels but for a constant: no tone mapping, no
clamping. The channels may differ by a factor per pixel, such as Fresnel reflectance. most_renderings: 16 to 1024.
step: between the values that the renderer can return, 0 for floats, 1/255 for eight bits. tolerance: rows that
reproduce pictures of random texels worse than this, relative to their scale, are left out and counted.

A map of 128 x 128 texels a face with all levels takes about 50 pictures: three colours of texels a picture, no two
of one colour in any pixel. Raises ValueError for options out of range and pictures of changing size or with values
that are not finite.)");
}

}  // namespace mirrorbake::bindings
