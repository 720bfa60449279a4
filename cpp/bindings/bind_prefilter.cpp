#include <nanobind/stl/function.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "bind.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/prefilter/convolve.hpp"
#include "mirrorbake/prefilter/lobe.hpp"

namespace mirrorbake::bindings {
namespace {

// Keeps the map's values, which the convolver refers to.
struct OwningConvolver {
  FloatArray values;
  Convolver convolver;

  OwningConvolver(const EnvMapLayout& layout, FloatArray array)
      : values(std::move(array)), convolver(EnvMapView{layout, {values.data(), values.size()}}) {}
};

Lobe lobe_named(const std::string& kind, double parameter, std::vector<double> table) {
  Lobe lobe;
  if (kind == "lambert") {
    lobe.kind = LobeKind::lambert;
  } else if (kind == "phong") {
    lobe.kind = LobeKind::phong;
    lobe.exponent = parameter;
  } else if (kind == "ggx") {
    lobe.kind = LobeKind::ggx;
    lobe.alpha = parameter;
  } else if (kind == "table") {
    lobe.kind = LobeKind::table;
    lobe.table_angle = parameter;
    lobe.table = std::move(table);
  } else {
    throw InvalidArgument("kind", kind, "lambert, phong, ggx or table");
  }
  validate(lobe);
  return lobe;
}

LobeScale scale_named(const std::string& name) {
  if (name == "mean") return LobeScale::mean;
  if (name == "sum") return LobeScale::sum;
  throw InvalidArgument("scale", name, "mean or sum");
}

RoughnessScale roughness_named(const std::string& name) {
  if (name == "squared") return RoughnessScale::squared;
  if (name == "linear") return RoughnessScale::linear;
  throw InvalidArgument("roughness", name, "squared or linear");
}

nb::ndarray<nb::numpy, float> block(std::vector<float>&& values) {
  const std::size_t size = values.size();
  return to_numpy(std::move(values), {size});
}

}  // namespace

void bind_prefilter(nb::module_& m) {
  nb::class_<Lobe>(m, "Lobe", "A radially symmetric lobe of weights.")
      .def(
          "__init__",
          [](Lobe* self, const std::string& kind, double parameter, std::vector<double> table) {
            new (self) Lobe(lobe_named(kind, parameter, std::move(table)));
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
             const std::string& scale) {
            const PrefilterTarget target{parse_projection(projection), width, height};
            const LobeScale lobe_scale = scale_named(scale);
            EnvMap map;
            {
              nb::gil_scoped_release released;
              map = self.convolver.apply(lobe, target, lobe_scale);
            }
            return nb::make_tuple(map.layout, block(std::move(map.values)));
          },
          nb::arg("lobe"), nb::arg("projection"), nb::arg("width"), nb::arg("height"), nb::arg("scale"),
          nb::sig("def apply(self, lobe: Lobe, projection: str, width: int, height: int, scale: str) -> "
                  "tuple[EnvMapLayout, NDArray[numpy.float32]]"),
          "Layout and values of the map, by the direction of the lobe's axis.")
      .def(
          "sample",
          [](OwningConvolver& self, const Lobe& lobe, PointArray directions, const std::string& scale,
             std::size_t channels) {
            std::vector<float> values(directions.shape(0) * channels);
            const LobeScale lobe_scale = scale_named(scale);
            {
              nb::gil_scoped_release released;
              self.convolver.apply(
                  lobe,
                  {reinterpret_cast<const glm::vec3*>(directions.data()), directions.shape(0)},
                  lobe_scale, values);
            }
            return to_numpy(std::move(values), {directions.shape(0), channels});
          },
          nb::arg("lobe"), nb::arg("directions"), nb::arg("scale"), nb::arg("channels"),
          "Values (n, channels) for lobes about unit directions (n, 3).");
  m.def(
      "ggx_chain",
      [](const EnvMapLayout& layout, FloatArray values, int size, int levels, const std::string& roughness,
         const std::function<void(int, int)>& progress) {
        ChainOptions options{size, levels, roughness_named(roughness)};
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
      nb::sig("def ggx_chain(layout: EnvMapLayout, values: NDArray[numpy.float32], size: int, levels: int, "
              "roughness: str, progress: collections.abc.Callable[[int, int], None] | None = None) -> "
              "tuple[EnvMapLayout, NDArray[numpy.float32]]"),
      "A cube whose levels are prefiltered with GGX of rising alpha.");
  m.def("chain_alpha", [](int level, int levels, const std::string& roughness) {
          return chain_alpha(level, levels, roughness_named(roughness));
        },
        nb::arg("level"), nb::arg("levels"), nb::arg("roughness"), "Alpha of a level of a chain.");
}

}  // namespace mirrorbake::bindings
