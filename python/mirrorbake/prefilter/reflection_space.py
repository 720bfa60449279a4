"""View-dependent radiance maps of any isotropic BRDF, warped and blended: [RSI].

A radiance map is a sphere map of what a ball of some material shows to a viewer far away. Maps for the
corners of an icosahedron are made ahead; the map of any other view is those of the three corners around it,
each warped so that its features lie where they belong, and blended by spherical barycentric weights.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.envmap import EnvMap
from mirrorbake.projection import texel_directions, texel_solid_angles

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    Brdf = Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]

WARPS = ("mirror", "normal")


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
        1/steradian.
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
        weight = brdf(n_v, np.where(lit, n_l, 1.0), (lights @ frame[:, 2])[None, :]) * np.where(lit, n_l, 0)
        result[row] = weight @ power
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

    def at(self, view: ArrayLike, *, warp: str = "mirror", size: int | None = None) -> EnvMap:
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

        Raises
        ------
        InvalidArgument
            For another warp, and a view that is not finite or zero.
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
        normals = _normals(side) @ frame.T
        mirrored = 2 * (normals @ v)[..., None] * normals - v
        total = np.zeros((side, side, self.maps[0].layout.channels))
        trust = np.zeros((side, side, 1))
        for corner, weight in zip(triangle, weights, strict=True):
            source = view_frame(self.views[corner])
            if warp == "mirror":
                local = mirrored @ source
                # Pinched where the source reflects straight backwards: |v + r| is 2 n·v of the source.
                confidence = np.clip(np.linalg.norm(local + np.array([0.0, 0.0, 1.0]), axis=-1) / 0.4, 0, 1)
            else:
                n = normals @ source
                local = 2 * n[..., 2:] * n - [0, 0, 1]
                confidence = np.clip(n[..., 2] / 0.2, 0, 1)  # a map has no normals that face away
            usable = np.where((confidence > 0)[..., None], local, [0, 0, 1]).astype(np.float32)
            share = (weight * confidence**2 + 1e-9 * weight)[..., None]
            total += share * self.maps[corner].sample(usable)
            trust += share
        return EnvMap.from_array((total / trust).astype(np.float32), "sphere_map", self.maps[0].channels)


def _normals(size: int) -> NDArray[np.float64]:
    # g_normal of [RSI] §3.3; texels outside of the disc have the normals of its rim.
    place = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = np.meshgrid(place, -place)
    radius = np.hypot(x, y)
    shrink = np.where(radius > 1, 1 / np.maximum(radius, 1e-12), 1)
    x, y = x * shrink, y * shrink
    return np.stack([x, y, np.sqrt(np.maximum(0, 1 - x * x - y * y))], axis=-1)
