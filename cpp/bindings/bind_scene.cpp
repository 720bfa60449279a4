#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bind.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/load.hpp"
#include "mirrorbake/scene/room.hpp"
#include "mirrorbake/scene/scene.hpp"
#include "mirrorbake/scene/shapes.hpp"

namespace mirrorbake::bindings {
namespace {

using TriangleArray = nb::ndarray<const std::uint32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using UvArray = nb::ndarray<const float, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using PartArray = nb::ndarray<const std::uint16_t, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using RgbImage = nb::ndarray<const float, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;

template <typename Element, typename Array>
std::vector<Element> copied(const Array& array) {
  std::vector<Element> elements(array.shape(0));
  if (!elements.empty()) std::memcpy(elements.data(), array.data(), elements.size() * sizeof(Element));
  return elements;
}

Image rgb_image(const RgbImage& pixels) {
  Image image;
  image.width = static_cast<int>(pixels.shape(1));
  image.height = static_cast<int>(pixels.shape(0));
  image.channels = {"R", "G", "B"};
  image.pixels.assign(pixels.data(), pixels.data() + pixels.size());
  return image;
}

template <typename Element>
const Element& element(const std::vector<Element>& elements, const char* argument, int index) {
  if (index < 0 || static_cast<std::size_t>(index) >= elements.size()) {
    throw InvalidArgument(argument, std::to_string(index),
                          "0 to " + std::to_string(elements.size()) + " (exclusive)");
  }
  return elements[static_cast<std::size_t>(index)];
}

template <typename Named>
std::vector<std::string> names(const std::vector<Named>& elements) {
  std::vector<std::string> result;
  for (const Named& e : elements) result.push_back(e.name);
  return result;
}

const TriangleMesh& mesh_of(nb::handle self) { return nb::cast<const TriangleMesh&>(self); }

void bind_mesh(nb::module_& m) {
  nb::class_<TriangleMesh>(
      m, "TriangleMesh",
      "Triangles with optional vertex normals, texture coordinates and parts. World space, metres.")
      .def(
          "__init__",
          [](TriangleMesh* self, const PointArray& positions, const TriangleArray& triangles,
             const std::optional<PointArray>& normals, const std::optional<UvArray>& uvs,
             const std::optional<PartArray>& parts) {
            TriangleMesh mesh;
            mesh.positions = copied<glm::vec3>(positions);
            mesh.triangles = copied<glm::uvec3>(triangles);
            if (normals) mesh.normals = copied<glm::vec3>(*normals);
            if (uvs) mesh.uvs = copied<glm::vec2>(*uvs);
            if (parts) mesh.parts = copied<std::uint16_t>(*parts);
            validate(mesh);
            new (self) TriangleMesh(std::move(mesh));
          },
          nb::arg("positions"), nb::arg("triangles"), nb::arg("normals") = nb::none(),
          nb::arg("uvs") = nb::none(), nb::arg("parts") = nb::none(),
          "Copies positions (V, 3), triangles (T, 3) of vertex indices, counter-clockwise seen from outside, "
          "unit\n"
          "normals (V, 3) (default: flat shading), uvs (V, 2) with v up, and the part of each triangle (T,). "
          "Raises\n"
          "InvalidArgument for anything not finite, indices out of range or a mesh without area.")
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
        "The Utah teapot of 32 Bezier patches, `subdivisions`² × 2 triangles each (1 to 512; 25 gives the "
        "40,000 of\n"
        "[PEM] §6), `height` metres high, standing on y = 0 with the spout along +X. Parts: 0 body, 1 lid.");
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
      "load_mesh", [](const std::string& path) { return load_mesh(path); }, nb::arg("path"), Released(),
      "Every triangle of an .obj, .gltf or .glb file as one mesh of one part, with node transforms applied "
      "(instances\n"
      "become copies) and missing vertex normals made by angle-weighted averaging. Raises FileError if the "
      "file is\n"
      "missing, corrupt, empty or refers to files outside its directory.");
}

void bind_material(nb::module_& m) {
  nb::enum_<FresnelModel>(m, "FresnelModel", "How the reflectance of a mirror depends on the angle.")
      .value("constant", FresnelModel::constant, "r0 at every angle")
      .value("schlick", FresnelModel::schlick, "Schlick's approximation from r0")
      .value("dielectric", FresnelModel::dielectric, "unpolarised, relative index eta")
      .value("conductor", FresnelModel::conductor, "unpolarised, complex index eta + i k");
  nb::class_<Fresnel>(m, "Fresnel", "Reflectance per colour channel as a function of the angle.")
      .def(
          "__init__",
          [](Fresnel* self, FresnelModel model, glm::vec3 r0, glm::vec3 eta, glm::vec3 k) {
            new (self) Fresnel{model, r0, eta, k};
          },
          nb::arg("model") = FresnelModel::constant, nb::arg("r0") = glm::vec3(0.0F),
          nb::arg("eta") = glm::vec3(1.5F), nb::arg("k") = glm::vec3(0.0F))
      .def_rw("model", &Fresnel::model)
      .def_rw("r0", &Fresnel::r0,
              "constant: reflectance; schlick: reflectance at normal incidence; in [0, 1]")
      .def_rw("eta", &Fresnel::eta, "dielectric, conductor: real part of the relative index, above 0")
      .def_rw("k", &Fresnel::k, "conductor: extinction coefficient, at least 0");

  nb::enum_<LayerModel>(m, "LayerModel", "How diffuse light L_d and mirrored light L_m add up.")
      .value("additive", LayerModel::additive, "F L_m + L_d")
      .value("coated", LayerModel::coated, "F L_m + (1 − F) L_d");
  nb::class_<Material>(m, "Material", "What a surface does with light.")
      .def(
          "__init__",
          [](Material* self, std::string name, glm::vec3 albedo, int albedo_texture, bool specular,
             const Fresnel& fresnel, LayerModel layers, glm::vec3 emission) {
            new (self) Material{std::move(name), albedo, albedo_texture, specular, fresnel, layers, emission};
          },
          nb::kw_only(), nb::arg("name") = "", nb::arg("albedo") = glm::vec3(0.5F),
          nb::arg("albedo_texture") = -1, nb::arg("specular") = false, nb::arg("fresnel") = Fresnel{},
          nb::arg("layers") = LayerModel::additive, nb::arg("emission") = glm::vec3(0.0F))
      .def_rw("name", &Material::name)
      .def_rw("albedo", &Material::albedo, "Lambertian reflectance per channel, in [0, 1]")
      .def_rw("albedo_texture", &Material::albedo_texture, "index of a texture of the scene, or −1")
      .def_rw("specular", &Material::specular, "whether it mirrors, weighted by `fresnel`")
      .def_rw("fresnel", &Material::fresnel)
      .def_rw("layers", &Material::layers)
      .def_rw("emission", &Material::emission, "radiance emitted on the front side, W sr⁻¹ m⁻²");
}

}  // namespace

void bind_scene(nb::module_& m) {
  bind_mesh(m);
  bind_shapes(m);
  bind_material(m);

  nb::class_<Scene>(
      m, "Scene",
      "Objects, materials, textures and lights. World space is right-handed, +Y up, in metres; colours and\n"
      "radiance are scene-linear with Rec.709 primaries. The add_ functions return the new thing's index.")
      .def(nb::init<>())
      .def(
          "add_texture",
          [](Scene& scene, const RgbImage& pixels) {
            scene.textures.push_back(rgb_image(pixels));
            return static_cast<int>(scene.textures.size()) - 1;
          },
          nb::arg("pixels"),
          "Add a repeating texture of shape (height, width, 3), values in [0, 1], row 0 at the top.")
      .def(
          "add_material",
          [](Scene& scene, const Material& material) {
            scene.materials.push_back(material);
            return static_cast<int>(scene.materials.size()) - 1;
          },
          nb::arg("material"), "Add a copy of a material.")
      .def(
          "add_object",
          [](Scene& scene, std::string name, const TriangleMesh& mesh, int material,
             std::vector<std::string> part_names) {
            element(scene.materials, "material", material);
            scene.objects.push_back({std::move(name), mesh, material, std::move(part_names)});
            return static_cast<int>(scene.objects.size()) - 1;
          },
          nb::arg("name"), nb::arg("mesh"), nb::arg("material"),
          nb::arg("part_names") = std::vector<std::string>{},
          "Add a copy of a mesh, in world space, with the material of that index. `part_names` names its "
          "parts, if it\n"
          "has more than one.")
      .def(
          "add_rectangle_light",
          [](Scene& scene, glm::vec3 corner, glm::vec3 edge_u, glm::vec3 edge_v, glm::vec3 radiance) {
            scene.rectangle_lights.push_back({corner, edge_u, edge_v, radiance});
            return static_cast<int>(scene.rectangle_lights.size()) - 1;
          },
          nb::arg("corner"), nb::arg("edge_u"), nb::arg("edge_v"), nb::arg("radiance"),
          "Add a rectangle that emits `radiance` (W sr⁻¹ m⁻²) along edge_u × edge_v.")
      .def(
          "add_point_light",
          [](Scene& scene, glm::vec3 position, glm::vec3 intensity) {
            scene.point_lights.push_back({position, intensity});
            return static_cast<int>(scene.point_lights.size()) - 1;
          },
          nb::arg("position"), nb::arg("intensity"), "Add a light of `intensity` W sr⁻¹ in every direction.")
      .def(
          "set_environment",
          [](Scene& scene, const RgbImage& panorama, float scale, float rotation_degrees) {
            scene.environment = EnvironmentLight{rgb_image(panorama), scale, rotation_degrees};
          },
          nb::arg("panorama"), nb::arg("scale") = 1.0F, nb::arg("rotation_degrees") = 0.0F,
          "Surround the scene with a latitude-longitude panorama of radiance, shape (height, width, 3): its "
          "centre looks\n"
          "along −Z, +X is to the right of the centre, +Y is the top row. It is multiplied with `scale` and "
          "turned\n"
          "counter-clockwise about +Y, seen from above.")
      .def_prop_ro("object_names", [](const Scene& scene) { return names(scene.objects); })
      .def_prop_ro("material_names", [](const Scene& scene) { return names(scene.materials); })
      .def(
          "object_mesh",
          [](const Scene& scene, int object) { return element(scene.objects, "object", object).mesh; },
          nb::arg("object"), "Copy of an object's mesh.")
      .def(
          "object_material",
          [](const Scene& scene, int object) { return element(scene.objects, "object", object).material; },
          nb::arg("object"), "Index of an object's material.")
      .def(
          "object_part_names",
          [](const Scene& scene, int object) {
            const Object& o = element(scene.objects, "object", object);
            return o.part_names.empty() ? std::vector<std::string>{o.name} : o.part_names;
          },
          nb::arg("object"), "Names of an object's parts; its own if it has only one.")
      .def(
          "material",
          [](const Scene& scene, int material) { return element(scene.materials, "material", material); },
          nb::arg("material"), "Copy of a material.")
      .def(
          "set_material",
          [](Scene& scene, int index, const Material& material) {
            element(scene.materials, "index", index);
            scene.materials[static_cast<std::size_t>(index)] = material;
          },
          nb::arg("index"), nb::arg("material"), "Replace a material.")
      .def(
          "bounds",
          [](const Scene& scene, int object) {
            const Bounds box = bounds(element(scene.objects, "object", object).mesh);
            return std::pair(box.min, box.max);
          },
          nb::arg("object"), "Smallest and largest coordinates of an object's vertices.")
      .def(
          "validate", [](const Scene& scene) { validate(scene); },
          "Raise InvalidArgument, naming the object and the field, if anything in the scene is unusable.");

  m.def("make_room", &make_room, nb::call_guard<nb::gil_scoped_release>(),
        "The built-in furnished room. The table's top is the plane y = 0 with its centre at the origin; the "
        "reflector,\n"
        "which is not part of it, stands there.");
}

}  // namespace mirrorbake::bindings
