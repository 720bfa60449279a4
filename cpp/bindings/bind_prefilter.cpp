#include <nanobind/stl/function.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>

#include "bind.hpp"
#include "bind_enums.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/prefilter/background.hpp"
#include "mirrorbake/prefilter/convolve.hpp"
#include "mirrorbake/prefilter/harmonics.hpp"
#include "mirrorbake/prefilter/lobe.hpp"
#include "mirrorbake/prefilter/split_sum.hpp"
#include "signature.hpp"

namespace mirrorbake::bindings {
namespace {

// Keeps the map's values, which the convolver refers to.
struct OwningConvolver {
  FloatArray values;
  Convolver convolver;

  OwningConvolver(const EnvMapLayout& layout, FloatArray array)
      : values(std::move(array)), convolver(EnvMapView{layout, {values.data(), values.size()}}) {}
};

using DoubleMatrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

using DirectionImage = nb::ndarray<const double, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;
using Rotation = nb::ndarray<const double, nb::shape<3, 3>, nb::c_contig, nb::device::cpu>;

glm::dmat3 matrix_of(const Rotation& rows) { return glm::transpose(glm::make_mat3(rows.data())); }

// Coefficients (n, channels), n a square.
Harmonics harmonics_of(const DoubleMatrix& coefficients) {
  int order = 0;
  while (static_cast<std::size_t>((order + 1) * (order + 1)) < coefficients.shape(0)) ++order;
  Harmonics harmonics{order,
                      static_cast<int>(coefficients.shape(1)),
                      {coefficients.data(), coefficients.data() + coefficients.size()}};
  validate(harmonics);
  return harmonics;
}

nb::ndarray<nb::numpy, double> rows_of(std::vector<double>&& values, int channels) {
  const std::size_t columns = static_cast<std::size_t>(channels);
  const std::size_t rows = values.size() / columns;
  return to_numpy(std::move(values), {rows, columns});
}

nb::ndarray<nb::numpy, float> block(std::vector<float>&& values) {
  const std::size_t size = values.size();
  return to_numpy(std::move(values), {size});
}

void bind_lobes(nb::module_& m) {
  nb::class_<Lobe>(m, "Lobe", "A radially symmetric lobe of weights.")
      .def(
          "__init__",
          [](Lobe* self, LobeKind kind, double parameter, std::vector<double> table) {
            new (self) Lobe(make_lobe(kind, parameter, std::move(table)));
          },
          nb::arg("kind"), nb::arg("parameter") = 1.0, nb::arg("table") = std::vector<double>{},
          "lambert; phong (exponent); ggx (alpha); table (largest angle in degrees, weights at equal steps).")
      .def(
          "weight", [](const Lobe& lobe, double cosine) { return lobe_weight(lobe, cosine); },
          nb::arg("cosine"), "Weight at an angle with this cosine.")
      .def_prop_ro("integral", &lobe_integral, "Integral of the weight over the sphere, steradians.")
      .def_prop_ro("is_mirror", &is_mirror, "Whether it is a single direction.");
  m.def("alpha_from_exponent", &alpha_from_exponent, nb::arg("exponent"),
        "Alpha of the microfacets whose highlight is as wide as Phong's.");
  m.def("exponent_from_alpha", &exponent_from_alpha, nb::arg("alpha"),
        "Phong's exponent whose highlight is as wide as that of the microfacets.");

  nb::class_<OwningConvolver>(m, "Convolver", "Convolves one map with any number of lobes.")
      .def(nb::init<const EnvMapLayout&, FloatArray>(), nb::arg("layout"), nb::arg("values"))
      .def(
          "apply",
          [](OwningConvolver& self, const Lobe& lobe, const std::string& projection, int width, int height,
             LobeScale scale, const std::function<void(double)>& progress) {
            const PrefilterTarget target{parse_projection(projection), width, height};
            std::function<void(double)> report;
            if (progress) {
              report = [&](double done) {
                nb::gil_scoped_acquire held;
                progress(done);
              };
            }
            EnvMap map;
            {
              nb::gil_scoped_release released;
              map = self.convolver.apply(lobe, target, scale, report);
            }
            return nb::make_tuple(map.layout, block(std::move(map.values)));
          },
          nb::arg("lobe"), nb::arg("projection"), nb::arg("width"), nb::arg("height"), nb::arg("scale"),
          nb::arg("progress").none() = nb::none(),
          signature<R"(def apply(self, lobe: Lobe, projection: str, width: int, height: int,
scale: typing.Literal['mean', 'sum'], progress: collections.abc.Callable[[float], None] | None = None)
-> tuple[EnvMapLayout, NDArray[numpy.float32]])">(),
          "Layout and values of the map, by the direction of the lobe's axis.")
      .def(
          "sample",
          [](OwningConvolver& self, const Lobe& lobe, PointArray directions, LobeScale scale,
             std::size_t channels) {
            std::vector<float> values(directions.shape(0) * channels);
            {
              nb::gil_scoped_release released;
              self.convolver.apply(
                  lobe, {reinterpret_cast<const glm::vec3*>(directions.data()), directions.shape(0)}, scale,
                  values);
            }
            return to_numpy(std::move(values), {directions.shape(0), channels});
          },
          nb::arg("lobe"), nb::arg("directions"), nb::arg("scale"), nb::arg("channels"),
          "Values (n, channels) for lobes about unit directions (n, 3).");
}

void bind_chain(nb::module_& m) {
  m.def(
      "ggx_chain",
      [](const EnvMapLayout& layout, FloatArray values, int size, int levels, RoughnessScale roughness,
         const std::function<void(int, int)>& progress) {
        ChainOptions options{size, levels, roughness};
        if (progress) {
          options.progress = [&](int level, int count) {
            nb::gil_scoped_acquire held;
            progress(level, count);
          };
        }
        EnvMap map;
        {
          nb::gil_scoped_release released;
          map = ggx_chain({layout, {values.data(), values.size()}}, options);
        }
        return nb::make_tuple(map.layout, block(std::move(map.values)));
      },
      nb::arg("layout"), nb::arg("values"), nb::arg("size"), nb::arg("levels"), nb::arg("roughness"),
      nb::arg("progress").none() = nb::none(),
      signature<R"(def ggx_chain(layout: EnvMapLayout, values: NDArray[numpy.float32], size: int,
levels: int, roughness: typing.Literal['squared', 'linear'],
progress: collections.abc.Callable[[int, int], None] | None = None) -> tuple[EnvMapLayout,
NDArray[numpy.float32]])">(),
      "A cube whose levels are prefiltered with GGX of rising alpha.");
  m.def("chain_alpha", &chain_alpha, nb::arg("level"), nb::arg("levels"), nb::arg("roughness"),
        "Alpha of a level of a chain.");
}

void bind_harmonics(nb::module_& m) {
  m.def(
      "project_harmonics",
      [](const EnvMapLayout& layout, FloatArray values, int order) {
        Harmonics harmonics;
        {
          nb::gil_scoped_release released;
          harmonics = project_harmonics({layout, {values.data(), values.size()}}, order);
        }
        return rows_of(std::move(harmonics.coefficients), harmonics.channels);
      },
      nb::arg("layout"), nb::arg("values"), nb::arg("order"),
      "Coefficients ((order + 1)^2, channels) of the finest level.");
  m.def(
      "harmonic_basis",
      [](PointArray directions, int order) {
        const std::size_t count = directions.shape(0);
        const std::size_t size = static_cast<std::size_t>((order + 1) * (order + 1));
        std::vector<double> values(count * size);
        const auto* d = reinterpret_cast<const glm::vec3*>(directions.data());
        for (std::size_t i = 0; i < count; ++i) {
          harmonic_basis(glm::dvec3(d[i]), order, std::span(values).subspan(i * size, size));
        }
        return to_numpy(std::move(values), {count, size});
      },
      nb::arg("directions"), nb::arg("order"),
      "Values (n, (order + 1)^2) of all functions in unit directions (n, 3).");
  m.def("lambert_factor", &lambert_factor, nb::arg("band"), "What a cosine lobe multiplies a band by.");
  m.def(
      "lambert_harmonics",
      [](DoubleMatrix radiance) {
        Harmonics harmonics = lambert_harmonics(harmonics_of(radiance));
        return rows_of(std::move(harmonics.coefficients), harmonics.channels);
      },
      nb::arg("radiance"), "Coefficients of irradiance from those of radiance.");
  m.def(
      "window_harmonics",
      [](DoubleMatrix coefficients, HarmonicWindow window) {
        Harmonics harmonics = windowed(harmonics_of(coefficients), window);
        return rows_of(std::move(harmonics.coefficients), harmonics.channels);
      },
      nb::arg("coefficients"), nb::arg("window"), "Coefficients damped against ringing.");
  m.def(
      "evaluate_harmonics",
      [](DoubleMatrix coefficients, const std::string& projection, int width, int height,
         NegativeLight negative) {
        EnvMap map = evaluate_harmonics(harmonics_of(coefficients),
                                        {parse_projection(projection), width, height}, negative);
        return nb::make_tuple(map.layout, block(std::move(map.values)));
      },
      nb::arg("coefficients"), nb::arg("projection"), nb::arg("width"), nb::arg("height"),
      nb::arg("negative"),
      signature<R"(def evaluate_harmonics(coefficients: NDArray[numpy.float64], projection: str, width: int,
height: int, negative: typing.Literal['clamp', 'keep']) -> tuple[EnvMapLayout, NDArray[numpy.float32]])">(),
      "Layout and values of the map of the sums.");
  m.def(
      "harmonic_constants",
      [](DoubleMatrix radiance) {
        const Harmonics harmonics = harmonics_of(radiance);
        return rows_of(shader_constants(harmonics), harmonics.channels);
      },
      nb::arg("radiance"), "Nine constants (9, channels) of E/pi for a shader, in Filament's order.");
}

void bind_split_sum(nb::module_& m) {
  m.def(
      "split_sum",
      [](double cosine, double alpha) {
        const SplitSum sum = split_sum(cosine, alpha);
        return nb::make_tuple(sum.scale, sum.bias);
      },
      nb::arg("cosine"), nb::arg("alpha"),
      nb::sig("def split_sum(cosine: float, alpha: float) -> tuple[float, float]"),
      "Scale and bias of the reflectance at normal incidence.");
  m.def(
      "split_sum_table",
      [](int size, RoughnessScale roughness) {
        std::vector<float> table = split_sum_table(size, roughness);
        const std::size_t n = static_cast<std::size_t>(size);
        return to_numpy(std::move(table), {n, n, 3});
      },
      nb::arg("size"), nb::arg("roughness"), "Scale, bias and their sum (roughness, n.v, 3).");

  m.def(
      "lens_directions",
      [](Lens lens, int width, int height, double field_of_view) {
        const std::vector<glm::dvec3> directions = lens_directions(lens, width, height, field_of_view);
        std::vector<double> values;
        for (const glm::dvec3& d : directions) values.insert(values.end(), {d.x, d.y, d.z});
        return to_numpy(std::move(values),
                        {static_cast<std::size_t>(height), static_cast<std::size_t>(width), 3});
      },
      nb::arg("lens"), nb::arg("width"), nb::arg("height"), nb::arg("field_of_view"),
      "Directions (height, width, 3) of the pixels of a camera; NaN beyond the disc of a fisheye.");
  m.def(
      "background",
      [](const EnvMapLayout& layout, FloatArray values, const DirectionImage& directions,
         const Rotation& world_from_camera, const Rotation& world_from_camera_end, int steps) {
        const std::size_t height = directions.shape(0);
        const std::size_t width = directions.shape(1);
        std::vector<glm::dvec3> d(height * width);
        for (std::size_t i = 0; i < d.size(); ++i) {
          d[i] = {directions.data()[3 * i], directions.data()[3 * i + 1], directions.data()[3 * i + 2]};
        }
        const BackgroundOptions options{matrix_of(world_from_camera), matrix_of(world_from_camera_end),
                                        steps};
        std::vector<float> picture;
        {
          nb::gil_scoped_release released;
          picture = background({layout, {values.data(), values.size()}}, d, static_cast<int>(width),
                               static_cast<int>(height), options);
        }
        return to_numpy(std::move(picture), {height, width, static_cast<std::size_t>(layout.channels)});
      },
      nb::arg("layout"), nb::arg("values"), nb::arg("directions"), nb::arg("world_from_camera"),
      nb::arg("world_from_camera_end"), nb::arg("steps"),
      "Picture (height, width, channels) of what a camera that turns sees.");
}

}  // namespace

void bind_prefilter(nb::module_& m) {
  bind_lobes(m);
  bind_chain(m);
  bind_harmonics(m);
  bind_split_sum(m);
}

}  // namespace mirrorbake::bindings
