#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bind.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/load.hpp"
#include "mirrorbake/scene/scene.hpp"
#include "mirrorbake/scene/shapes.hpp"

namespace mirrorbake::bindings {
namespace {

using TangentArray = nb::ndarray<const float, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using PartArray = nb::ndarray<const std::uint16_t, nb::shape<-1>, nb::c_contig, nb::device::cpu>;

template <typename Element, typename Array>
std::vector<Element> copied(const Array& array) {
  std::vector<Element> elements(array.shape(0));
  if (!elements.empty()) std::memcpy(elements.data(), array.data(), elements.size() * sizeof(Element));
  return elements;
}

const TriangleMesh& mesh_of(nb::handle self) { return nb::cast<const TriangleMesh&>(self); }

void bind_triangle_mesh(nb::module_& m) {
  nb::class_<TriangleMesh>(
      m, "TriangleMesh",
      "Triangles with optional vertex normals, texture coordinates and parts. World space, metres.")
      .def(
          "__init__",
          [](TriangleMesh* self, const PointArray& positions, const TriangleArray& triangles,
             const std::optional<PointArray>& normals, const std::optional<UvArray>& uvs,
             const std::optional<PartArray>& parts, const std::optional<PointArray>& colors,
             const std::optional<TangentArray>& tangents) {
            TriangleMesh mesh;
            mesh.positions = copied<glm::vec3>(positions);
            mesh.triangles = copied<glm::uvec3>(triangles);
            if (normals) mesh.normals = copied<glm::vec3>(*normals);
            if (uvs) mesh.uvs = copied<glm::vec2>(*uvs);
            if (parts) mesh.parts = copied<std::uint16_t>(*parts);
            if (colors) mesh.colors = copied<glm::vec3>(*colors);
            if (tangents) mesh.tangents = copied<glm::vec4>(*tangents);
            validate(mesh);
            new (self) TriangleMesh(std::move(mesh));
          },
          nb::arg("positions"), nb::arg("triangles"), nb::arg("normals") = nb::none(),
          nb::arg("uvs") = nb::none(), nb::arg("parts") = nb::none(), nb::arg("colors") = nb::none(),
          nb::arg("tangents") = nb::none(),
          R"(Copies positions (V, 3), triangles (T, 3) of vertex indices, counter-clockwise seen from
outside, unit normals (V, 3) (default: flat shading), uvs (V, 2) with v up, the part of each triangle
(T,), colours (V, 3) in [0, 1], linear, that multiply the material's albedo, and tangents (V, 4) of normal
textures: the unit direction in which u grows and the sign of the bitangent, ±1, or zeros for none (default:
from the coordinates). Raises InvalidArgument for anything not finite, indices out of range or a mesh without
area.)")
      .def_prop_ro(
          "positions", [](nb::handle self) { return vectors_view(mesh_of(self).positions, self); },
          "Vertices, (V, 3), a read-only view.")
      .def_prop_ro(
          "normals", [](nb::handle self) { return vectors_view(mesh_of(self).normals, self); },
          "Unit vertex normals, (V, 3), or (0, 3) for flat shading.")
      .def_prop_ro(
          "uvs", [](nb::handle self) { return vectors_view(mesh_of(self).uvs, self); },
          "Texture coordinates, (V, 2), v up, or (0, 2).")
      .def_prop_ro(
          "triangles", [](nb::handle self) { return vectors_view(mesh_of(self).triangles, self); },
          "Vertex indices, (T, 3).")
      .def_prop_ro(
          "parts", [](nb::handle self) { return scalars_view(mesh_of(self).parts, self); },
          "Part of each triangle, (T,), or (0,) if all belong to part 0.")
      .def_prop_ro(
          "colors", [](nb::handle self) { return vectors_view(mesh_of(self).colors, self); },
          "Colours of the vertices, (V, 3), linear, or (0, 3) if they have none.")
      .def_prop_ro(
          "tangents", [](nb::handle self) { return vectors_view(mesh_of(self).tangents, self); },
          "Tangents of normal textures, (V, 4): direction of u and sign of the bitangent; or (0, 4).")
      .def("__getstate__",
           [](const TriangleMesh& mesh) {
             return nb::make_tuple(
                 vectors_to_numpy(std::vector(mesh.positions)), vectors_to_numpy(std::vector(mesh.triangles)),
                 vectors_to_numpy(std::vector(mesh.normals)), vectors_to_numpy(std::vector(mesh.uvs)),
                 to_numpy(std::vector(mesh.parts), {mesh.parts.size()}),
                 vectors_to_numpy(std::vector(mesh.colors)), vectors_to_numpy(std::vector(mesh.tangents)));
           })
      .def("__setstate__",
           [](TriangleMesh& self, const std::tuple<PointArray, TriangleArray, PointArray, UvArray, PartArray,
                                                   PointArray, TangentArray>& state) {
             const auto& [positions, triangles, normals, uvs, parts, colors, tangents] = state;
             TriangleMesh mesh;
             mesh.positions = copied<glm::vec3>(positions);
             mesh.triangles = copied<glm::uvec3>(triangles);
             mesh.normals = copied<glm::vec3>(normals);
             mesh.uvs = copied<glm::vec2>(uvs);
             mesh.parts = copied<std::uint16_t>(parts);
             mesh.colors = copied<glm::vec3>(colors);
             mesh.tangents = copied<glm::vec4>(tangents);
             validate(mesh);
             new (&self) TriangleMesh(std::move(mesh));
           })
      .def("__repr__", [](const TriangleMesh& mesh) {
        return "TriangleMesh(" + std::to_string(mesh.positions.size()) + " vertices, " +
               std::to_string(mesh.triangles.size()) + " triangles)";
      });

  m.def(
      "bounds",
      [](const TriangleMesh& mesh) {
        const Bounds box = bounds(mesh);
        return std::pair(box.min, box.max);
      },
      nb::arg("mesh"), "Smallest and largest coordinates of a mesh's vertices.");
}

void bind_shapes(nb::module_& m) {
  using Released = nb::call_guard<nb::gil_scoped_release>;
  m.def("make_teapot", &make_teapot, nb::arg("subdivisions") = 25, nb::arg("height") = 0.15F, Released(),
        R"(The Utah teapot of 32 Bezier patches, `subdivisions`² × 2 triangles each (1 to 512; 25 gives
the 40,000 of [PEM] §6), `height` metres high, standing on y = 0 with the spout along +X. Parts: 0 body,
1 lid.)");
  m.def("teapot_part_names", &teapot_part_names, "Names of the teapot's parts, in order.");
  m.def("make_box", &make_box, nb::arg("min"), nb::arg("max"), Released(),
        "Box with axis-aligned sides, each with texture coordinates 0 to 1.");
  m.def("make_sphere", &make_sphere, nb::arg("centre"), nb::arg("radius"), nb::arg("segments") = 48,
        Released(), "Latitude-longitude sphere with `segments` (3 to 4096) around the equator.");
  m.def("make_cylinder", &make_cylinder, nb::arg("base"), nb::arg("radius"), nb::arg("height"),
        nb::arg("segments") = 48, Released(),
        "Upright closed cylinder; `base` is the centre of its lower cap.");
  m.def("make_cone", &make_cone, nb::arg("base"), nb::arg("radius"), nb::arg("height"),
        nb::arg("segments") = 48, Released(), "Upright closed cone; `base` is the centre of its base.");
  m.def("make_torus", &make_torus, nb::arg("centre"), nb::arg("ring_radius"), nb::arg("tube_radius"),
        nb::arg("segments") = 48, Released(), "Torus about the vertical axis through `centre`.");
  m.def("make_rectangle", &make_rectangle, nb::arg("corner"), nb::arg("u"), nb::arg("v"), Released(),
        "Rectangle corner, corner + u, corner + u + v, corner + v, facing u × v.");
  m.def(
      "load_mesh",
      [](const PathText& path, std::array<double, 3> origin) {
        return load_mesh(path.text, {}, {origin[0], origin[1], origin[2]});
      },
      nb::arg("path"), nb::kw_only(), nb::arg("origin") = std::array{0.0, 0.0, 0.0}, Released(),
      R"(Every triangle of an .obj, .gltf or .glb file as one mesh of one part, with node transforms
applied (instances become copies) and missing vertex normals made by angle-weighted averaging. `origin`:
as of load_scene. Raises FileError if the file is missing, corrupt, empty or refers to files outside its
directory.)");
}

void bind_winding(nb::module_& m) {
  m.def(
      "winding_number",
      [](const TriangleMesh& mesh, std::array<double, 3> point) {
        return winding_number(mesh, {point[0], point[1], point[2]});
      },
      nb::arg("mesh"), nb::arg("point"),
      R"(How often a mesh winds about a point: 1 inside of a closed mesh, 0 outside, else between (van
Oosterom and Strackee 1983). Exactly 0 outside of the bounding box.)");
  m.def(
      "encloses",
      [](const TriangleMesh& mesh, std::array<double, 3> point) {
        return encloses(mesh, {point[0], point[1], point[2]});
      },
      nb::arg("mesh"), nb::arg("point"),
      "Whether a point, such as an eye, lies inside of a body: whether it winds about it more than half.");
}

}  // namespace

void bind_mesh(nb::module_& m) {
  bind_triangle_mesh(m);
  bind_shapes(m);
  bind_winding(m);
}

}  // namespace mirrorbake::bindings
