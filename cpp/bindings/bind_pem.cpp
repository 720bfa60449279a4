#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include <optional>

#include "bind.hpp"
#include "mirrorbake/pem/render.hpp"

namespace mirrorbake::bindings {
namespace {

// Maps of one part, which keep their arrays alive.
struct OwnedPartMaps {
  Proxy local_proxy;
  std::optional<FloatMatrix> local;
  std::optional<ByteArray> local_triangles;
  Proxy distant_proxy;
  FloatMatrix distant;
};

}  // namespace

void bind_pem(nb::module_& m) {
  nb::class_<OwnedPartMaps>(m, "PartMaps", "Environment maps of one part of the reflector.")
      .def(
          "__init__",
          [](OwnedPartMaps* self, const Proxy& distant_proxy, FloatMatrix distant, const Proxy& local_proxy,
             std::optional<FloatMatrix> local, std::optional<ByteArray> local_triangles) {
            new (self) OwnedPartMaps{local_proxy, std::move(local), std::move(local_triangles), distant_proxy,
                                     std::move(distant)};
          },
          nb::arg("distant_proxy"), nb::arg("distant"), nb::arg("local_proxy") = Proxy{},
          nb::arg("local") = nb::none(), nb::arg("local_triangles") = nb::none(),
          "distant: float32 (texels, 3). local: float32 (texels, 4), premultiplied RGBA, or None for a part "
          "without\na local layer. local_triangles: uint8, 0 for each triangle of the reflector that the "
          "local "
          "layer leaves out,\nor None if it covers all.");

  m.def(
      "render_reflector",
      [](const SurfaceSamples& samples, const std::vector<const OwnedPartMaps*>& parts,
         const CubePyramidLayout& layout, std::optional<PointArray> diffuse, const LookupOptions& options) {
        std::vector<PartMaps> views;
        for (const OwnedPartMaps* part : parts) {
          PartMaps view;
          view.local_proxy = part->local_proxy;
          view.distant_proxy = part->distant_proxy;
          view.distant = {part->distant.data(), part->distant.size()};
          if (part->local) view.local = {part->local->data(), part->local->size()};
          if (part->local_triangles) {
            view.local_triangles = {part->local_triangles->data(), part->local_triangles->size()};
          }
          views.push_back(view);
        }
        std::span<const glm::vec3> diffuse_view;
        if (diffuse) diffuse_view = {reinterpret_cast<const glm::vec3*>(diffuse->data()), diffuse->shape(0)};
        Image image;
        {
          const nb::gil_scoped_release unlocked;
          image = render_reflector(samples, views, layout, diffuse_view, options);
        }
        return to_numpy(std::move(image.pixels),
                        {static_cast<std::size_t>(image.height), static_cast<std::size_t>(image.width), 4});
      },
      nb::arg("samples"), nb::arg("parts"), nb::arg("layout"), nb::arg("diffuse") = nb::none(),
      nb::arg("options") = LookupOptions{},
      "Draws the reflector from its maps: (L_local + (1 - alpha) L_distant) F + D per sample, averaged over "
      "the pixel.\n\n"
      "diffuse: float32 (len(samples), 3) or None for black. Returns float32 (H, W, 4): light times "
      "coverage, and "
      "coverage.");

  m.def(
      "diffuse_from_irradiance",
      [](const SurfaceSamples& samples,
         nb::ndarray<const std::uint32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu> triangles,
         PointArray irradiance) {
        std::vector<glm::vec3> diffuse;
        {
          const nb::gil_scoped_release unlocked;
          diffuse = diffuse_from_irradiance(
              samples, {reinterpret_cast<const glm::uvec3*>(triangles.data()), triangles.shape(0)},
              {reinterpret_cast<const glm::vec3*>(irradiance.data()), irradiance.shape(0)});
        }
        return vectors_to_numpy(std::move(diffuse));
      },
      nb::arg("samples"), nb::arg("triangles"), nb::arg("vertex_irradiance"),
      "Diffuse radiance of every sample, float32 (len(samples), 3), from irradiance baked per vertex (V, "
      "3).");
}

}  // namespace mirrorbake::bindings
