"""Proxy geometry from Python: shapes, lookups against NumPy in float64, fits against SciPy's solver."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize
from scipy.spatial import ConvexHull

from mirrorbake.proxy import (
    Proxy,
    area_weighted_centroid,
    choose_proxy,
    fit_box_mean_distance,
    fit_box_robust,
    fit_ellipsoid,
    hull_triangles,
    mirror_lookups,
    proxy_to_attributes,
)

# Orthonormal in exact decimals.
ROTATION = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]], np.float32)


def angles(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Angle between rows, well conditioned for small ones."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    sine: NDArray[np.float64] = np.linalg.norm(np.cross(a, b), axis=-1)
    angle: NDArray[np.float64] = np.arctan2(sine, np.sum(a * b, axis=-1))
    return angle


def test_fields_and_kinds() -> None:
    box = Proxy.box((1, 2, 3), (4, 5, 6), origin=(1, 2, 4), axes=ROTATION)
    assert box.kind == "box"
    assert box.centre == (1, 2, 3)
    assert box.half_extent == (4, 5, 6)
    assert box.origin == (1, 2, 4)
    np.testing.assert_allclose(box.axes, ROTATION, atol=1e-7)
    assert not hasattr(box, "radii")
    ellipsoid = Proxy.ellipsoid((1, 2, 3), (4, 5, 6))
    assert (ellipsoid.kind, ellipsoid.radii, ellipsoid.origin) == ("ellipsoid", (4, 5, 6), (1, 2, 3))
    assert Proxy.sphere((0, 0, 0), 2).radii == (2, 2, 2)
    dome = Proxy.hemisphere((0, 0, 0), 2, (0, 1, 0))
    assert (dome.kind, dome.radius) == ("hemisphere", 2)
    infinite = Proxy.infinite()
    assert (infinite.kind, infinite.origin) == ("infinite", (0, 0, 0))
    with pytest.raises(AttributeError, match="'infinite' has no centre"):
        _ = infinite.centre
    assert repr(ellipsoid).startswith("Proxy(kind='ellipsoid', centre=(1.0, 2.0, 3.0)")
    ellipsoid.validate()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_lookups_equal_numpy_in_float64(dtype: type) -> None:
    rng = np.random.default_rng(1)
    extent, centre, origin = (1.0, 2.0, 0.5), (3.0, -1.0, 0.25), (3.25, -1.0, 0.25)
    local = rng.uniform(-0.5, 0.5, (500, 3)) * extent
    d: NDArray[Any] = rng.normal(size=(500, 3)).astype(dtype)
    p: NDArray[Any] = (centre + local @ ROTATION).astype(dtype)
    p64, d64 = p.astype(np.float64), d.astype(np.float64)
    rotation = ROTATION.astype(np.float64)
    q, e = (p64 - centre) @ rotation.T, d64 @ rotation.T
    t_box = np.min((np.sign(e) * np.array(extent) - q) / e, axis=1)
    a, b, c = [np.sum(x, 1) for x in ((e / extent) ** 2, e * q / np.square(extent), (q / extent) ** 2)]
    t_ellipsoid = (-b + np.sqrt(b * b - a * (c - 1))) / a
    for proxy, t in [
        (Proxy.box(centre, extent, origin, ROTATION), t_box),
        (Proxy.ellipsoid(centre, extent, origin, ROTATION), t_ellipsoid),
    ]:
        lookup: NDArray[np.float32] | NDArray[np.float64]
        lookup = proxy.lookup(p, d) if dtype == np.float32 else proxy.lookup_float64(p, d)
        assert lookup.dtype == dtype
        expected = p64 + t[:, None] * d64 - origin
        # Half an ulp per component after rounding to float32; the conditioning of the roots in float64.
        assert angles(lookup, expected).max() < (2e-7 if dtype == np.float32 else 1e-13)


def test_lookup_keeps_the_shape_of_its_input() -> None:
    proxy = Proxy.sphere((0, 0, 0), 1)
    d = np.random.default_rng(2).normal(size=(4, 5, 3)).astype(np.float32)
    lookup = proxy.lookup(np.zeros_like(d), d)
    assert lookup.shape == (4, 5, 3)
    np.testing.assert_allclose(lookup, d / np.linalg.norm(d, axis=-1, keepdims=True), rtol=1e-6)
    assert proxy.lookup(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)).shape == (0, 3)


def test_hemisphere_has_a_floor_and_a_dome() -> None:
    dome = Proxy.hemisphere((0, 0, 0), 2, (0, 1, 0))
    lookups = dome.lookup(
        np.array([[0, 1, 0]] * 3, np.float32), np.array([[0, 1, 0], [0, -1, 0], [1, -1, 0]], np.float32)
    )
    np.testing.assert_array_equal(lookups, [[0, 1, 0], [0, -1, 0], [1, -1, 0]])


def test_bad_input_is_named() -> None:
    proxy = Proxy.sphere((0, 0, 0), 1)
    zeros = np.zeros((2, 3), np.float32)
    with pytest.raises(ValueError, match=r"directions .* shape"):
        proxy.lookup(zeros, np.zeros((3, 3), np.float32))
    with pytest.raises(ValueError, match=r"positions .*shape \(2, 2\)"):
        proxy.lookup(zeros[:, :2], zeros[:, :2])
    with pytest.raises(ValueError, match=r"directions is \(0, nan, 1\) in row 1"):
        proxy.lookup(zeros, np.array([[0, 0, 1], [0, np.nan, 1]], np.float32))
    with pytest.raises(ValueError, match="half_extent"):
        Proxy.box((0, 0, 0), (1, -1, 1))
    with pytest.raises(ValueError, match="origin"):
        Proxy.ellipsoid((0, 0, 0), (1, 1, 1), origin=(1, 1, 1))
    with pytest.raises(ValueError, match="orthonormal"):
        Proxy.box((0, 0, 0), (1, 1, 1), axes=2 * np.eye(3, dtype=np.float32))


def test_area_weighted_centroid_weighs_by_area() -> None:
    corners = [[0, 0, 0], [3, 0, 0], [0, 3, 0], [10, 0, 0], [13, 0, 0], [10, 6, 0]]
    positions = np.array(corners, np.float32)
    centroid = area_weighted_centroid(positions, np.array([[0, 1, 2], [3, 4, 5]], np.uint32))
    np.testing.assert_allclose(centroid, [(1 * 1 + 2 * 11) / 3, (1 * 1 + 2 * 2) / 3, 0], rtol=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_fit_ellipsoid_is_the_optimum_of_an_independent_convex_solver(seed: int) -> None:
    """At most 1e-6 of volume above SLSQP's optimum of the same convex problem, every vertex inside."""
    rng = np.random.default_rng(seed)
    scale = np.array([1.0, 10.0 ** rng.uniform(-2, 2), 0.3])
    points = (rng.standard_normal((400, 3)) * scale).astype(np.float32)
    centre = tuple((0.1 * scale).astype(np.float32).tolist())
    radii = np.array(fit_ellipsoid(points, centre).radii, np.float64)

    squares = (points.astype(np.float64) - centre) ** 2
    assert np.max(squares @ (1 / radii**2)) <= 1.0
    unit = squares.max(axis=0)
    x = squares / unit
    solution = minimize(
        lambda w: -np.sum(np.log(w)),
        np.full(3, 0.3),
        jac=lambda w: -1 / w,
        method="SLSQP",
        bounds=[(1e-3, 2)] * 3,
        constraints={"type": "ineq", "fun": lambda w: 1 - x @ w, "jac": lambda w: -x},
        options={"ftol": 1e-15, "maxiter": 500},
    )
    w = solution.x / np.max(x @ solution.x)  # feasible, so never below the true optimum
    independent = np.prod(np.sqrt(unit / w))
    assert np.prod(radii) <= independent * (1 + 1e-6)
    # ... and not below it by more than SLSQP's own error, which would mean that the constraints differ.
    assert np.prod(radii) >= independent * (1 - 1e-5)


def test_fit_boxes_find_the_room() -> None:
    rng = np.random.default_rng(3)
    room = Proxy.box((0.5, 1.0, -0.5), (3, 1.5, 2), origin=(0, 0.2, 0))
    d = rng.normal(size=(3000, 3)).astype(np.float32)
    start = np.zeros_like(d) + np.array(room.origin, np.float32)
    hits = room.lookup(start, d) + start
    robust = fit_box_robust(hits, room.origin)
    np.testing.assert_allclose(robust.centre, room.centre, atol=1e-3)
    np.testing.assert_allclose(robust.half_extent, room.half_extent, atol=1e-3)
    assert robust.origin == room.origin
    mean = fit_box_mean_distance(hits, room.origin, -0.5)
    assert mean.centre[1] - mean.half_extent[1] == pytest.approx(-0.5, abs=1e-6)


def test_mirror_lookups_follow_the_reflection_of_the_eyes_ray() -> None:
    """Against r = 2(n·v)n − v in NumPy, float64, normals of any length; per pixel as well as per vertex."""
    rng = np.random.default_rng(5)
    proxy = Proxy.box((0, 0, 0), (2, 3, 4), origin=(0.5, 0, 0))
    eye = (5.0, 6.0, 7.0)
    p = rng.uniform(-1, 1, (6, 7, 3)).astype(np.float32)
    n = rng.normal(size=(6, 7, 3)).astype(np.float32)
    v = np.array(eye) - p
    unit = n / np.linalg.norm(n.astype(np.float64), axis=-1, keepdims=True)
    r = 2 * np.sum(unit * v, axis=-1, keepdims=True) * unit - v
    expected = proxy.lookup_float64(p.astype(np.float64), r)
    lookup = proxy.mirror_lookup(eye, p, n)
    assert lookup.shape == (6, 7, 3)
    assert angles(lookup, expected).max() < 2e-7
    with pytest.raises(ValueError, match="normals"):
        proxy.mirror_lookup(eye, p, n[:3])


def test_mirror_lookups_of_several_layers_are_those_of_each() -> None:
    rng = np.random.default_rng(8)
    proxies = [
        Proxy.box((0, 0, 0), (2, 3, 4), origin=(0.5, 0, 0)),
        Proxy.infinite(),
        Proxy.ellipsoid((0.1, 0, 0), (3, 2, 2.5)),
    ]
    eye = (5.0, 6.0, 7.0)
    p = rng.uniform(-1, 1, (6, 7, 3)).astype(np.float32)
    n = rng.normal(size=(6, 7, 3)).astype(np.float32)
    layers = mirror_lookups(proxies, eye, p, n)
    assert layers.shape == (3, 6, 7, 3)
    for layer, proxy in zip(layers, proxies, strict=True):
        np.testing.assert_array_equal(layer, proxy.mirror_lookup(eye, p, n))
    with pytest.raises(ValueError, match=r"proxies.*empty"):
        mirror_lookups([], eye, p, n)


def test_hull_triangles_are_those_of_qhull() -> None:
    """A sphere with dents: facets that Qhull reports, and no others, have all vertices behind them."""
    rng = np.random.default_rng(6)
    d = rng.normal(size=(600, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    facets = ConvexHull(d).simplices  # triangulates the sphere
    outward = np.einsum(
        "ij,ij->i",
        np.cross(d[facets[:, 1]] - d[facets[:, 0]], d[facets[:, 2]] - d[facets[:, 0]]),
        d[facets].mean(axis=1),
    )
    facets[outward < 0] = facets[outward < 0][:, ::-1]
    depth = np.where(rng.uniform(size=(600, 1)) < 0.2, rng.uniform(0.8, 0.95, (600, 1)), 1.0)
    points = (d * depth).astype(np.float32)
    triangles = facets.astype(np.uint32)
    hull = {frozenset(simplex) for simplex in ConvexHull(points).simplices.tolist()}
    expected = np.array([frozenset(t) in hull for t in triangles.tolist()])
    assert 100 < expected.sum() < 800
    np.testing.assert_array_equal(hull_triangles(points, triangles, tolerance=1e-7), expected)


def test_hull_of_a_flat_mesh_needs_no_volume() -> None:
    x, y = np.meshgrid(np.arange(10.0), np.arange(10.0))
    points = np.stack([x.ravel(), np.zeros(100), y.ravel()], axis=1).astype(np.float32)
    triangles = np.array([[0, 10, 1], [0, 1, 10], [0, 0, 1]], np.uint32)
    np.testing.assert_array_equal(hull_triangles(points, triangles), [True, True, False])


def test_choose_proxy_takes_the_room_and_says_why() -> None:
    rng = np.random.default_rng(7)
    room = Proxy.box((0.5, 1.0, -0.5), (3, 1.5, 2), origin=(0, 0, 0))
    positions = rng.uniform(-0.2, 0.2, (1200, 3)).astype(np.float32)
    directions = rng.normal(size=(1200, 3)).astype(np.float32)
    hits = room.lookup(positions, directions)
    distances = np.linalg.norm(hits - positions, axis=1)
    views = (np.arange(1200) % 3).astype(np.int32)
    choice = choose_proxy(positions, directions, distances, views, origin=(0, 0, 0))
    assert choice.best.name == "box"
    assert choice.reason.startswith("box: predicted off-view error")
    assert choice.best.proxy.kind == "box"
    np.testing.assert_allclose(choice.best.proxy.half_extent, (3, 1.5, 2), rtol=1e-4)
    assert [c.parameters for c in choice.candidates] == [0, 4, 4, 6, 6, 9, 9]
    assert choice.best.fit_error < 1e-5
    assert choice.best.off_view_error < 1e-5
    far = np.full(1200, np.inf, np.float32)
    assert choose_proxy(positions, directions, far, views, origin=(0, 0, 0)).best.name == "infinite"
    with pytest.raises(ValueError, match="at least 16"):
        choose_proxy(positions[:3], directions[:3], far[:3], views[:3], origin=(0, 0, 0))


@pytest.mark.parametrize(
    "proxy",
    [
        Proxy.infinite((0, 1, 0)),
        Proxy.box(
            (0, 1, 0), (3, 1, 2), (0, 0.5, 0), axes=np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], np.float32)
        ),
        Proxy.ellipsoid((0, 1, 0), (3, 1, 2)),
        Proxy.hemisphere((0, 0, 0), 2, (0, 0.5, 0)),
    ],
    ids=lambda proxy: proxy.kind,
)
def test_proxies_pickle_and_copy(proxy: Proxy) -> None:
    for again in (pickle.loads(pickle.dumps(proxy)), copy.copy(proxy), copy.deepcopy(proxy)):
        assert proxy_to_attributes(again) == proxy_to_attributes(proxy)
