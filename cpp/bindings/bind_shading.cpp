#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "bind.hpp"
#include "bind_enums.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/shading/fresnel.hpp"
#include "mirrorbake/shading/fresnel_table.hpp"
#include "mirrorbake/shading/metals.hpp"

namespace mirrorbake::bindings {
namespace {

/// Of any shape, which the functions do not look at.
template <typename T>
using Values = nb::ndarray<const T, nb::c_contig, nb::device::cpu>;
template <typename T>
using Output = nb::ndarray<T, nb::c_contig, nb::device::cpu>;

template <typename T>
std::span<T> span_of(const nb::ndarray<T, nb::c_contig, nb::device::cpu>& array) {
  return {array.data(), array.size()};
}

using NoGil = nb::call_guard<nb::gil_scoped_release>;

/// The functions of arrays, which fill `f`; the package allocates and broadcasts.
template <typename T>
void bind_precision(nb::module_& m) {
  const auto c = nb::arg("c").noconvert();
  const auto f = nb::arg("f").noconvert();
  m.def(
      "fresnel_schlick",
      [](Values<T> in, T r0, Output<T> out) { fresnel_schlick(span_of(in), r0, span_of(out)); }, c,
      nb::arg("r0"), f, NoGil());
  m.def(
      "fresnel_schlick",
      [](Values<T> in, Values<T> r0, Output<T> out) {
        fresnel_schlick(span_of(in), span_of(r0), span_of(out));
      },
      c, nb::arg("r0").noconvert(), f, NoGil());
  m.def(
      "fresnel_dielectric",
      [](Values<T> in, T ior, Output<T> out) { fresnel_dielectric(span_of(in), ior, span_of(out)); }, c,
      nb::arg("ior"), f, NoGil());
  m.def(
      "fresnel_dielectric",
      [](Values<T> in, Values<T> ior, Output<T> out) {
        fresnel_dielectric(span_of(in), span_of(ior), span_of(out));
      },
      c, nb::arg("ior").noconvert(), f, NoGil());
  m.def(
      "fresnel_conductor",
      [](Values<T> in, T eta, T k, Output<T> out) { fresnel_conductor(span_of(in), eta, k, span_of(out)); },
      c, nb::arg("eta"), nb::arg("k"), f, NoGil());
  m.def(
      "fresnel_conductor",
      [](Values<T> in, Values<T> eta, Values<T> k, Output<T> out) {
        fresnel_conductor(span_of(in), span_of(eta), span_of(k), span_of(out));
      },
      c, nb::arg("eta").noconvert(), nb::arg("k").noconvert(), f, NoGil());
}

/// `first` is r0, the index or eta.
ReflectanceFunction reflectance_of(FresnelModel model, double first, double k) {
  switch (model) {
    case FresnelModel::constant: return [first](double) { return first; };
    case FresnelModel::schlick: return [first](double c) { return fresnel_schlick(c, first); };
    case FresnelModel::dielectric: return [first](double c) { return fresnel_dielectric(c, first); };
    case FresnelModel::conductor: return [first, k](double c) { return fresnel_conductor(c, first, k); };
  }
  throw nb::value_error("model is not a FresnelModel");
}

using Triple = std::tuple<double, double, double>;

template <typename V>
Triple triple(const V& v) {
  return {v[0], v[1], v[2]};
}

void bind_formulas(nb::module_& m) {
  bind_precision<float>(m);
  bind_precision<double>(m);

  m.def(
      "fresnel_dielectric_transmittance",
      [](double c, double ior) { return fresnel_dielectric_transmittance(c, ior); }, nb::arg("c"),
      nb::arg("ior"), "1 − F without cancellation.");

  nb::class_<FresnelTable>(m, "FresnelTable",
                           "Reflectance at equal steps of the cosine, interpolated linearly.")
      .def_prop_ro(
          "values",
          [](nb::handle_t<FresnelTable> self) {
            return scalars_view(nb::cast<FresnelTable&>(self).values, self);
          },
          "float32 (size,): reflectance at c = 0, 1/(size − 1), …, 1.")
      .def_ro("max_error", &FresnelTable::max_error, "Largest deviation from the exact curve.")
      .def(
          "evaluate",
          [](const FresnelTable& table, Values<float> c, Output<float> f) {
            evaluate(table, span_of(c), span_of(f));
          },
          nb::arg("c").noconvert(), nb::arg("f").noconvert(), NoGil())
      .def(
          "evaluate",
          [](const FresnelTable& table, Values<double> c, Output<double> f) {
            evaluate(table, span_of(c), span_of(f));
          },
          nb::arg("c").noconvert(), nb::arg("f").noconvert(), NoGil(),
          "Fills `f` with interpolated reflectance.");
}

void bind_tables(nb::module_& m) {
  m.def(
      "make_fresnel_table",
      [](FresnelModel model, double first, double k, std::size_t size) {
        return make_table(reflectance_of(model, first, k), size);
      },
      nb::arg("model"), nb::arg("first"), nb::arg("k"), nb::arg("size"),
      "first: r0, relative index or eta, as the model has it; k for conductors.");
  m.def(
      "fresnel_table_for_error",
      [](FresnelModel model, double first, double k, double max_error) {
        return table_for_error(reflectance_of(model, first, k), max_error);
      },
      nb::arg("model"), nb::arg("first"), nb::arg("k"), nb::arg("max_error"));

  m.def(
      "metal_names",
      [] {
        std::vector<std::string> names;
        for (Metal metal : all_metals()) names.emplace_back(to_string(metal));
        return names;
      },
      "Names of the metals with measured optical constants.");
  m.def(
      "metal_source",
      [](const std::string& metal) { return std::string(optical_constants(parse_metal(metal)).source); },
      nb::arg("metal"), "Publication of the metal's optical constants.");
  m.def(
      "metal_optical_constants",
      [](const std::string& metal) {
        std::vector<double> rows;
        for (const auto& entry : optical_constants(parse_metal(metal)).entries) {
          rows.insert(rows.end(), {entry.wavelength, entry.eta, entry.k});
        }
        const std::size_t count = rows.size() / 3;
        return to_numpy(std::move(rows), {count, 3});
      },
      nb::arg("metal"), "float64 (n, 3): wavelength in nm, eta, k.");
}

void bind_metals(nb::module_& m) {
  m.def(
      "metal_reflectance",
      [](const std::string& metal, Values<double> c, Illuminant illuminant) {
        const Metal parsed = parse_metal(metal);
        std::vector<double> rgb(3 * c.size());
        {
          nb::gil_scoped_release release;
          for (std::size_t i = 0; i < c.size(); ++i) {
            const glm::dvec3 value = metal_reflectance(parsed, c.data()[i], illuminant);
            for (int channel = 0; channel < 3; ++channel) rgb[3 * i + channel] = value[channel];
          }
        }
        return to_numpy(std::move(rgb), {c.size(), 3});
      },
      nb::arg("metal"), nb::arg("c").noconvert(), nb::arg("illuminant"),
      "float64 (c.size, 3): linear Rec.709.");
  nb::class_<MetalFit>(m, "MetalFit",
                       "Three-channel models of a metal, and their largest error over all angles.")
      .def_prop_ro(
          "r0", [](const MetalFit& fit) { return triple(fit.schlick.r0); }, "of Schlick's model")
      .def_prop_ro("r0_error", [](const MetalFit& fit) { return triple(fit.schlick_error); })
      .def_prop_ro(
          "eta", [](const MetalFit& fit) { return triple(fit.conductor.eta); }, "of the conductor")
      .def_prop_ro(
          "k", [](const MetalFit& fit) { return triple(fit.conductor.k); }, "of the conductor")
      .def_prop_ro("index_error", [](const MetalFit& fit) { return triple(fit.conductor_error); });
  m.def(
      "fit_metal",
      [](const std::string& metal, Illuminant illuminant) {
        return fit_metal(parse_metal(metal), illuminant);
      },
      nb::arg("metal"), nb::arg("illuminant"));

  m.def(
      "active_isa", [] { return std::string(to_string(active_isa())); },
      "Instruction set in use: 'baseline', 'sse42', 'avx2' or 'avx512'.");
}

}  // namespace

void bind_shading(nb::module_& m) {
  bind_formulas(m);
  bind_tables(m);
  bind_metals(m);
}

}  // namespace mirrorbake::bindings
