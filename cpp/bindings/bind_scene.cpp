#include <nanobind/stl/array.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bind.hpp"
#include "bind_enums.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/scene/load.hpp"
#include "mirrorbake/scene/room.hpp"
#include "mirrorbake/scene/scene.hpp"

namespace mirrorbake::bindings {
namespace {

using RgbImage = nb::ndarray<const float, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;

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

// Returns the new element's index.
template <typename Element>
int append(std::vector<Element>& elements, Element element) {
  elements.push_back(std::move(element));
  return static_cast<int>(elements.size()) - 1;
}

template <typename Named>
std::vector<std::string> names(const std::vector<Named>& elements) {
  std::vector<std::string> result;
  for (const Named& e : elements) result.push_back(e.name);
  return result;
}

void bind_visibility(nb::module_& m) {
  nb::enum_<Visibility>(m, "Visibility", nb::is_flag(), "A set of the kinds of rays that see an object.")
      .value("none", Visibility::none)
      .value("camera", Visibility::camera, "rays from the eye, and those of a capture")
      .value("reflection", Visibility::reflection, "rays that leave a surface, specular or diffuse")
      .value("shadow", Visibility::shadow, "rays towards a light")
      .value("all", Visibility::all);
}

std::string in_words(const Scene& scene) {
  const std::size_t lights = scene.rectangle_lights.size() + scene.sphere_lights.size() +
                             scene.point_lights.size() + scene.directional_lights.size() +
                             scene.spot_lights.size();
  return "objects=" + std::to_string(scene.objects.size()) +
         ", materials=" + std::to_string(scene.materials.size()) + ", lights=" + std::to_string(lights) +
         ", environment=" + (scene.environment ? "True" : "False");
}

void bind_loaded_scene(nb::module_& m) {
  nb::class_<SceneCamera>(m, "SceneCamera", "A viewpoint that a scene file proposes.")
      .def_ro("name", &SceneCamera::name)
      .def_ro("eye", &SceneCamera::eye)
      .def_ro("direction", &SceneCamera::direction, "unit vector along the view")
      .def_ro("up", &SceneCamera::up, "unit vector, upright to `direction`")
      .def_ro("vertical_fov_degrees", &SceneCamera::vertical_fov_degrees)
      .def("__repr__", [](const SceneCamera& camera) { return "SceneCamera('" + camera.name + "')"; });
  nb::class_<SceneWarning>(m, "SceneWarning", "Something in a file that the scene does not show.")
      .def_ro("message", &SceneWarning::message)
      .def_ro("count", &SceneWarning::count, "how often it occurs")
      .def("__repr__", [](const SceneWarning& w) {
        return "SceneWarning('" + w.message + "', count=" + std::to_string(w.count) + ")";
      });
  nb::class_<LoadedScene>(m, "LoadedScene", "What a scene file holds.")
      .def_ro("scene", &LoadedScene::scene)
      .def_prop_ro("cameras", [](const LoadedScene& loaded) { return loaded.cameras; })
      .def_prop_ro("warnings", [](const LoadedScene& loaded) { return loaded.warnings; })
      .def("__repr__", [](const LoadedScene& loaded) {
        return "LoadedScene(" + in_words(loaded.scene) +
               ", cameras=" + std::to_string(loaded.cameras.size()) +
               ", warnings=" + std::to_string(loaded.warnings.size()) + ")";
      });
  m.def(
      "load_scene",
      [](const PathText& path, int max_texture_side, std::uint64_t max_texture_bytes,
         std::uint64_t cache_textures_above, std::uint64_t max_vertices, std::uint64_t max_triangles,
         float luminous_efficacy, std::array<double, 3> origin) {
        return load_scene(path.text, {{max_vertices, max_triangles},
                                      max_texture_side,
                                      max_texture_bytes,
                                      cache_textures_above,
                                      luminous_efficacy,
                                      {origin[0], origin[1], origin[2]}});
      },
      nb::arg("path"), nb::kw_only(), nb::arg("max_texture_side") = SceneOptions{}.max_texture_side,
      nb::arg("max_texture_bytes") = SceneOptions{}.max_texture_bytes,
      nb::arg("cache_textures_above") = SceneOptions{}.cache_textures_above,
      nb::arg("max_vertices") = MeshLimits{}.max_vertices,
      nb::arg("max_triangles") = MeshLimits{}.max_triangles, nb::arg("luminous_efficacy") = 1.0F,
      nb::arg("origin") = std::array{0.0, 0.0, 0.0}, nb::call_guard<nb::gil_scoped_release>(),
      R"(Read a scene from an .obj (with its .mtl), .gltf or .glb file: one object per node and material,
materials, textures, lights and cameras. Image files larger than `cache_textures_above` bytes in memory
are read through the cache of texture files. glTF's candela, lux and nits are divided by
`luminous_efficacy` (lumens per watt). The place `origin` of the file's world becomes the scene's zero,
before positions are rounded to float32. Raises FileError if a file is missing, corrupt, beyond a limit
or refers to files outside its directory.)");
  m.def(
      "referenced_files",
      [](const PathText& path, FileContent content) { return referenced_files(path.text, content); },
      nb::arg("path"), nb::arg("content"), nb::call_guard<nb::gil_scoped_release>(),
      R"(The files beside `path` that load_mesh or load_scene would read: the external buffers of a glTF
file and, for a scene, its images, or the material libraries of an OBJ file and their images. Absolute,
each once, not those that do not exist. Raises FileError if `path` or a library is missing or corrupt.)");
}

void bind_textures(nb::class_<Scene>& scene_type) {
  scene_type
      .def(
          "texture_wrap",
          [](const Scene& scene, int texture) {
            const Texture& chosen = element(scene.textures, "texture", texture);
            return std::pair(chosen.wrap_u, chosen.wrap_v);
          },
          nb::arg("texture"), "How coordinates outside [0,1] find texels, along u and v.")
      .def(
          "add_material",
          [](Scene& scene, const Material& material) { return append(scene.materials, material); },
          nb::arg("material"), "Add a copy of a material.")
      .def(
          "add_object",
          [](Scene& scene, std::string name, const TriangleMesh& mesh, int material,
             std::vector<std::string> part_names, Visibility visibility, std::vector<int> part_materials) {
            element(scene.materials, "material", material);
            for (const int index : part_materials) element(scene.materials, "part_materials", index);
            return append(scene.objects, Object{std::move(name), mesh, material, std::move(part_names),
                                                visibility, std::move(part_materials)});
          },
          nb::arg("name"), nb::arg("mesh"), nb::arg("material"),
          nb::arg("part_names") = std::vector<std::string>{}, nb::arg("visibility") = Visibility::all,
          nb::arg("part_materials") = std::vector<int>{},
          R"(Add a copy of a mesh, in world space, with the material of that index. `part_names` names
its parts, if it has more than one; `part_materials` gives each a material of its own.)")
      .def(
          "add_rectangle_light",
          [](Scene& scene, glm::vec3 corner, glm::vec3 edge_u, glm::vec3 edge_v, glm::vec3 radiance) {
            return append(scene.rectangle_lights, RectangleLight{corner, edge_u, edge_v, radiance});
          },
          nb::arg("corner"), nb::arg("edge_u"), nb::arg("edge_v"), nb::arg("radiance"),
          "Add a rectangle that emits `radiance` (W sr⁻¹ m⁻²) along edge_u × edge_v.")
      .def(
          "add_point_light",
          [](Scene& scene, glm::vec3 position, glm::vec3 intensity) {
            return append(scene.point_lights, PointLight{position, intensity});
          },
          nb::arg("position"), nb::arg("intensity"), "Add a light of `intensity` W sr⁻¹ in every direction.")
      .def(
          "add_sphere_light",
          [](Scene& scene, glm::vec3 centre, float radius, glm::vec3 radiance) {
            return append(scene.sphere_lights, SphereLight{centre, radius, radiance});
          },
          nb::arg("centre"), nb::arg("radius"), nb::arg("radiance"),
          "Add a sphere that emits `radiance` (W sr⁻¹ m⁻²) outwards.");
}

void bind_lights(nb::class_<Scene>& scene_type) {
  scene_type
      .def(
          "add_directional_light",
          [](Scene& scene, glm::vec3 direction, glm::vec3 irradiance) {
            return append(scene.directional_lights, DirectionalLight{direction, irradiance});
          },
          nb::arg("direction"), nb::arg("irradiance"),
          R"(Add parallel light that travels along the unit vector `direction` and gives a surface that
faces it `irradiance` W m⁻².)")
      .def(
          "add_spot_light",
          [](Scene& scene, glm::vec3 position, glm::vec3 direction, glm::vec3 intensity, float inner_degrees,
             float outer_degrees) {
            return append(scene.spot_lights,
                          SpotLight{position, direction, intensity, inner_degrees, outer_degrees});
          },
          nb::arg("position"), nb::arg("direction"), nb::arg("intensity"), nb::arg("inner_degrees") = 0.0F,
          nb::arg("outer_degrees") = 45.0F,
          R"(Add a light of `intensity` W sr⁻¹ along the unit vector `direction`: in full up to
`inner_degrees` from that axis, falling to 0 at `outer_degrees` (at most 90).)")
      .def(
          "set_environment",
          [](Scene& scene, const RgbImage& panorama, float scale, float rotation_degrees) {
            scene.environment = EnvironmentLight{rgb_image(panorama), scale, rotation_degrees};
          },
          nb::arg("panorama"), nb::arg("scale") = 1.0F, nb::arg("rotation_degrees") = 0.0F,
          R"(Surround the scene with a latitude-longitude panorama of radiance, shape (height, width, 3):
its centre looks along −Z, +X is to the right of the centre, +Y is the top row. It is multiplied with
`scale` and turned counter-clockwise about +Y, seen from above.)")
      .def(
          "add_materials", [](Scene& scene, const Scene& other) { return add_materials(scene, other); },
          nb::arg("other"),
          "Add copies of another scene's textures and materials; returns the index of the first material.")
      .def(
          "join_objects",
          [](const Scene& scene, std::size_t most_parts) {
            Object joined = join_objects(scene, "joined", most_parts);
            return std::tuple(std::move(joined.mesh), std::move(joined.part_names),
                              std::move(joined.part_materials));
          },
          nb::arg("most_parts"),
          R"(All objects in one mesh: (mesh, part names, index of each part's material). A part is an
object, or, if there are more than `most_parts`, what is of one material.)");
}

void bind_contents(nb::class_<Scene>& scene_type) {
  scene_type.def_prop_ro("object_names", [](const Scene& scene) { return names(scene.objects); })
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
          "object_part_materials",
          [](const Scene& scene, int object) {
            const Object& o = element(scene.objects, "object", object);
            if (!o.part_materials.empty()) return o.part_materials;
            return std::vector<int>(std::max<std::size_t>(1, o.part_names.size()), o.material);
          },
          nb::arg("object"), "Index of the material of each part of an object.")
      .def(
          "set_object_material",
          [](Scene& scene, int object, int material) {
            element(scene.objects, "object", object);
            element(scene.materials, "material", material);
            scene.objects[static_cast<std::size_t>(object)].material = material;
            scene.objects[static_cast<std::size_t>(object)].part_materials.clear();
          },
          nb::arg("object"), nb::arg("material"),
          "Give an object, all its parts, the material of that index.")
      .def(
          "object_part_names",
          [](const Scene& scene, int object) {
            const Object& o = element(scene.objects, "object", object);
            return o.part_names.empty() ? std::vector<std::string>{o.name} : o.part_names;
          },
          nb::arg("object"), "Names of an object's parts; its own if it has only one.")
      .def(
          "object_visibility",
          [](const Scene& scene, int object) { return element(scene.objects, "object", object).visibility; },
          nb::arg("object"), "The kinds of rays that see an object.")
      .def(
          "set_object_visibility",
          [](Scene& scene, int object, Visibility visibility) {
            element(scene.objects, "object", object);
            scene.objects[static_cast<std::size_t>(object)].visibility = visibility;
          },
          nb::arg("object"), nb::arg("visibility"), "Choose the kinds of rays that see an object.")
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
}

void bind_scene_class(nb::module_& m) {
  nb::class_<Scene> scene_type(
      m, "Scene",
      R"(Objects, materials, textures and lights. World space is right-handed, +Y up, in metres; colours
and radiance are scene-linear with Rec.709 primaries. The add_ functions return the new thing's index.)");
  scene_type.def(nb::init<>())
      .def("__repr__", [](const Scene& scene) { return "Scene(" + in_words(scene) + ")"; })
      .def(
          "translate",
          [](Scene& scene, std::array<double, 3> by) {
            translate(scene, {by[0], by[1], by[2]});
          },
          nb::arg("by"), "Move everything that has a place: objects, and lights that are not at infinity.")
      .def(
          "add_texture",
          [](Scene& scene, const RgbImage& pixels, TextureWrap wrap_u, TextureWrap wrap_v) {
            return append(scene.textures, Texture{rgb_image(pixels), wrap_u, wrap_v});
          },
          nb::arg("pixels"), nb::arg("wrap_u") = TextureWrap::repeat, nb::arg("wrap_v") = TextureWrap::repeat,
          "Add a texture of shape (height, width, 3), values in [0, 1], row 0 at the top.")
      .def(
          "add_texture_file",
          [](Scene& scene, const PathText& path, TextureWrap wrap_u, TextureWrap wrap_v, Transfer transfer) {
            Texture texture;
            texture.wrap_u = wrap_u;
            texture.wrap_v = wrap_v;
            {
              nb::gil_scoped_release released;
              texture.file = std::make_shared<TextureFile>(path.text, transfer);
            }
            return append(scene.textures, std::move(texture));
          },
          nb::arg("path"), nb::arg("wrap_u") = TextureWrap::repeat, nb::arg("wrap_v") = TextureWrap::repeat,
          nb::arg("transfer") = Transfer::automatic,
          R"(Add a texture whose texels are read from an image file when they are needed, and kept in a
cache of bounded size. Raises FileError if the file is missing, damaged or has values outside [0, 1].)")
      .def(
          "texture_pixels",
          [](const Scene& scene, int texture) {
            const Texture& chosen = element(scene.textures, "texture", texture);
            Image image;
            {
              nb::gil_scoped_release released;
              image = texture_image(chosen);
            }
            const auto [width, height] = std::pair<std::size_t, std::size_t>(image.width, image.height);
            return to_numpy(std::move(image.pixels), {height, width, image.channels.size()});
          },
          nb::arg("texture"),
          R"(Copy of a texture's texels, (height, width, 3), or (height, width, 1) for one channel that
stands for all three; scene-linear, row 0 at the top. Raises FileError if its file has changed.)");
  bind_textures(scene_type);
  bind_lights(scene_type);
  bind_contents(scene_type);
}

}  // namespace

void bind_scene(nb::module_& m) {
  bind_visibility(m);
  bind_scene_class(m);
  bind_loaded_scene(m);
  m.def("make_room", &make_room, nb::call_guard<nb::gil_scoped_release>(),
        R"(The built-in furnished room. The table's top is the plane y = 0 with its centre at the origin;
the reflector, which is not part of it, stands there.)");
}

}  // namespace mirrorbake::bindings
