#include <nanobind/stl/string.h>

#include <string>
#include <vector>

#include "bind.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/projection/dual_paraboloid.hpp"
#include "mirrorbake/projection/projection.hpp"
#include "signature.hpp"

namespace mirrorbake::bindings {
namespace {

using FaceArray = nb::ndarray<const std::int32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using PositionArray = nb::ndarray<const float, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using Matrix3 = nb::ndarray<const float, nb::shape<3, 3>, nb::c_contig, nb::device::cpu>;

void bind_positions(nb::module_& m) {
  m.def(
      "points_from_directions",
      [](const std::string& projection, PointArray directions) {
        const Projection p = parse_projection(projection);
        std::vector<std::int32_t> faces(directions.shape(0));
        std::vector<glm::vec2> points(directions.shape(0));
        {
          nb::gil_scoped_release released;
          const std::size_t unusable = points_from_directions(
              p, {reinterpret_cast<const glm::vec3*>(directions.data()), directions.shape(0)}, faces, points);
          if (unusable > 0) {
            throw InvalidArgument("directions", std::to_string(unusable) + " NaN, infinite or zero vectors",
                                  "finite vectors of a length above 0");
          }
        }
        const std::size_t count = faces.size();
        return nb::make_tuple(to_numpy(std::move(faces), {count}), vectors_to_numpy(std::move(points)));
      },
      nb::arg("projection"), nb::arg("directions"),
      signature<R"(def points_from_directions(projection: str, directions: NDArray[numpy.float32]) ->
tuple[NDArray[numpy.int32], NDArray[numpy.float32]])">(),
      R"(Faces (n) and positions (n, 2), x to the right and y up in [-1, 1], of directions (n, 3). Raises
InvalidArgument for NaN, infinite and zero directions.)");
  m.def(
      "directions_from_points",
      [](const std::string& projection, FaceArray faces, PositionArray points) {
        const Projection p = parse_projection(projection);
        std::vector<glm::vec3> directions(points.shape(0));
        {
          nb::gil_scoped_release released;
          directions_from_points(p, {faces.data(), faces.shape(0)},
                                 {reinterpret_cast<const glm::vec2*>(points.data()), points.shape(0)},
                                 directions);
        }
        return vectors_to_numpy(std::move(directions));
      },
      nb::arg("projection"), nb::arg("faces"), nb::arg("points"),
      R"(Unit directions (n, 3) at positions (n, 2) of faces (n). Raises InvalidArgument for faces that
do not exist and positions that are not finite.)");
}

void bind_texels(nb::module_& m) {
  m.def(
      "texel_solid_angles",
      [](const std::string& projection, int width, int height) {
        std::vector<double> angles = texel_solid_angles(parse_projection(projection), width, height);
        return to_numpy(std::move(angles),
                        {static_cast<std::size_t>(height), static_cast<std::size_t>(width)});
      },
      nb::arg("projection"), nb::arg("width"), nb::arg("height"),
      R"(Solid angles in steradians of the texels of a face, float64 of shape (height, width). Faces are
alike.)");
  m.def(
      "face_count", [](const std::string& projection) { return face_count(parse_projection(projection)); },
      nb::arg("projection"), "Faces of a map: 6 of a cube, 2 of dual paraboloids, else 1.");
  m.def(
      "natural_aspect",
      [](const std::string& projection) { return natural_aspect(parse_projection(projection)); },
      nb::arg("projection"), "Width over height that makes texels roughly square: 2 of panoramas, else 1.");
  m.def(
      "solid_angle_density",
      [](const std::string& projection, int face, double x, double y) {
        const Projection p = parse_projection(projection);
        if (face < 0 || face >= face_count(p)) {
          throw InvalidArgument("face", std::to_string(face), "0 to " + std::to_string(face_count(p) - 1));
        }
        return solid_angle_density(p, face, x, y);
      },
      nb::arg("projection"), nb::arg("face"), nb::arg("x"), nb::arg("y"),
      "Solid angle per unit of area of (x, y) at a position of a face, in steradians.");
  m.def(
      "dual_paraboloid_texture_matrix",
      [](Matrix3 frame_from_map, int face) {
        // NumPy's rows are GLM's columns.
        glm::mat3 matrix;
        for (int row = 0; row < 3; ++row) {
          for (int column = 0; column < 3; ++column) matrix[column][row] = frame_from_map(row, column);
        }
        const glm::mat4 texture = dual_paraboloid_texture_matrix(matrix, face);
        std::vector<float> rows;
        for (int row = 0; row < 4; ++row) {
          for (int column = 0; column < 4; ++column) rows.push_back(texture[column][row]);
        }
        return to_numpy(std::move(rows), {4, 4});
      },
      nb::arg("frame_from_map"), nb::arg("face"),
      R"(The 4x4 texture matrix of [EMT] eq. 9-12 for the front (0) or back (1) map: applied to (r, 1) it
gives (s q, t q, ., q), t downwards.)");
}

}  // namespace

void bind_projection(nb::module_& m) {
  bind_positions(m);
  bind_texels(m);
}

}  // namespace mirrorbake::bindings
