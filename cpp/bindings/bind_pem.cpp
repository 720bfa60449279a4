#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include <optional>

#include "bind.hpp"
#include "mirrorbake/pem/render.hpp"
#include "signature.hpp"

namespace mirrorbake::bindings {
namespace {

// A shell's map, which keeps its arrays alive.
struct OwnedShellMap {
  Proxy proxy;
  TexelTopology topology;
  FloatMatrix texels;
  std::optional<ByteArray> triangles;

  ShellMap view() const {
    ShellMap map{proxy, topology, {texels.data(), texels.size()}};
    if (triangles) map.triangles = {triangles->data(), triangles->size()};
    return map;
  }
};

void bind_shell_map(nb::module_& m) {
  nb::class_<OwnedShellMap>(m, "ShellMap", "The map of one shell, as a part of the reflector reads it.")
      .def(
          "__init__",
          [](OwnedShellMap* self, const Proxy& proxy, const TexelTopology& topology, FloatMatrix texels,
             std::optional<ByteArray> triangles) {
            new (self) OwnedShellMap{proxy, topology, std::move(texels), std::move(triangles)};
          },
          nb::arg("proxy"), nb::arg("topology"), nb::arg("texels"), nb::arg("triangles") = nb::none(),
          signature<R"(def __init__(self, proxy: Proxy, topology: TexelTopology | CubePyramidLayout,
texels: numpy.typing.NDArray[numpy.float32],
triangles: numpy.typing.NDArray[numpy.uint8] | None = None) -> None)">(),
          R"(texels: float32 (texels, 4), premultiplied RGBA, or (texels, 3), opaque. triangles: uint8, 0
for each triangle of the reflector that the shell leaves out, or None if it covers all.)")
      .def_ro("proxy", &OwnedShellMap::proxy)
      .def_ro("topology", &OwnedShellMap::topology)
      .def_prop_ro(
          "texels",
          [](nb::handle self) {
            const OwnedShellMap& map = nb::cast<const OwnedShellMap&>(self);
            const std::size_t shape[2] = {map.texels.shape(0), map.texels.shape(1)};
            return nb::ndarray<nb::numpy, const float>(map.texels.data(), 2, shape, self);
          },
          "(texels, 3) or (texels, 4), read-only.")
      .def_prop_ro(
          "triangles",
          [](nb::handle self) -> std::optional<nb::ndarray<nb::numpy, const std::uint8_t>> {
            const OwnedShellMap& map = nb::cast<const OwnedShellMap&>(self);
            if (!map.triangles) return std::nullopt;
            const std::size_t shape[1] = {map.triangles->size()};
            return nb::ndarray<nb::numpy, const std::uint8_t>(map.triangles->data(), 1, shape, self);
          },
          "uint8, 0 for those that the shell leaves out, read-only; None: it covers all.");
}

void bind_rendering(nb::module_& m) {
  m.def(
      "render_reflector",
      [](const SurfaceSamples& samples, const std::vector<std::vector<const OwnedShellMap*>>& parts,
         std::optional<PointArray> diffuse, const RunTimeModel& run_time) {
        std::vector<PartShells> views;
        for (const auto& shells : parts) {
          PartShells& part = views.emplace_back();
          for (const OwnedShellMap* shell : shells) part.push_back(shell->view());
        }
        std::span<const glm::vec3> diffuse_view;
        if (diffuse) diffuse_view = {reinterpret_cast<const glm::vec3*>(diffuse->data()), diffuse->shape(0)};
        Image image;
        {
          const nb::gil_scoped_release unlocked;
          image = render_reflector(samples, views, diffuse_view, run_time);
        }
        return to_numpy(std::move(image.pixels),
                        {static_cast<std::size_t>(image.height), static_cast<std::size_t>(image.width), 4});
      },
      nb::arg("samples"), nb::arg("parts"), nb::arg("diffuse") = nb::none(),
      nb::arg("run_time") = reference_run_time(), signature<R"(def render_reflector(samples: SurfaceSamples,
parts: collections.abc.Sequence[collections.abc.Sequence[ShellMap]],
diffuse: numpy.typing.NDArray[numpy.float32] | None = None, run_time: RunTimeModel = ...) ->
numpy.typing.NDArray[numpy.float32])">(),
      R"(Draws the reflector from its maps: (L0 + (1 - a0)(L1 + ...)) F + D per sample, averaged over the
pixel.

parts: the shells of each part, front to back. diffuse: float32 (len(samples), 3) or None for black.
Returns float32 (H, W, 4): light times coverage, and coverage.)");

  m.def(
      "shell_light",
      [](const SurfaceSamples& samples, const OwnedShellMap& map, const RunTimeModel& run_time) {
        std::vector<glm::vec4> light;
        {
          const nb::gil_scoped_release unlocked;
          light = shell_light(samples, map.view(), run_time);
        }
        return vectors_to_numpy(std::move(light));
      },
      nb::arg("samples"), nb::arg("map"), nb::arg("run_time") = reference_run_time(),
      signature<R"(def shell_light(samples: SurfaceSamples, map: ShellMap, run_time: RunTimeModel = ...) ->
numpy.typing.NDArray[numpy.float32])">(),
      R"(What every sample reads of one shell's map, float32 (len(samples), 4): premultiplied light, not
yet times F, and alpha, which is 0 where the shell leaves the sample's triangle out.)");

  m.def(
      "diffuse_from_irradiance",
      [](const SurfaceSamples& samples, TriangleArray triangles, PointArray irradiance,
         const std::optional<PointArray>& back) {
        std::vector<glm::vec3> diffuse;
        {
          const nb::gil_scoped_release unlocked;
          diffuse = diffuse_from_irradiance(samples, indices(triangles), points(irradiance),
                                            back ? points(*back) : std::span<const glm::vec3>());
        }
        return vectors_to_numpy(std::move(diffuse));
      },
      nb::arg("samples"), nb::arg("triangles"), nb::arg("vertex_irradiance"),
      nb::arg("back_irradiance") = nb::none(),
      R"(Diffuse radiance of every sample, float32 (len(samples), 3), from irradiance baked per vertex
(V, 3). Samples that see the back of a triangle take that of `back_irradiance`, if it is given.)");

  m.def(
      "diffuse_from_lightmap",
      [](const SurfaceSamples& samples, TriangleArray triangles, UvArray uvs, int size, PointArray lightmap,
         const std::optional<PointArray>& back) {
        std::vector<glm::vec3> diffuse;
        {
          const nb::gil_scoped_release unlocked;
          diffuse = diffuse_from_lightmap(samples, indices(triangles), pairs(uvs), size, points(lightmap),
                                          back ? points(*back) : std::span<const glm::vec3>());
        }
        return vectors_to_numpy(std::move(diffuse));
      },
      nb::arg("samples"), nb::arg("triangles"), nb::arg("uvs"), nb::arg("size"), nb::arg("lightmap"),
      nb::arg("back_lightmap") = nb::none(),
      R"(The same from a lightmap: irradiance (size * size, 3) in texels on the texture coordinates (V, 2),
rows from the top, v up, read bilinearly.)");
}

}  // namespace

void bind_pem(nb::module_& m) {
  bind_shell_map(m);
  bind_rendering(m);
}

}  // namespace mirrorbake::bindings
