#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bind.hpp"
#include "bind_proxy.hpp"
#include "mirrorbake/proxy/choose.hpp"
#include "mirrorbake/proxy/fit.hpp"
#include "mirrorbake/proxy/hull.hpp"

namespace mirrorbake::bindings {
namespace {

void bind_fits(nb::module_& m) {
  m.def(
      "area_weighted_centroid",
      [](PointArray positions, TriangleArray triangles) {
        nb::gil_scoped_release release;
        return area_weighted_centroid(points(positions), indices(triangles));
      },
      nb::arg("positions"), nb::arg("triangles"),
      R"(Area-weighted mean of the triangles' centroids: the origin of an object's maps ([PEM] section
4).

`positions` (n, 3) in metres, `triangles` (m, 3) indices. Returns (x, y, z). Raises InvalidArgument for
indices out of range and for meshes without area.)");
  m.def(
      "fit_ellipsoid",
      [](PointArray array, glm::vec3 centre, std::optional<glm::vec3> origin) {
        nb::gil_scoped_release release;
        return make_proxy(fit_ellipsoid(points(array), centre), origin.value_or(centre));
      },
      nb::arg("points"), nb::arg("centre"), nb::arg("origin") = nb::none(),
      R"(Minimum-volume axis-aligned ellipsoid around `centre` that encloses every point, to a relative
volume of 1e-6.

`points` (n, 3). `origin` of the returned Proxy defaults to `centre`. Flat input gets radii of at least
1e-4 of the largest extent. Raises InvalidArgument if all points lie at the centre.)");
  m.def(
      "fit_box_mean_distance",
      [](PointArray hits, glm::vec3 origin, float floor) {
        nb::gil_scoped_release release;
        return make_proxy(fit_box_mean_distance(points(hits), origin, floor), origin);
      },
      nb::arg("hits"), nb::arg("origin"), nb::arg("floor"),
      R"(Box by [PEM] section 4: bottom on the plane y = `floor`, the other sides at the mean distance of
the hits on that side.

`hits` (n, 3): where rays from around the object meet the surroundings. Returns a Proxy with the given
origin.)");
  m.def(
      "fit_box_robust",
      [](PointArray hits, glm::vec3 origin) {
        nb::gil_scoped_release release;
        return make_proxy(fit_box_robust(points(hits), origin), origin);
      },
      nb::arg("hits"), nb::arg("origin"),
      R"(Axis-aligned box around `origin` that fits the hits best, by robust (Huber) least squares of
their distances to its surface.

`hits` (n, 3). Returns a Proxy with the given origin.)");
}

void bind_choice(nb::module_& m) {
  m.def("proxy_families", &proxy_families,
        "Names of the families of shapes that choose_proxy() fits, in rising order of parameters.");
  nb::class_<ProxyCandidate>(m, "ProxyCandidate", "A shape that choose_proxy() fitted.")
      .def_ro("name", &ProxyCandidate::name, "One of proxy_families().")
      .def_ro("parameters", &ProxyCandidate::parameters, "Numbers that the fit sets.")
      .def_ro("proxy", &ProxyCandidate::proxy, "The shape, fitted to all views.")
      .def_ro("fit_error", &ProxyCandidate::fit_error, "Mean angle over the rays of the fit, radians.")
      .def_ro("off_view_error", &ProxyCandidate::off_view_error,
              "Predicted mean angle in other views, by cross-validation over the views, radians.");
  nb::class_<ProxyChoice>(m, "ProxyChoice", "What choose_proxy() found.")
      .def_ro("candidates", &ProxyChoice::candidates, "All shapes, in rising order of parameters.")
      .def_prop_ro("best", &ProxyChoice::best, "The chosen candidate.")
      .def_ro("reason", &ProxyChoice::reason, "Why, in a sentence.");
  m.def(
      "choose_proxy",
      [](PointArray positions, PointArray directions,
         nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu> distances,
         nb::ndarray<const int, nb::ndim<1>, nb::c_contig, nb::device::cpu> views, glm::vec3 origin,
         double tolerance, double negligible_angle, std::size_t max_rays_per_view) {
        const TracedRays rays = {points(positions),
                                 points(directions),
                                 {distances.data(), distances.size()},
                                 {views.data(), views.size()}};
        const ProxyChoiceOptions options = {tolerance, negligible_angle, max_rays_per_view};
        nb::gil_scoped_release release;
        return choose_proxy(rays, origin, options);
      },
      nb::arg("positions"), nb::arg("directions"), nb::arg("distances"), nb::arg("views"), nb::arg("origin"),
      nb::arg("tolerance") = ProxyChoiceOptions{}.tolerance,
      nb::arg("negligible_angle") = ProxyChoiceOptions{}.negligible_angle,
      nb::arg("max_rays_per_view") = ProxyChoiceOptions{}.max_rays_per_view,
      R"(Chooses the geometry of a map from traced reflections of a few views.

Fits every shape, predicts how far off its lookups are in views that it was not fitted to (each view is left out in
turn; a single one is cut in two) and takes the simplest shape within `tolerance` of the best.

Parameters
----------
positions, directions
    (n, 3): rays as they leave the object, world space, metres.
distances
    (n,): to the surroundings, metres, > 0; inf for rays that leave the scene.
views
    (n,) integers: the view of each ray.
origin
    Of the map, world space.
tolerance
    Relative excess of error at which a simpler shape is still preferred.
negligible_angle
    Errors below it do not count, radians; the default is a tenth of a texel of a cube map of 256 x 256 x 6.
max_rays_per_view
    Of each view at most so many rays, evenly spaced, are used.

Returns
-------
    ProxyChoice with `best`, `reason` and all `candidates`.

Raises
------
InvalidArgument
    Arrays of different length, fewer than 16 rays, values that are not usable (the index is named).)");
  m.def(
      "hull_triangles",
      [](PointArray positions, TriangleArray triangles, double tolerance) {
        std::vector<std::uint8_t> on_hull;
        {
          nb::gil_scoped_release release;
          on_hull = hull_triangles(points(positions), indices(triangles), tolerance);
        }
        return to_numpy(std::move(on_hull), {triangles.shape(0)});
      },
      nb::arg("positions"), nb::arg("triangles"), nb::arg("tolerance") = kHullTolerance,
      R"(1 for every triangle that lies on the mesh's convex hull, else 0; see
mirrorbake.proxy.hull_triangles.)");
}

}  // namespace

void bind_proxy_fits(nb::module_& m) {
  bind_fits(m);
  bind_choice(m);
}

}  // namespace mirrorbake::bindings
