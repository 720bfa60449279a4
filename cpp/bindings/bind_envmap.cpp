#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <vector>

#include "bind.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/envmap.hpp"
#include "mirrorbake/envmap/resample.hpp"

namespace mirrorbake::bindings {
namespace {

using Matrix3 = nb::ndarray<const float, nb::shape<3, 3>, nb::c_contig, nb::device::cpu>;

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

}  // namespace

void bind_envmap(nb::module_& m) {
  nb::class_<EnvMapLayout>(
      m, "EnvMapLayout", "Order of the values of an environment map: levels, faces, rows, columns, channels.")
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
  m.def(
      "resample",
      [](const EnvMapLayout& layout, FloatArray values, const std::string& projection, int width, int height,
         const std::string& filter, Matrix3 source_from_target) {
        const ResampleOptions options{parse_resample_filter(filter), matrix(source_from_target)};
        const Projection target = parse_projection(projection);
        EnvMap result;
        {
          nb::gil_scoped_release released;
          result = resample(view(layout, values), target, width, height, options);
        }
        return block(std::move(result.values));
      },
      nb::arg("layout"), nb::arg("values"), nb::arg("projection"), nb::arg("width"), nb::arg("height"),
      nb::arg("filter"), nb::arg("source_from_target"),
      "The finest level in another projection and size: a block of one level.");
}

}  // namespace mirrorbake::bindings
