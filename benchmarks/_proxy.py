"""Proxy lookups of 40,000 vertices against NumPy expressions, and against reading and writing as much memory.

Mitsuba has no such kernel: its environment maps are infinitely far away.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import ConvexHull

from benchmarks._report import Case, require, seconds
from mirrorbake import _core
from mirrorbake.proxy import Proxy, fit_ellipsoid, mirror_lookups

if TYPE_CHECKING:
    from collections.abc import Iterator

COUNT = 40_000
REPETITIONS = 200
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]], np.float32)


def numpy_infinite(p: Any, d: Any) -> Any:
    return d.copy()


def numpy_box(proxy: Proxy, p: Any, d: Any) -> Any:
    q, e = (p - np.array(proxy.centre, np.float32)) @ proxy.axes.T, d @ proxy.axes.T
    t = np.min((np.copysign(np.array(proxy.half_extent, np.float32), e) - q) / e, axis=1)
    return p + t[:, None] * d - np.array(proxy.origin, np.float32)


def numpy_sphere_exit(q: Any, e: Any) -> Any:
    a, b, c = np.sum(e * e, axis=1), np.sum(q * e, axis=1), np.sum(q * q, axis=1) - 1
    return (np.sqrt(b * b - a * c) - b) / a


def numpy_ellipsoid(proxy: Proxy, p: Any, d: Any) -> Any:
    radii = np.array(proxy.radii, np.float32)
    q, e = (p - np.array(proxy.centre, np.float32)) @ proxy.axes.T / radii, d @ proxy.axes.T / radii
    return p + numpy_sphere_exit(q, e)[:, None] * d - np.array(proxy.origin, np.float32)


def numpy_hemisphere(proxy: Proxy, p: Any, d: Any) -> Any:
    radius = np.float32(proxy.radius)
    q, e = (p - np.array(proxy.centre, np.float32)) / radius, d / radius
    floor = np.where(e[:, 1] < 0, -q[:, 1] / e[:, 1], np.float32(np.inf))
    return p + np.minimum(numpy_sphere_exit(q, e), floor)[:, None] * d - np.array(proxy.origin, np.float32)


def angles(a: Any, b: Any) -> Any:
    a, b = a.astype(np.float64), b.astype(np.float64)
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))


def slsqp_radii(points: Any, centre: Any) -> Any:
    """Radii of the minimum-volume ellipsoid by a general solver: max log det W, W x² <= 1, W diagonal."""
    squares = (points.astype(np.float64) - np.asarray(centre, np.float64)) ** 2
    unit = squares.max(axis=0)
    x = squares / unit
    solution = minimize(
        lambda w: -np.sum(np.log(w)),
        np.full(3, 0.3),
        jac=lambda w: -1 / w,
        method="SLSQP",
        bounds=[(1e-3, 2)] * 3,
        constraints={"type": "ineq", "fun": lambda w: 1 - x @ w, "jac": lambda w: -x},
        options={"ftol": 1e-12, "maxiter": 200},
    )
    return np.sqrt(unit / solution.x * np.max(x @ solution.x))


def ellipsoid_fit() -> Case:
    rng = np.random.default_rng(2)
    points = (rng.standard_normal((COUNT, 3)) * (1.0, 0.4, 0.7)).astype(np.float32)
    # SciPy's solver takes a matrix of all constraints; only vertices of the convex hull can touch.
    hull = points[ConvexHull(points).vertices]
    centre = (0.05, -0.02, 0.1)
    radii, peer = np.array(fit_ellipsoid(points, centre).radii), slsqp_radii(hull, centre)
    excess = float(np.prod(radii) / np.prod(peer) - 1)
    require(abs(excess) < 1e-4, f"volumes of the ellipsoids differ by {excess}")

    def theirs() -> None:
        slsqp_radii(points[ConvexHull(points).vertices], centre)

    return Case(
        f"minimum-volume ellipsoid of {COUNT:,} vertices",
        "ms",
        1e3 * seconds(lambda: fit_ellipsoid(points, centre), 20),
        1e3 * seconds(theirs, 5),
        "SciPy Qhull + SLSQP",
        excess,
        0.0,
    )


def cases() -> Iterator[Case]:
    rng = np.random.default_rng(1)
    p = rng.uniform((-0.3, 0.2, -0.3), (0.3, 0.8, 0.3), (COUNT, 3)).astype(np.float32)
    d = rng.normal(size=(COUNT, 3)).astype(np.float32)
    centre, extent, origin = (0.0, 0.6, 0.0), (2.0, 1.5, 3.0), (0.1, 0.5, 0.0)
    box, ellipsoid = Proxy.box(centre, extent, origin), Proxy.ellipsoid(centre, extent, origin)
    turned_box = Proxy.box(centre, extent, origin, TURN)
    turned_ellipsoid = Proxy.ellipsoid(centre, extent, origin, TURN)
    sphere = Proxy.sphere(centre, 2, origin)
    dome = Proxy.hemisphere((0, 0, 0), 3, origin)
    shapes: dict[str, tuple[Proxy, Any]] = {
        "infinite sphere": (Proxy.infinite(), numpy_infinite),
        "sphere": (sphere, partial(numpy_ellipsoid, sphere)),
        "box": (box, partial(numpy_box, box)),
        "rotated box": (turned_box, partial(numpy_box, turned_box)),
        "ellipsoid": (ellipsoid, partial(numpy_ellipsoid, ellipsoid)),
        "rotated ellipsoid": (turned_ellipsoid, partial(numpy_ellipsoid, turned_ellipsoid)),
        "hemisphere": (dome, partial(numpy_hemisphere, dome)),
    }
    copied = np.empty_like(p)

    def copy() -> None:  # what a lookup has to read and write at least: two arrays in, one out
        np.add(p, d, out=copied)

    copy_time = seconds(copy, REPETITIONS)
    for threads in (1, 2):
        limit = _core.ThreadLimit(threads)
        for name, (proxy, peer) in shapes.items():
            exact = proxy.lookup_float64(p.astype(np.float64), d.astype(np.float64))
            error, peer_error = (float(angles(f(p, d), exact).max()) for f in (proxy.lookup, peer))
            require(error < 1e-6 and peer_error < 1e-3, f"{name}: {error} and {peer_error} rad off")
            ours = seconds(partial(proxy.lookup, p, d), REPETITIONS)
            theirs = seconds(partial(peer, p, d), 20)
            label = f"{name} lookup, {threads} thread{'s' if threads > 1 else ''}"
            yield Case(label, "ns", 1e9 * ours / COUNT, 1e9 * theirs / COUNT, "NumPy", error, peer_error)
            yield Case(
                label, "ns", 1e9 * ours / COUNT, 1e9 * copy_time / COUNT, "reading and writing", error, 0.0
            )

        def vertices() -> None:
            mirror_lookups((box, ellipsoid), (0, 1, 5), p, d)

        # [PEM] section 6: 35 ms per frame for the texture coordinates of this many vertices.
        time = seconds(vertices, REPETITIONS)
        yield Case(
            f"vertices' box and ellipsoid coordinates, {threads} thread{'s' if threads > 1 else ''}",
            "ms",
            1e3 * time,
            35.0,
            "[PEM], 733 MHz",
            0.0,
            0.0,
        )
        del limit
    yield ellipsoid_fit()
