#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <string>
#include <vector>

#include "bind.hpp"
#include "bind_enums.hpp"
#include "mirrorbake/surface/run_time_model.hpp"
#include "mirrorbake/surface/surface_samples.hpp"
#include "mirrorbake/surface/texture_samples.hpp"
#include "mirrorbake/surface/vertex_lookups.hpp"

namespace mirrorbake::bindings {
namespace {

// Read-only views that keep the owner alive.
template <auto member>
void def_vectors(nb::class_<SurfaceSamples>& c, const char* name, const char* doc) {
  c.def_prop_ro(
      name, [](nb::handle self) { return vectors_view(nb::cast<const SurfaceSamples&>(self).*member, self); },
      doc);
}
template <auto member>
void def_scalars(nb::class_<SurfaceSamples>& c, const char* name, const char* doc) {
  c.def_prop_ro(
      name, [](nb::handle self) { return scalars_view(nb::cast<const SurfaceSamples&>(self).*member, self); },
      doc);
}

void bind_shell_light(nb::module_& m) {
  nb::class_<ShellLight>(
      m, "ShellLight",
      "Light that the reflected rays of SurfaceSamples bring from one shell of the environment.")
      .def_ro("name", &ShellLight::name)
      .def_prop_ro(
          "radiance",
          [](nb::handle self) { return vectors_view(nb::cast<const ShellLight&>(self).radiance, self); },
          "(n, 4): incident radiance, premultiplied, and alpha, which is 1 in the last shell.")
      .def_prop_ro(
          "hit_distance",
          [](nb::handle self) { return scalars_view(nb::cast<const ShellLight&>(self).hit_distance, self); },
          "(n,): metres along the ray to what it meets; inf: nothing.");
}

void bind_samples(nb::module_& m) {
  nb::class_<SurfaceSamples> c(
      m, "SurfaceSamples",
      R"(Where the samples of an image's pixels first meet the reflector: one entry per sample that sees
it, ordered by pixel, then by sample. All arrays are read-only views; `diffuse` and `shells` are empty
when no light was traced.)");
  c.def_ro("width", &SurfaceSamples::width, "Of the image, pixels.");
  c.def_ro("height", &SurfaceSamples::height, "Of the image, pixels.");
  c.def_ro("samples_per_pixel", &SurfaceSamples::samples_per_pixel);
  c.def_prop_ro(
      "pixel_samples",
      [](nb::handle self) { return scalars_view(nb::cast<const SurfaceSamples&>(self).pixel_samples, self); },
      "(height * width,) uint32: samples traced per pixel; empty if all are `samples_per_pixel`.");
  c.def("__len__", &SurfaceSamples::size);
  using S = SurfaceSamples;
  def_scalars<&S::pixel>(c, "pixel", "(n,) uint32: y * width + x.");
  def_scalars<&S::part>(c, "part", "(n,) uint16: part of the reflector.");
  def_scalars<&S::triangle>(c, "triangle", "(n,) uint32: triangle of the reflector's mesh.");
  def_vectors<&S::barycentric>(c, "barycentric",
                               "(n, 2): weights of the triangle's second and third vertex.");
  def_vectors<&S::position>(c, "position", "(n, 3): metres, relative to `origin`.");
  c.def_prop_ro(
      "origin",
      [](const SurfaceSamples& s) {
        return std::array{s.origin.x, s.origin.y, s.origin.z};
      },
      nb::sig("def origin(self) -> tuple[float, float, float]"),
      "Where in the scene the positions' zero is: 0, but for scenes far from their own zero.");
  def_vectors<&S::normal>(c, "normal", "(n, 3): unit shading normal, towards the eye.");
  def_vectors<&S::reflection>(c, "reflection", "(n, 3): unit direction r = 2(n·v)n - v.");
  def_vectors<&S::dposition_dx>(c, "dposition_dx", "(n, 3): change of `position` per pixel to the right.");
  def_vectors<&S::dposition_dy>(c, "dposition_dy", "(n, 3): change of `position` per pixel down.");
  def_vectors<&S::dreflection_dx>(c, "dreflection_dx",
                                  "(n, 3): change of `reflection` per pixel to the right.");
  def_vectors<&S::dreflection_dy>(c, "dreflection_dy", "(n, 3): change of `reflection` per pixel down.");
  def_vectors<&S::fresnel>(c, "fresnel", "(n, 3): Fresnel reflectance F of the first bounce.");
  def_vectors<&S::albedo>(c, "albedo", "(n, 3): diffuse albedo, times (1 - F) under a coat.");
  def_vectors<&S::emission>(c, "emission", "(n, 3): radiance of the surface's own; (0, 3): none.");
  def_scalars<&S::back>(c, "back",
                        "(n,) uint8: 1 where the eye sees the back of the triangle; (0,): nowhere.");
  def_vectors<&S::diffuse>(c, "diffuse", "(n, 3): radiance D that the body reflects and emits.");
  c.def_prop_ro(
      "shells",
      [](nb::handle self) {
        nb::list shells;
        for (const ShellLight& shell : nb::cast<const SurfaceSamples&>(self).shells) {
          shells.append(nb::cast(shell, nb::rv_policy::reference_internal, self));
        }
        return shells;
      },
      nb::sig("def shells(self) -> list[ShellLight]"),
      "Front to back: the incident radiance is L0 + (1 - a0)(L1 + ...).");
}

void bind_vertex_lookups(nb::module_& m) {
  m.def(
      "with_vertex_lookups",
      [](const SurfaceSamples& samples, PointArray positions, TriangleArray triangles, PointArray lookups) {
        const nb::gil_scoped_release unlocked;
        return with_vertex_lookups(samples, points(positions), indices(triangles), points(lookups));
      },
      nb::arg("samples"), nb::arg("positions"), nb::arg("triangles"), nb::arg("lookups"),
      R"(Samples that read a map at coordinates of the vertices, float32 (V, 3), interpolated over every
triangle ([PEM] section 5): texture coordinates (u, v, 0), or lookups on a proxy. To be read through
Proxy.infinite, since `reflection` is then the lookup itself, of any length.)");
  m.def(
      "texture_samples",
      [](PointArray positions, TriangleArray triangles, UvArray uvs, int size, int per_side) {
        const nb::gil_scoped_release unlocked;
        return texture_samples(points(positions), indices(triangles), pairs(uvs), size, per_side);
      },
      nb::arg("positions"), nb::arg("triangles"), nb::arg("uvs"), nb::arg("size"), nb::arg("per_side") = 2,
      R"(A surface as its texture sees it: samples of an image whose pixels are the `size`^2 texels (1 to
4096) of a map on the texture coordinates, float32 (V, 2), v up, at `per_side`^2 (1 to 8) places of each,
where a triangle has any. To be read through Proxy.infinite: `reflection` is (u, 1 - v, 0).)");
}

RunTimeModel checked(RunTimeModel model) {
  validate(model);
  return model;
}

void bind_run_time(nb::module_& m) {
  const RunTimeModel web = web_run_time();
  nb::class_<RunTimeModel>(m, "RunTimeModel",
                           "How the renderer that will draw the maps reads them: what a map is inferred for.")
      .def(
          "__init__",
          [](RunTimeModel* self, std::string name, std::vector<glm::vec2> places, float footprint_scale,
             LookupFilter filter, int max_taps) {
            new (self) RunTimeModel(
                checked({std::move(name), std::move(places), footprint_scale, filter, max_taps}));
          },
          nb::kw_only(), nb::arg("name"), nb::arg("places"), nb::arg("footprint_scale"),
          nb::arg("filter") = LookupFilter::anisotropic, nb::arg("max_taps") = web.max_taps)
      .def_ro("name", &RunTimeModel::name)
      .def_ro("places", &RunTimeModel::places,
              "Where in a pixel the lookups lie: (x, y) in [0, 1) from its top left corner.")
      .def_ro("footprint_scale", &RunTimeModel::footprint_scale,
              "Size of a lookup's footprint in pixels, in (0, 1024].")
      .def_ro("filter", &RunTimeModel::filter)
      .def_ro("max_taps", &RunTimeModel::max_taps, "Of `anisotropic`: 1, or an even number up to 16.")
      .def("__repr__",
           [](const RunTimeModel& self) {
             return "RunTimeModel('" + self.name + "', lookups=" + std::to_string(self.places.size()) + ")";
           })
      .def(
          "__eq__", [](const RunTimeModel& a, const RunTimeModel& b) { return a == b; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"));
  m.def(
      "run_time_model", [](const std::string& name) { return run_time_model(name); }, nb::arg("name"),
      R"(Web (four lookups per pixel on a rotated grid, footprint 1/2, up to 4 taps), Web1 (one lookup)
or Reference (16 lookups, footprint 1/4).)");
}

}  // namespace

void bind_surface(nb::module_& m) {
  bind_shell_light(m);
  bind_samples(m);
  bind_vertex_lookups(m);
  bind_run_time(m);
}

}  // namespace mirrorbake::bindings
