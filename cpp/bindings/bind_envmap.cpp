#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "bind.hpp"
#include "bind_enums.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/compare.hpp"
#include "mirrorbake/envmap/conventions.hpp"
#include "mirrorbake/envmap/dds.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/envmap/footprint.hpp"
#include "mirrorbake/envmap/half_envmap.hpp"
#include "mirrorbake/envmap/mipmap.hpp"
#include "mirrorbake/envmap/repair.hpp"
#include "mirrorbake/envmap/resample.hpp"
#include "mirrorbake/envmap/sampling.hpp"
#include "signature.hpp"

namespace mirrorbake::bindings {
namespace {

using Matrix3 = nb::ndarray<const float, nb::shape<3, 3>, nb::c_contig, nb::device::cpu>;

// Memory to write to, of any shape.
using FloatResult = nb::ndarray<float, nb::c_contig, nb::device::cpu>;

EnvMapView view(const EnvMapLayout& layout, const FloatArray& values) {
  return {layout, {values.data(), values.size()}};
}

glm::mat3 matrix(const Matrix3& rows) {
  glm::mat3 m;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) m[column][row] = rows(row, column);
  }
  return m;
}

nb::ndarray<nb::numpy, float> block(std::vector<float>&& values) {
  const std::size_t size = values.size();
  return to_numpy(std::move(values), {size});
}

void bind_layout(nb::module_& m) {
  nb::class_<EnvMapLayout> layout_type(
      m, "EnvMapLayout",
      "Order of the values of an environment map: levels, faces, rows, columns, channels.");
  show(layout_type, {"projection", "width", "height", "levels", "channels"});
  layout_type
      .def(
          "__init__",
          [](EnvMapLayout* self, const std::string& projection, int width, int height, int levels,
             int channels) {
            const EnvMapLayout layout{parse_projection(projection), width, height, levels, channels};
            validate(layout);
            new (self) EnvMapLayout(layout);
          },
          nb::arg("projection"), nb::arg("width"), nb::arg("height"), nb::arg("levels") = 1,
          nb::arg("channels") = 3)
      .def(
          "__eq__", [](const EnvMapLayout& a, const EnvMapLayout& b) { return a == b; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__getstate__",
           [](const EnvMapLayout& l) {
             return std::tuple(to_string(l.projection), l.width, l.height, l.levels, l.channels);
           })
      .def("__setstate__",
           [](EnvMapLayout& self, const std::tuple<std::string, int, int, int, int>& state) {
             const auto& [projection, width, height, levels, channels] = state;
             const EnvMapLayout layout{parse_projection(projection), width, height, levels, channels};
             validate(layout);
             new (&self) EnvMapLayout(layout);
           })
      .def_prop_ro(
          "projection", [](const EnvMapLayout& l) { return to_string(l.projection); },
          "Name of the projection.")
      .def_ro("width", &EnvMapLayout::width, "Texels of a face of the finest level.")
      .def_ro("height", &EnvMapLayout::height, "Texels of a face of the finest level.")
      .def_ro("levels", &EnvMapLayout::levels, "Number of levels, counted from the finest.")
      .def_ro("channels", &EnvMapLayout::channels, "Values per texel.")
      .def_prop_ro(
          "faces", [](const EnvMapLayout& l) { return face_count(l.projection); }, "Number of faces.")
      .def_prop_ro("size", &EnvMapLayout::size, "Number of values.")
      .def("level_width", &EnvMapLayout::level_width, nb::arg("level"), "Texels of a face of a level.")
      .def("level_height", &EnvMapLayout::level_height, nb::arg("level"), "Texels of a face of a level.")
      .def("level_offset", &EnvMapLayout::level_offset, nb::arg("level"),
           "Index of the first value of a level.");

  m.def("full_level_count", &full_level_count, nb::arg("width"), nb::arg("height"),
        "Number of levels down to 1x1.");
  m.def(
      "integrate",
      [](const EnvMapLayout& layout, FloatArray values, int level) {
        nb::gil_scoped_release released;
        return integrate(view(layout, values), level);
      },
      nb::arg("layout"), nb::arg("values"), nb::arg("level") = 0,
      "Sum of value times solid angle over the sphere, per channel.");
}

void bind_values(nb::module_& m) {
  m.def(
      "half_from_float",
      [](const EnvMapLayout& layout, FloatArray values) {
        std::size_t clamped = 0;
        HalfEnvMap half;
        {
          nb::gil_scoped_release released;
          half = half_from_float(view(layout, values), &clamped);
        }
        const std::size_t count = half.values.size();
        return nb::make_tuple(to_numpy(std::move(half.values), {count}), clamped);
      },
      nb::arg("layout"), nb::arg("values"),
      signature<R"(def half_from_float(layout: EnvMapLayout, values: NDArray[numpy.float32]) ->
tuple[NDArray[numpy.uint16], int])">(),
      "The bits of all values as IEEE 754 binary16, and how many were clamped to 65504.");
  nb::class_<Resampler>(m, "Resampler",
                        "Resamples maps of one layout, and keeps what every texel is made from.")
      .def(
          "__init__",
          [](Resampler* self, const EnvMapLayout& source, const std::string& projection, int width,
             int height, ResampleFilter filter, Matrix3 source_from_target, std::size_t max_bytes) {
            const ResampleOptions options{filter, matrix(source_from_target)};
            const Projection target = parse_projection(projection);
            nb::gil_scoped_release released;
            new (self) Resampler(source, target, width, height, options, max_bytes);
          },
          nb::arg("source"), nb::arg("projection"), nb::arg("width"), nb::arg("height"), nb::arg("filter"),
          nb::arg("source_from_target"), nb::arg("max_bytes"))
      .def(
          "apply",
          [](const Resampler& self, const EnvMapLayout& layout, FloatArray values, FloatResult result) {
            nb::gil_scoped_release released;
            self.apply(view(layout, values), {result.data(), result.size()});
          },
          nb::arg("layout"), nb::arg("values"), nb::arg("result"),
          "Writes the finest level of a map in the other projection and size into all of `result`.")
      .def("layout", &Resampler::layout, nb::arg("channels"), "Layout of the result for so many channels.")
      .def_prop_ro("bytes", &Resampler::bytes, "Memory of what is kept.");
}

void bind_levels(nb::module_& m) {
  m.def(
      "build_mips",
      [](const EnvMapLayout& layout, FloatArray values, MipFilter filter) {
        EnvMap result;
        {
          nb::gil_scoped_release released;
          result = build_mips(view(layout, values), filter);
        }
        return block(std::move(result.values));
      },
      nb::arg("layout"), nb::arg("values"), nb::arg("filter"),
      "All levels from the finest: box, solid_angle or seamless.");
  m.def(
      "measure_seam",
      [](const EnvMapLayout& layout, FloatArray values, int level) {
        const SeamReport report = measure_seam(view(layout, values), level);
        return nb::make_tuple(report.across, report.inside);
      },
      nb::arg("layout"), nb::arg("values"), nb::arg("level"),
      signature<R"(def measure_seam(layout: EnvMapLayout, values: NDArray[numpy.float32], level: int) ->
tuple[float, float])">(),
      "Largest steps between neighbouring texels: across the edges of faces, and inside of faces.");
  m.def(
      "add_border",
      [](const EnvMapLayout& layout, FloatArray values, int level, int border) {
        std::vector<float> result = add_border(view(layout, values), level, border);
        const std::size_t wide = static_cast<std::size_t>(layout.level_width(level) + 2 * border);
        const std::size_t high = static_cast<std::size_t>(layout.level_height(level) + 2 * border);
        return to_numpy(std::move(result), {static_cast<std::size_t>(face_count(layout.projection)), high,
                                            wide, static_cast<std::size_t>(layout.channels)});
      },
      nb::arg("layout"), nb::arg("values"), nb::arg("level"), nb::arg("border"),
      "Faces of a level with a border of their neighbours' texels: (faces, height, width, channels).");
  m.def(
      "sample",
      [](const EnvMapLayout& layout, FloatArray values, PointArray directions, std::optional<PointArray> ddx,
         std::optional<PointArray> ddy, SampleFilter filter, std::optional<FloatArray> level, double bias,
         double max_anisotropy) {
        const auto vectors = [](const PointArray& a) {
          return std::span(reinterpret_cast<const glm::vec3*>(a.data()), a.shape(0));
        };
        const std::span<const glm::vec3> none;
        SampleOptions options{filter, max_anisotropy, bias};
        if (level) options.level = {level->data(), level->size()};
        std::vector<float> result(directions.shape(0) * static_cast<std::size_t>(layout.channels));
        {
          nb::gil_scoped_release released;
          const std::size_t unusable =
              sample(view(layout, values), vectors(directions), ddx ? vectors(*ddx) : none,
                     ddy ? vectors(*ddy) : none, options, result);
          if (unusable > 0) {
            throw InvalidArgument("directions", std::to_string(unusable) + " NaN, infinite or zero vectors",
                                  "finite vectors of a length above 0");
          }
        }
        return to_numpy(std::move(result), {directions.shape(0), static_cast<std::size_t>(layout.channels)});
      },
      nb::arg("layout"), nb::arg("values"), nb::arg("directions"), nb::arg("ddx") = nb::none(),
      nb::arg("ddy") = nb::none(), nb::arg("filter") = SampleFilter::bilinear, nb::arg("level") = nb::none(),
      nb::arg("bias") = 0.0, nb::arg("max_anisotropy") = 16.0,
      R"(Values in directions (n, 3): nearest, bilinear, trilinear or ewa, the last two with
differentials (n, 3), or trilinear at levels, one or n of them.)");
}

void bind_sampling(nb::module_& m) {
  m.def(
      "quad_differentials",
      [](FloatImage directions) {
        if (directions.shape(2) != 3) {
          throw InvalidArgument("directions", std::to_string(directions.shape(2)) + " components", "3");
        }
        const std::size_t height = directions.shape(0);
        const std::size_t width = directions.shape(1);
        std::vector<glm::vec3> ddx(width * height);
        std::vector<glm::vec3> ddy(width * height);
        quad_differentials(static_cast<int>(width), static_cast<int>(height),
                           {reinterpret_cast<const glm::vec3*>(directions.data()), width * height}, ddx, ddy);
        return nb::make_tuple(vectors_to_numpy(std::move(ddx)), vectors_to_numpy(std::move(ddy)));
      },
      nb::arg("directions"), signature<R"(def quad_differentials(directions: NDArray[numpy.float32]) ->
tuple[NDArray[numpy.float32], NDArray[numpy.float32]])">(),
      R"(Differences within quads of 2x2 pixels of an image of directions (height, width, 3): two arrays
(height * width, 3).)");
  m.def(
      "footprint_from_corners",
      [](glm::vec3 top_left, glm::vec3 top_right, glm::vec3 bottom_right, glm::vec3 bottom_left) {
        const Footprint f = footprint_from_corners({top_left, top_right, bottom_right, bottom_left});
        return nb::make_tuple(f.direction, f.ddx, f.ddy);
      },
      nb::arg("top_left"), nb::arg("top_right"), nb::arg("bottom_right"), nb::arg("bottom_left"),
      "Direction and differentials of the reflection cone through a pixel's corners.");
  m.def("reflected_differential", &reflected_differential, nb::arg("direction"), nb::arg("normal"),
        nb::arg("dd"), nb::arg("dn"), "Differential of the mirror direction of a ray (Igehy 1999).");
  m.def(
      "convert_convention",
      [](const EnvMapLayout& layout, FloatArray values, const std::string& name, ConventionWay way) {
        return block(convert_convention(view(layout, values), name, way).values);
      },
      nb::arg("layout"), nb::arg("values"), nb::arg("name"), nb::arg("way"),
      "The map in, or from, the orientation of openexr, oiio, mitsuba, threejs or ktx2.");
  m.def(
      "load_envmap",
      [](const PathText& path, std::optional<std::string> projection, FaceLayout faces,
         const std::string& layer, const std::string& part, bool repair) {
        std::optional<Projection> given;
        if (projection) given = parse_projection(*projection);
        EnvMap map;
        std::size_t bad = 0;
        {
          nb::gil_scoped_release released;
          map = load_envmap(path.text, given, faces, {}, {part, layer});
          bad = repair ? repair_not_finite(path.text, map) : count_not_finite(map);
        }
        return nb::make_tuple(map.layout, block(std::move(map.values)), map.channels, bad);
      },
      nb::arg("path"), nb::arg("projection") = nb::none(), nb::arg("faces") = FaceLayout::automatic,
      nb::arg("layer") = "", nb::arg("part") = "", nb::arg("repair") = false,
      signature<R"(def load_envmap(path: str | os.PathLike[str], projection: str | None = None,
faces: typing.Literal['automatic', 'strip', 'column', 'grid', 'cross', 'vertical_cross', 'files'] = 'automatic',
layer: str = '', part: str = '', repair: bool = False) -> tuple[EnvMapLayout, NDArray[numpy.float32], list[str], int])">(),
      R"(Layout, values and names of the channels of a map in an image, KTX2 or DDS file, and how many values
are NaN or infinite there, which `repair` fills from their surroundings.)");
}

void bind_files(nb::module_& m) {
  m.def(
      "load_panorama",
      [](const PathText& path, const std::string& layer, const std::string& part, bool repair) {
        Panorama panorama;
        {
          nb::gil_scoped_release released;
          panorama = load_panorama(path.text, {.choice = {part, layer}, .repairs = repair});
        }
        const auto height = static_cast<std::size_t>(panorama.image.height);
        const auto width = static_cast<std::size_t>(panorama.image.width);
        return nb::make_tuple(to_numpy(std::move(panorama.image.pixels), {height, width, 3}),
                              panorama.negative, panorama.repaired);
      },
      nb::arg("path"), nb::arg("layer") = "", nb::arg("part") = "", nb::arg("repair") = false,
      signature<R"(def load_panorama(path: str | os.PathLike[str], layer: str = '', part: str = '',
repair: bool = False) -> tuple[NDArray[numpy.float32], int, int])">(),
      R"(A map as light: a latlong of R, G and B, (height, width, 3), finite and nowhere below 0; how many
values were negative in the file, and how many NaN or infinite. Cubes are recognised by their shape and
resampled; alpha, depth and other channels are left out. `layer` and `part` choose in an EXR file. Raises
FileError for a picture that is no panorama, and for values that are not finite unless `repair` fills
them from their surroundings.)");
  m.def(
      "save_envmap",
      [](const PathText& path, const EnvMapLayout& layout, FloatArray values,
         const std::vector<std::string>& channels, FaceLayout faces, PixelFormat format) {
        EnvMapView map = view(layout, values);
        map.channels = channels;
        nb::gil_scoped_release released;
        return save_envmap(path.text, map, faces, format);
      },
      nb::arg("path"), nb::arg("layout"), nb::arg("values"), nb::arg("channels"),
      nb::arg("faces") = FaceLayout::automatic, nb::arg("format") = PixelFormat::automatic,
      "Write the finest level as an image, or all levels as KTX2 or DDS.");

  m.def(
      "save_dds_bc6h",
      [](const PathText& path, const EnvMapLayout& layout, const nb::bytes& blocks) {
        const std::span<const std::byte> bytes(static_cast<const std::byte*>(blocks.data()), blocks.size());
        nb::gil_scoped_release released;
        save_dds_bc6h(path.text, layout, bytes);
      },
      nb::arg("path"), nb::arg("layout"), nb::arg("blocks"),
      "Write encoded blocks of a cube: all levels of a face, one face after the other.");
}

void bind_comparison(nb::module_& m) {
  nb::class_<Comparison> comparison(m, "Comparison", "How two maps differ, texels weighted by solid angle.");
  comparison.def_ro("max_error", &Comparison::max_error, "Largest difference.")
      .def_ro("mean_error", &Comparison::mean_error, "Mean difference over the sphere.")
      .def_ro("rms_error", &Comparison::rms_error, "Root of the mean squared difference.")
      .def_ro("relative_l2", &Comparison::relative_l2, "RMS error over the RMS of the reference.")
      .def_ro("psnr", &Comparison::psnr, "20 log10(largest value of the reference / RMS error), dB.")
      .def_ro("flux_ratio", &Comparison::flux_ratio, "Flux of the map over that of the reference.")
      .def_ro("not_finite", &Comparison::not_finite,
              "Number of NaN and infinite values, left out of the rest.");
  show(comparison,
       {"max_error", "mean_error", "rms_error", "relative_l2", "psnr", "flux_ratio", "not_finite"});
  m.def(
      "compare_envmaps",
      [](const EnvMapLayout& layout, FloatArray values, const EnvMapLayout& reference_layout,
         FloatArray reference) {
        nb::gil_scoped_release released;
        return compare(view(layout, values), view(reference_layout, reference));
      },
      nb::arg("layout"), nb::arg("values"), nb::arg("reference_layout"), nb::arg("reference"),
      "The finest level of a map against a reference.");
}

}  // namespace

void bind_envmap(nb::module_& m) {
  bind_layout(m);
  bind_values(m);
  bind_levels(m);
  bind_sampling(m);
  bind_files(m);
  bind_comparison(m);
}

}  // namespace mirrorbake::bindings
