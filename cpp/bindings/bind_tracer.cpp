#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bind.hpp"
#include "bind_enums.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/tracer/tracer.hpp"
#include "signature.hpp"

namespace mirrorbake::bindings {
namespace {

auto image_to_numpy(Image&& image) {
  return to_numpy(std::move(image.pixels), {static_cast<std::size_t>(image.height),
                                            static_cast<std::size_t>(image.width), image.channels.size()});
}

using IntList = nb::ndarray<const std::int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using FloatList = nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

void bind_tracing(nb::class_<Tracer>& tracer_type) {
  tracer_type
      .def(
          "trace_layers",
          [](const Tracer& tracer, const Camera& camera, const std::vector<int>& reflectors,
             const TraceOptions& options) { return tracer.trace_layers(camera, reflectors, options); },
          nb::arg("camera"), nb::arg("reflectors"), nb::arg("options") = TraceOptions{},
          nb::call_guard<nb::gil_scoped_release>(),
          signature<R"(def trace_layers(self, camera: Camera, reflectors: collections.abc.Sequence[int],
options: TraceOptions = ...) -> list[LayerTrace])">(),
          R"(Layers of several reflectors, which share the rays from the eye: one LayerTrace each, as
trace_layers gives.)")
      .def(
          "trace_visibility",
          [](const Tracer& tracer, const Camera& camera, int reflector, const TraceOptions& options,
             const std::vector<glm::vec2>& places) {
            const nb::gil_scoped_release released;
            return tracer.trace_visibility(camera, reflector, options, places);
          },
          nb::arg("camera"), nb::arg("reflector"), nb::arg("options") = TraceOptions{},
          nb::arg("places") = std::vector<glm::vec2>{},
          signature<R"(def trace_visibility(self, camera: Camera, reflector: int,
options: TraceOptions = ..., places: collections.abc.Sequence[collections.abc.Sequence[float]] = ()) ->
SurfaceSamples)">(),
          R"(Only the geometry of `reflector`, by the same camera rays as trace_layers with the same
options. With `places` (x, y in [0, 1) from the pixel's top left corner) the rays go through those places
of every pixel instead, as a renderer's lookups do (RunTimeModel.places).)")
      .def(
          "capture",
          [](const Tracer& tracer, glm::vec3 origin, const std::string& projection, int width, int height,
             const std::vector<int>& hidden, const TraceOptions& options) {
            const Projection p = parse_projection(projection);
            Image image;
            {
              nb::gil_scoped_release released;
              image = tracer.capture(origin, p, width, height, hidden, options);
            }
            const auto faces = static_cast<std::size_t>(face_count(p));
            const auto rows = static_cast<std::size_t>(height);
            const auto columns = static_cast<std::size_t>(width);
            return faces > 1 ? to_numpy(std::move(image.pixels), {faces, rows, columns, 3})
                             : to_numpy(std::move(image.pixels), {rows, columns, 3});
          },
          nb::arg("origin"), nb::arg("projection"), nb::arg("width"), nb::arg("height"),
          nb::arg("hidden") = std::vector<int>{}, nb::arg("options") = TraceOptions{},
          signature<R"(def capture(self, origin: collections.abc.Sequence[float], projection: str,
width: int, height: int, hidden: collections.abc.Sequence[int] = ..., options: TraceOptions = ...) ->
NDArray[numpy.float32])">(),
          R"(The radiance that arrives at `origin` in any projection, (faces, height, width, 3) or, of
one face, (height, width, 3): what EnvMap.from_array takes. The rays go straight through the texels of
the projection and pass through the objects in `hidden`, whose shadows and reflections on other things
remain.)")
      .def(
          "capture_cube",
          [](const Tracer& tracer, glm::vec3 origin, int size, const std::vector<int>& hidden,
             const TraceOptions& options) {
            Image image;
            {
              nb::gil_scoped_release released;
              image = tracer.capture_cube(origin, size, hidden, options);
            }
            const auto side = static_cast<std::size_t>(size);
            return to_numpy(std::move(image.pixels), {6, side, side, 3});
          },
          nb::arg("origin"), nb::arg("size"), nb::arg("hidden") = std::vector<int>{},
          nb::arg("options") = TraceOptions{},
          signature<R"(def capture_cube(self, origin: collections.abc.Sequence[float], size: int,
hidden: collections.abc.Sequence[int] = ..., options: TraceOptions = ...) -> NDArray[numpy.float32])">(),
          R"(Cube map (6, size, size, 3) of the radiance that arrives at `origin`, the rays passing
through the objects in `hidden`, whose shadows and reflections on other things remain.)");
}

void bind_gathering(nb::class_<Tracer>& tracer_type) {
  tracer_type
      .def(
          "intersect",
          [](const Tracer& tracer, PointArray origins, PointArray directions,
             const std::vector<int>& hidden) {
            std::vector<RayHit> hits;
            {
              nb::gil_scoped_release released;
              hits = tracer.intersect(points(origins), points(directions), hidden);
            }
            std::vector<float> distance;
            std::vector<std::int32_t> object;
            std::vector<glm::vec3> normal;
            for (const RayHit& hit : hits) {
              distance.push_back(hit.distance);
              object.push_back(hit.object);
              normal.push_back(hit.normal);
            }
            const std::size_t count = hits.size();
            return nb::make_tuple(to_numpy(std::move(distance), {count}),
                                  to_numpy(std::move(object), {count}), vectors_to_numpy(std::move(normal)));
          },
          nb::arg("origins"), nb::arg("directions"), nb::arg("hidden") = std::vector<int>{},
          signature<R"(def intersect(self, origins: NDArray[numpy.float32],
directions: NDArray[numpy.float32], hidden: collections.abc.Sequence[int] = ...) ->
tuple[NDArray[numpy.float32], NDArray[numpy.int32], NDArray[numpy.float32]])">(),
          R"(First hits of rays, arrays of shape (n, 3), through the objects in `hidden`. Returns the
distance in metres (n,), inf for a miss; the object (n,), -1 for a miss or a light; the geometric normal
(n, 3).)")
      .def(
          "intersect_distance",
          [](const Tracer& tracer, PointArray origins, PointArray directions,
             const std::vector<int>& hidden) {
            const std::size_t count = origins.shape(0);
            std::vector<float> distance(count);
            std::vector<std::int32_t> object(count);
            {
              nb::gil_scoped_release released;
              tracer.intersect(points(origins), points(directions), hidden, distance, object);
            }
            return nb::make_tuple(to_numpy(std::move(distance), {count}),
                                  to_numpy(std::move(object), {count}));
          },
          nb::arg("origins"), nb::arg("directions"), nb::arg("hidden") = std::vector<int>{},
          signature<R"(def intersect_distance(self, origins: NDArray[numpy.float32],
directions: NDArray[numpy.float32], hidden: collections.abc.Sequence[int] = ...) ->
tuple[NDArray[numpy.float32], NDArray[numpy.int32]])">(),
          "Distance and object of `intersect` alone, which is faster.")
      .def(
          "vertex_irradiance",
          [](const Tracer& tracer, int object, int rays, std::uint64_t seed, SurfaceSide side) {
            std::vector<glm::vec3> irradiance;
            {
              nb::gil_scoped_release released;
              irradiance = tracer.vertex_irradiance(object, rays, seed, side);
            }
            return vectors_to_numpy(std::move(irradiance));
          },
          nb::arg("object"), nb::arg("rays") = 256, nb::arg("seed") = 0, nb::arg("side") = SurfaceSide::front,
          signature<R"(def vertex_irradiance(self, object: int, rays: int = ..., seed: int = ...,
side: typing.Literal['front', 'back'] = ...) -> NDArray[numpy.float32])">(),
          "Irradiance on one side of an object at every vertex, (vertices, 3), all light included.")
      .def(
          "surface_irradiance",
          [](const Tracer& tracer, int object,
             nb::ndarray<const std::uint32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu> triangles,
             UvArray barycentric, int rays, std::uint64_t seed, SurfaceSide side) {
            std::vector<glm::vec3> irradiance;
            {
              nb::gil_scoped_release released;
              irradiance = tracer.surface_irradiance(object, {triangles.data(), triangles.shape(0)},
                                                     pairs(barycentric), rays, seed, side);
            }
            return vectors_to_numpy(std::move(irradiance));
          },
          nb::arg("object"), nb::arg("triangles"), nb::arg("barycentric"), nb::arg("rays") = 256,
          nb::arg("seed") = 0, nb::arg("side") = SurfaceSide::front,
          signature<R"(def surface_irradiance(self, object: int, triangles: NDArray[numpy.uint32],
barycentric: NDArray[numpy.float32], rays: int = ..., seed: int = ...,
side: typing.Literal['front', 'back'] = ...) -> NDArray[numpy.float32])">(),
          R"(The same at points of an object's surface, (n, 3): triangles (n,) and the weights (n, 2) of
their second and third vertex.)");
}

void bind_camera(nb::module_& m) {
  nb::class_<Camera> camera_type(m, "Camera", "A pinhole camera. Pixel (0,0) is the top left one.");
  camera_type
      .def(
          "__init__",
          [](Camera* self, glm::vec3 eye, glm::vec3 target, glm::vec3 up, float vertical_fov_degrees,
             int width, int height) {
            const Camera camera{eye, target, up, vertical_fov_degrees, width, height};
            validate(camera);
            new (self) Camera(camera);
          },
          nb::arg("eye"), nb::arg("target"), nb::arg("up") = glm::vec3(0.0F, 1.0F, 0.0F),
          nb::arg("vertical_fov_degrees") = Camera{}.vertical_fov_degrees, nb::arg("width") = Camera{}.width,
          nb::arg("height") = Camera{}.height)
      .def_rw("eye", &Camera::eye)
      .def_rw("target", &Camera::target)
      .def_rw("up", &Camera::up)
      .def_rw("vertical_fov_degrees", &Camera::vertical_fov_degrees, "In (0, 180).")
      .def_rw("width", &Camera::width, "Pixels, 1 to 16384.")
      .def_rw("height", &Camera::height, "Pixels, 1 to 16384.")
      .def(
          "__eq__", [](const Camera& a, const Camera& b) { return a == b; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__repr__", [](const Camera& c) {
        return "Camera(eye=" + text_of(c.eye) + ", target=" + text_of(c.target) + ", up=" + text_of(c.up) +
               ", vertical_fov_degrees=" + text_of(c.vertical_fov_degrees) +
               ", width=" + std::to_string(c.width) + ", height=" + std::to_string(c.height) + ")";
      });
  pickle(camera_type, {"eye", "target", "up", "vertical_fov_degrees", "width", "height"});
}

void bind_tracer_options(nb::module_& m) {
  nb::class_<TracerOptions> tracer_options(m, "TracerOptions", "What is decided once per scene.");
  tracer_options
      .def(
          "__init__",
          [](TracerOptions* self, IndirectLight indirect, int cache_rays, int cache_bounces,
             std::uint64_t seed, int focus) {
            new (self) TracerOptions{indirect, cache_rays, cache_bounces, seed, focus};
          },
          nb::kw_only(), nb::arg("indirect") = TracerOptions{}.indirect,
          nb::arg("cache_rays") = TracerOptions{}.cache_rays,
          nb::arg("cache_bounces") = TracerOptions{}.cache_bounces, nb::arg("seed") = TracerOptions{}.seed,
          nb::arg("focus") = TracerOptions{}.focus)
      .def_rw("indirect", &TracerOptions::indirect)
      .def_rw("cache_rays", &TracerOptions::cache_rays,
              "Gather rays per vertex, 1 to 65536; a quarter after the first bounce.")
      .def_rw("cache_bounces", &TracerOptions::cache_bounces, "Diffuse bounces of the cache, 1 to 16.")
      .def_rw("seed", &TracerOptions::seed, "Of the cache.")
      .def_rw("focus", &TracerOptions::focus,
              "Object number. It mirrors what is close to it, so the cache is finer there; below 0: none.");
  record(tracer_options, {"indirect", "cache_rays", "cache_bounces", "seed", "focus"});
}

void bind_shell_rule(nb::module_& m) {
  nb::class_<ShellRule> shell_rule(
      m, "ShellRule",
      R"(What one shell of a reflector's environment holds: the things that a reflected ray meets first,
as the first rule of a list says that they match. The last rule takes the rest, and the background.)");
  shell_rule
      .def(
          "__init__",
          [](ShellRule* self, std::string name, std::vector<int> objects, float nearer_than) {
            new (self) ShellRule{std::move(name), std::move(objects), nearer_than};
          },
          nb::arg("name"), nb::arg("objects") = std::vector<int>{},
          nb::arg("nearer_than") = ShellRule{}.nearer_than)
      .def_rw("name", &ShellRule::name, "Letters, digits, _ and -.")
      .def_rw("objects", &ShellRule::objects,
              "Numbers of objects, ITSELF for the reflector; empty: any, and lights.")
      .def_rw("nearer_than", &ShellRule::nearer_than, "Along the reflected ray, metres, more than 0.")
      .def_prop_ro_static(
          "ITSELF", [](nb::handle) { return ShellRule::kItself; }, "The reflector, as an entry of `objects`.")
      .def_prop_ro("has_limits", &ShellRule::has_limits,
                   R"(Whether it holds some of the places of its things alone, so that those may be met again
behind.)")
      .def(
          "holds",
          [](const ShellRule& rule, const IntList& objects, const FloatList& distances, int reflector) {
            std::vector<std::uint8_t> result =
                held(rule, {objects.data(), objects.size()}, {distances.data(), distances.size()}, reflector);
            const std::size_t count = result.size();
            return to_numpy(std::move(result), {count});
          },
          nb::arg("objects"), nb::arg("distances"), nb::arg("reflector"),
          signature<R"(def holds(self, objects: NDArray[numpy.int32], distances: NDArray[numpy.float32],
reflector: int) -> NDArray[numpy.uint8])">(),
          R"(1 where the rule holds what a ray meets, else 0: objects' numbers (n,), -1 for a light, at
distances (n,) along the ray, metres.)")
      .def(
          "__eq__", [](const ShellRule& a, const ShellRule& b) { return a == b; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"));
  record(shell_rule, {"name", "objects", "nearer_than"});
  m.def("default_shell_rules", &default_shell_rules,
        "`local`, the reflector itself, and `distant`, the rest.");
  m.attr("MOST_SHELLS") = kMostShells;
}

void bind_trace_options(nb::module_& m) {
  nb::class_<TraceOptions> trace_options(m, "TraceOptions", "What is decided per image.");
  trace_options
      .def(
          "__init__",
          [](TraceOptions* self, int samples_per_pixel, int max_specular_depth, int max_diffuse_depth,
             std::uint64_t seed, std::array<int, 4> window, float noise, int most_samples_per_pixel,
             std::vector<ShellRule> shells) {
            new (self) TraceOptions{samples_per_pixel,
                                    max_specular_depth,
                                    max_diffuse_depth,
                                    seed,
                                    {window[0], window[1], window[2], window[3]},
                                    noise,
                                    most_samples_per_pixel,
                                    std::move(shells),
                                    {}};
          },
          nb::kw_only(), nb::arg("samples_per_pixel") = TraceOptions{}.samples_per_pixel,
          nb::arg("max_specular_depth") = TraceOptions{}.max_specular_depth,
          nb::arg("max_diffuse_depth") = TraceOptions{}.max_diffuse_depth,
          nb::arg("seed") = TraceOptions{}.seed, nb::arg("window") = std::array<int, 4>{0, 0, 0, 0},
          nb::arg("noise") = TraceOptions{}.noise,
          nb::arg("most_samples_per_pixel") = TraceOptions{}.most_samples_per_pixel,
          nb::arg("shells") = default_shell_rules())
      .def_rw("samples_per_pixel", &TraceOptions::samples_per_pixel, "1 to 65536.")
      .def_rw("max_specular_depth", &TraceOptions::max_specular_depth,
              "Specular bounces after the first, 0 to 64.")
      .def_rw("max_diffuse_depth", &TraceOptions::max_diffuse_depth,
              "Diffuse bounces of IndirectLight.path, 0 to 64.")
      .def_rw("seed", &TraceOptions::seed)
      .def_rw("noise", &TraceOptions::noise,
              R"(0, or the standard error of a pixel's displayed value (sRGB, 0 to 1) for which
trace_layers takes more samples where they are needed.)")
      .def_rw("most_samples_per_pixel", &TraceOptions::most_samples_per_pixel,
              "Of trace_layers with `noise`, 1 to 65536.")
      .def_rw("shells", &TraceOptions::shells,
              "How trace_layers splits the incident light, front to back: 1 to MOST_SHELLS rules.")
      .def_prop_rw(
          "window",
          [](const TraceOptions& o) {
            return std::array<int, 4>{o.window.x, o.window.y, o.window.width, o.window.height};
          },
          [](TraceOptions& o, std::array<int, 4> w) {
            o.window = {w[0], w[1], w[2], w[3]};
          },
          "x, y, width, height of the part of the image to trace, in pixels; of no size: everything.");
  record(trace_options, {"samples_per_pixel", "max_specular_depth", "max_diffuse_depth", "seed", "noise",
                         "most_samples_per_pixel", "shells", "window"});
}

void bind_traces(nb::module_& m) {
  nb::class_<BeautyTrace>(m, "BeautyTrace", "An image that was traced until its noise was below a limit.")
      .def_prop_ro(
          "image",
          [](nb::handle self) {
            const Image& image = nb::cast<const BeautyTrace&>(self).image;
            const std::size_t shape[3] = {static_cast<std::size_t>(image.height),
                                          static_cast<std::size_t>(image.width), image.channels.size()};
            return nb::ndarray<nb::numpy, const float>(image.pixels.data(), 3, shape, self);
          },
          "(height, width, 3) float32 radiance, read-only.")
      .def_ro("noise", &BeautyTrace::noise,
              "Relative standard error of a pixel's luminance, root mean square over the tiles.")
      .def_ro("mean_samples_per_pixel", &BeautyTrace::mean_samples_per_pixel)
      .def_ro("share_above", &BeautyTrace::share_above,
              "Share of the tiles that samples_per_pixel ended before they reached the limit.");

  nb::class_<LayerTrace>(m, "LayerTrace", "The layers of one reflector in one view.")
      .def_prop_ro(
          "layers",
          [](nb::handle self) {
            const Image& image = nb::cast<const LayerTrace&>(self).layers;
            const std::size_t shape[3] = {static_cast<std::size_t>(image.height),
                                          static_cast<std::size_t>(image.width), image.channels.size()};
            return nb::ndarray<nb::numpy, const float>(image.pixels.data(), 3, shape, self);
          },
          "(height, width, channels) float32, read-only: means over each pixel's samples.")
      .def_prop_ro(
          "channels", [](const LayerTrace& trace) { return trace.layers.channels; },
          "Names of the channels of `layers`.")
      .def_prop_ro(
          "samples", [](const LayerTrace& trace) -> const SurfaceSamples& { return trace.samples; },
          nb::rv_policy::reference_internal, "The samples that see the reflector, with the traced light.")
      .def_prop_ro(
          "sample_beauty",
          [](nb::handle self) { return vectors_view(nb::cast<const LayerTrace&>(self).sample_beauty, self); },
          "(n, 3): beauty value of each entry of `samples`: what the layers add up to.")
      .def_prop_ro(
          "display_variance",
          [](nb::handle self) {
            return scalars_view(nb::cast<const LayerTrace&>(self).display_variance, self);
          },
          R"((height * width,): squared standard error of the displayed value (sRGB, 0 to 1) of the mean
of a pixel's covered samples, estimated.)");
}

void bind_tracer_class(nb::module_& m) {
  nb::class_<Tracer> tracer_type(
      m, "Tracer",
      "A scene made ready for tracing. Same arguments give the same bits on any number of threads.");
  tracer_type
      .def(
          "__init__",
          [](Tracer* self, const Scene& scene, const TracerOptions& options) {
            nb::gil_scoped_release released;
            new (self) Tracer(scene, options);
          },
          nb::arg("scene"), nb::arg("options") = TracerOptions{},
          R"(Copies the scene, builds the acceleration structure and, with IndirectLight.cached, gathers
the cache.)")
      .def_prop_ro(
          "scene", [](const Tracer& tracer) -> const Scene& { return tracer.scene(); },
          nb::rv_policy::reference_internal)
      .def("with_parts", &Tracer::with_parts, nb::arg("object"), nb::arg("parts"), nb::arg("part_names"),
           nb::arg("part_materials"), nb::call_guard<nb::gil_scoped_release>(),
           R"(The same scene with an object cut into other parts, `parts` giving that of every triangle; what
was gathered is kept, so this is much faster than a new tracer. No triangle may change its material.)")
      .def(
          "trace_beauty",
          [](const Tracer& tracer, const Camera& camera, const TraceOptions& options) {
            Image image;
            {
              nb::gil_scoped_release released;
              image = tracer.trace_beauty(camera, options);
            }
            return image_to_numpy(std::move(image));
          },
          nb::arg("camera"), nb::arg("options") = TraceOptions{},
          signature<R"(def trace_beauty(self, camera: Camera, options: TraceOptions = ...) ->
NDArray[numpy.float32])">(),
          "Image of everything: (height, width, 3) float32 radiance.")
      .def("trace_beauty_to_noise", &Tracer::trace_beauty_to_noise, nb::arg("camera"), nb::arg("noise"),
           nb::arg("options") = TraceOptions{}, nb::call_guard<nb::gil_scoped_release>(),
           signature<R"(def trace_beauty_to_noise(self, camera: Camera, noise: float,
options: TraceOptions = ...) -> BeautyTrace)">(),
           R"(The same with as many samples as each tile of 16² pixels needs for a relative standard error
of `noise`, at most options.samples_per_pixel.)")
      .def("trace_layers",
           nb::overload_cast<const Camera&, int, const TraceOptions&>(&Tracer::trace_layers, nb::const_),
           nb::arg("camera"), nb::arg("reflector"), nb::arg("options") = TraceOptions{},
           nb::call_guard<nb::gil_scoped_release>(),
           signature<R"(def trace_layers(self, camera: Camera, reflector: int,
options: TraceOptions = ...) -> LayerTrace)">(),
           "Layers of object number `reflector`, whose material must be specular.");
  bind_tracing(tracer_type);
  bind_gathering(tracer_type);
}

}  // namespace

void bind_tracer(nb::module_& m) {
  bind_camera(m);
  bind_tracer_options(m);
  bind_shell_rule(m);
  bind_trace_options(m);
  bind_traces(m);
  bind_tracer_class(m);
}

}  // namespace mirrorbake::bindings
