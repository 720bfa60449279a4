"""View-dependent radiance maps of any isotropic BRDF, warped and blended: [RSI].

A radiance map is a sphere map of what a ball of some material shows to a viewer far away. Maps for the
corners of an icosahedron are made ahead; the map of any other view is those of the three corners around it,
each warped so that its features lie where they belong, and blended by spherical barycentric weights.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from scipy.spatial import Delaunay

from mirrorbake import _core
from mirrorbake.envmap import EnvMap
from mirrorbake.projection import (
    directions_from_points,
    points_from_directions,
    texel_directions,
    texel_solid_angles,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    Brdf = Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]

Warp: TypeAlias = Literal["mirror", "normal"]

WARPS: tuple[Warp, ...] = ("mirror", "normal")


def geodesic(refinements: int = 0) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Unit corners (n, 3) and triangles (m, 3) of an icosahedron whose triangles are cut into four.

    >>> [len(geodesic(level)[0]) for level in (0, 1, 2)]
    [12, 42, 162]
    """
    if not 0 <= refinements <= 4:
        raise _core.InvalidArgument(f"refinements is {refinements}, expected 0 to 4")
    golden = (1 + 5**0.5) / 2
    signs = [(a, b * golden) for a in (-1, 1) for b in (-1, 1)]
    corners = [np.roll([0, a, b], turn) for turn in range(3) for a, b in signs]
    points = [np.array(p) / np.linalg.norm(p) for p in corners]
    near = np.array(points) @ np.array(points).T > 0.4  # corners of one edge: 1/√5
    triangles = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if near[i, j] and near[j, k] and near[i, k]
    ]
    for _ in range(refinements):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, middles: dict[tuple[int, int], int] = middles) -> int:
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(points)
                points.append((points[a] + points[b]) / np.linalg.norm(points[a] + points[b]))
            return middles[key]

        finer = []
        for i, j, k in triangles:
            a, b, c = middle(i, j), middle(j, k), middle(k, i)
            finer += [(i, a, c), (a, j, b), (c, b, k), (a, b, c)]
        triangles = finer
    return np.array(points), np.array(triangles, np.int64)


def spherical_weights(triangle: ArrayLike, view: ArrayLike) -> NDArray[np.float64]:
    """Weights (3,) of a direction in a spherical triangle: areas opposite to its corners over their sum.

    [RSI] §3.4; areas by the spherical excess, in the form of van Oosterom and Strackee, 1983, which has no
    arc cosines of rounded numbers.

    >>> spherical_weights(np.eye(3), np.ones(3) / 3**0.5).round(6).tolist()
    [0.333333, 0.333333, 0.333333]
    """
    corners, v = np.asarray(triangle, np.float64), np.asarray(view, np.float64)

    def area(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> float:
        return float(2 * np.arctan2(abs(a @ np.cross(b, c)), 1 + a @ b + b @ c + c @ a))

    weights = np.array([area(v, corners[(i + 1) % 3], corners[(i + 2) % 3]) for i in range(3)])
    total = weights.sum()
    if total == 0:  # a triangle without area
        return np.full(3, 1 / 3)
    normalised: NDArray[np.float64] = weights / total
    return normalised


def view_frame(view: ArrayLike) -> NDArray[np.float64]:
    """Columns right, up and towards the viewer, of a map seen from a direction of any length above 0."""
    v = np.asarray(view, np.float64)
    length = np.linalg.norm(v)
    if v.shape != (3,) or not 0 < length < np.inf:
        raise _core.InvalidArgument(f"view is {view!r}, expected three finite numbers that are not all 0")
    z = v / length
    up = np.array([0.0, 1.0, 0.0]) if abs(z[1]) < 0.99 else np.array([0.0, 0.0, -1.0])
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def radiance_map(envmap: EnvMap, brdf: Brdf, view: ArrayLike, size: int = 64) -> EnvMap:
    """Sphere map of ∫ f (n·l) L dω by the normal, for one viewer, from every texel of the map.

    Parameters
    ----------
    envmap
        Of a few thousand texels: the work is theirs times those of the result. `EnvMap.resample` makes it
        smaller.
    brdf
        Called with the cosines n·v, n·l and v·l as arrays that broadcast, the first two above 0; returns
        1/steradian, of all channels alike or, in one dimension more, of each.
    view
        Direction towards the viewer.
    size
        Texels of a side.
    """
    frame = view_frame(view)
    layout = envmap.layout
    lights = np.concatenate(
        [
            texel_directions(layout.projection, layout.width, layout.height, face).reshape(-1, 3)
            for face in range(layout.faces)
        ]
    ).astype(np.float64)
    angles = np.tile(texel_solid_angles(layout.projection, layout.width, layout.height).ravel(), layout.faces)
    power = angles[:, None] * envmap.level().reshape(-1, layout.channels).astype(np.float64)
    normals = _normals(size) @ frame.T
    result = np.zeros((size, size, layout.channels))
    for row in range(size):
        n_v = np.maximum(normals[row] @ frame[:, 2], 1e-6)[:, None]
        n_l = normals[row] @ lights.T
        lit = n_l > 0
        value = brdf(n_v, np.where(lit, n_l, 1.0), (lights @ frame[:, 2])[None, :])
        cosine = np.where(lit, n_l, 0)
        if value.ndim > cosine.ndim:
            result[row] = np.einsum("nlc,nl,lc->nc", value, cosine, power, optimize=True)
        else:
            result[row] = (value * cosine) @ power
    return EnvMap.from_array(result.astype(np.float32), "sphere_map", envmap.channels)


@dataclass(frozen=True, eq=False)
class RadianceMaps:
    """Radiance maps of one material in one environment for the corners of a geodesic sphere.

    Attributes
    ----------
    views, triangles
        Corners (n, 3) and triangles (m, 3), as `geodesic` gives them.
    maps
        A sphere map for each corner.
    """

    views: NDArray[np.float64]
    triangles: NDArray[np.int64]
    maps: list[EnvMap]

    @classmethod
    def make(cls, envmap: EnvMap, brdf: Brdf, size: int = 64, refinements: int = 0) -> RadianceMaps:
        """Make all maps; see `radiance_map` and `geodesic`."""
        views, triangles = geodesic(refinements)
        return cls(views, triangles, [radiance_map(envmap, brdf, view, size) for view in views])

    def at(
        self, view: ArrayLike, *, warp: Warp = "mirror", size: int | None = None, rings: int | None = None
    ) -> EnvMap:
        """Return the map for a viewer in any direction: three maps, warped and blended.

        Parameters
        ----------
        view
            Direction towards the viewer.
        warp
            ``mirror`` for glossy materials, whose features lie in the reflected direction; ``normal`` for
            diffuse ones.
        size
            Texels of a side; by default those of the maps.
        rings
            The warp is worked out at the vertices of a disc of so many rings, 2 to 256, denser towards its
            edge, and linear between them, as graphics hardware draws it ([RSI] §3.3); None: for every texel.

        Raises
        ------
        InvalidArgument
            For another warp or number of rings, and a view that is not finite or zero.
        """
        if warp not in WARPS:
            raise _core.InvalidArgument(f"warp is {warp!r}, expected {' or '.join(WARPS)}")
        frame = view_frame(view)
        v = frame[:, 2]
        # The triangle around the view lies on its inner side of all three edges.
        corners = self.views[self.triangles]
        inside = np.stack(
            [np.einsum("mi,i->m", np.cross(corners[:, i], corners[:, (i + 1) % 3]), v) for i in range(3)], 1
        )
        inside *= np.sign(np.linalg.det(corners))[:, None]
        triangle = self.triangles[int(np.argmax(inside.min(1)))]
        weights = spherical_weights(self.views[triangle], v)
        side = size or self.maps[0].layout.width
        mesh = None if rings is None else _Disc.make(rings, side)
        normals = (_normals(side) if mesh is None else mesh.normals) @ frame.T
        total = np.zeros((side, side, self.maps[0].layout.channels))
        trust = np.zeros((side, side, 1))
        for corner, weight in zip(triangle, weights, strict=True):
            local, confidence = _warped(warp, normals, v, view_frame(self.views[corner]))
            if mesh is not None:
                local, confidence = mesh.between(local, confidence)
            usable = np.where((confidence > 0)[..., None], local, [0, 0, 1]).astype(np.float32)
            share = (weight * confidence**2 + 1e-9 * weight)[..., None]
            total += share * self.maps[corner].sample(usable)
            trust += share
        return EnvMap.from_array((total / trust).astype(np.float32), "sphere_map", self.maps[0].channels)


def between_views(
    envmap: EnvMap, brdf: Brdf, size: int = 32, refinements: int = 0, steps: int = 4, *, warp: Warp = "mirror"
) -> list[tuple[float, float]]:
    """How good warped maps are on the way from a corner of the sphere to the middle of a triangle.

    Parameters
    ----------
    envmap, brdf, size, refinements
        As for `RadianceMaps.make`.
    steps
        Views on the way after the first, 1 or more.
    warp
        As for `RadianceMaps.at`.

    Returns
    -------
    list of (degrees, dB)
        The angle from the corner, and the peak signal-to-noise ratio against `radiance_map` of that view
        within the disc; of the corner itself it is that of reading the map between its texels.
    """
    views, triangles = geodesic(refinements)
    corners = views[triangles[0]]
    seen = [radiance_map(envmap, brdf, corner, size) for corner in corners]
    maps = RadianceMaps(corners, np.arange(3)[None], seen)
    middle = corners.mean(0)
    inside = np.hypot(*np.meshgrid(*2 * [(np.arange(size) + 0.5) / size * 2 - 1])) < 0.95
    found = []
    for step in range(steps + 1):
        view = corners[0] + (middle - corners[0]) * step / steps
        expected = radiance_map(envmap, brdf, view, size).level()[inside].astype(np.float64)
        error = maps.at(view, warp=warp).level()[inside] - expected
        angle = np.degrees(np.arccos(np.clip(view @ corners[0] / np.linalg.norm(view), -1, 1)))
        noise = max(float(np.sqrt((error**2).mean())), 1e-9)
        found.append((float(angle), float(20 * np.log10(expected.max() / noise))))
    return found


def _warped(
    warp: str, normals: NDArray[np.float64], view: NDArray[np.float64], source: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    # Directions in which the map of a source is read for normals in the world, and how far it can be trusted.
    if warp == "mirror":
        mirrored = 2 * (normals @ view)[..., None] * normals - view
        local = mirrored @ source
        # Pinched where the source reflects straight backwards: |v + r| is 2 n·v of the source.
        return local, np.clip(np.linalg.norm(local + np.array([0.0, 0.0, 1.0]), axis=-1) / 0.4, 0, 1)
    n = normals @ source
    # A map has no normals that face away.
    return 2 * n[..., 2:] * n - [0, 0, 1], np.clip(n[..., 2] / 0.2, 0, 1)


@dataclass(frozen=True, eq=False)
class _Disc:
    """A disc of triangles that covers the texels of a sphere map.

    Attributes
    ----------
    normals
        Of the vertices (n, 3), in the space of the viewer.
    corners, weights
        Vertices (size, size, 3) and barycentric weights of every texel.
    """

    normals: NDArray[np.float64]
    corners: NDArray[np.int64]
    weights: NDArray[np.float64]

    @classmethod
    @lru_cache(maxsize=4)  # the same for every view
    def make(cls, rings: int, size: int) -> _Disc:
        if not 2 <= rings <= 256:
            raise _core.InvalidArgument(f"rings is {rings}, expected 2 to 256")
        # Radii sin(θ) of equal steps of the angle θ between normal and viewer: dense at the edge. The last
        # ring is widened, so that its chords lie outside of the disc.
        around = 4 * rings
        turn = 2 * np.pi * np.arange(around) / around
        radius = np.sin(np.pi / 2 * np.arange(1, rings + 1) / rings)
        edge = radius.copy()
        edge[-1] /= np.cos(np.pi / around)
        circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        places = np.concatenate([[[0.0, 0.0]], (edge[:, None, None] * circle).reshape(-1, 2)])
        flat = np.concatenate([[[0.0, 0.0]], (radius[:, None, None] * circle).reshape(-1, 2)])
        depth = np.sqrt(np.maximum(0, 1 - (flat**2).sum(-1)))
        triangles = Delaunay(places)
        normals = _normals(size)  # of texels beyond the edge those of the edge
        texels = normals[..., :2].reshape(-1, 2)
        found = np.maximum(triangles.find_simplex(texels), 0)
        transform = triangles.transform[found]
        two = np.einsum("nij,nj->ni", transform[:, :2], texels - transform[:, 2])
        weights = np.concatenate([two, 1 - two.sum(-1, keepdims=True)], axis=-1)
        return cls(
            np.concatenate([flat, depth[:, None]], axis=-1),
            triangles.simplices[found].reshape(size, size, 3).astype(np.int64),
            weights.reshape(size, size, 3),
        )

    def between(
        self, directions: NDArray[np.float64], confidence: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Texture coordinates and confidence of the vertices, interpolated at the texels."""
        _, points = points_from_directions("sphere_map", directions.astype(np.float32))
        place = (points[self.corners] * self.weights[..., None]).sum(-2)
        length = np.hypot(place[..., 0], place[..., 1])[..., None]
        place /= np.maximum(1, length)  # an edge's chord leaves no disc but by rounding
        trust: NDArray[np.float64] = (confidence[self.corners] * self.weights).sum(-1)
        read = directions_from_points("sphere_map", np.zeros(place.shape[:-1], np.int32), place)
        return read.astype(np.float64), np.clip(trust, 0, 1)


def _normals(size: int) -> NDArray[np.float64]:
    # g_normal of [RSI] §3.3; texels outside of the disc have the normals of its rim.
    place = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = np.meshgrid(place, -place)
    radius = np.hypot(x, y)
    shrink = np.where(radius > 1, 1 / np.maximum(radius, 1e-12), 1)
    x, y = x * shrink, y * shrink
    return np.stack([x, y, np.sqrt(np.maximum(0, 1 - x * x - y * y))], axis=-1)
