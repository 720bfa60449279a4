"""Cuts a surface into few connected parts whose points do not get in each other's way in a map.

Points of one part whose normals are equal reflect in the same direction, seen from afar, and read the same
texel. Where they lie apart they want different things of it. A convex surface has no two such points; a
teapot's lid and body do, as do the two sides of its rim. So parts are chosen such that equal normals of a
part lie close together, whatever the view.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

if TYPE_CHECKING:
    from numpy.typing import NDArray

    DoubleArray = NDArray[np.float64]
    IntArray = NDArray[np.int64]

PATCHES = 96
"""Small pieces of equal normals, about, of which parts are put together."""
CLUSTERED = 4096
"""Triangles from which the patches' middles are found."""
ROUNDS = 8
"""Of Lloyd's algorithm; middles hardly move any more."""
POSITION_WEIGHT = 1.5
"""Of distances over the surface's standard deviation, beside differences of unit normals."""
BINS = 4
"""Cells of normals along a side of a cube's face."""
WELD = 1e-5
"""Vertices closer than this share of the surface's extent are one."""


@dataclass(frozen=True)
class SurfaceSplit:
    """Parts of a surface, of any number from `fewest` to `most`: each has two of the next number merged."""

    patch: IntArray
    """(T,) of every triangle."""
    merges: tuple[tuple[int, int], ...]
    """Patches that are merged, the second into the first, in this order."""
    most: int
    """Patches in all."""

    @property
    def fewest(self) -> int:
        """Number of parts if everything is merged that may be."""
        return self.most - len(self.merges)

    def parts(self, count: int) -> NDArray[np.uint16]:
        """Return the part of every triangle (T,), the largest number of triangles first.

        Parameters
        ----------
        count
            Of parts; the nearest possible number is taken.
        """
        group = np.arange(self.most)
        for kept, merged in self.merges[: max(self.most - max(count, 1), 0)]:
            group[group == merged] = kept
        names, part, sizes = np.unique(group[self.patch], return_inverse=True, return_counts=True)
        order = np.lexsort((names, -sizes))
        rank = np.empty(len(order), np.uint16)
        rank[order] = np.arange(len(order))
        numbered: NDArray[np.uint16] = rank[part.reshape(-1)]
        return numbered


def split_surface(
    positions: NDArray[np.floating], triangles: NDArray[np.integer], kind: NDArray[np.integer] | None = None
) -> SurfaceSplit:
    """Find parts of a surface.

    Small patches of similar place and normal are merged, two by two, touching ones first: always those by
    which the variance of place among points of one part and equal normal grows least.

    Parameters
    ----------
    positions
        (V, 3).
    triangles
        (T, 3) indices.
    kind
        (T,) of every triangle, such as its material: parts hold one kind alone. None: all are alike.

    Examples
    --------
    >>> from mirrorbake import _core
    >>> sphere = _core.make_sphere((0.0, 0.0, 0.0), 1.0, 16)
    >>> int(split_surface(sphere.positions, sphere.triangles).parts(2).max())
    1
    """
    corners = positions[triangles].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.sqrt(np.sum(normal * normal, axis=1))
    normal /= np.maximum(length, np.finfo(np.float64).tiny)[:, None]
    total = float(length.sum())
    area = length / total if total > 0.0 else np.full(len(length), 1.0 / max(len(length), 1))
    place = corners.mean(axis=1)
    place -= np.sum(area[:, None] * place, axis=0)
    deviation = float(np.sqrt(np.sum(area * np.sum(place * place, axis=1))))
    place /= deviation if deviation > 0.0 else 1.0

    kinds = np.zeros(len(triangles), np.int64) if kind is None else kind.astype(np.int64)
    cluster = _clusters(np.concatenate([POSITION_WEIGHT * place, normal], axis=1), area)
    first, second = _touching(positions, triangles)
    alike = (cluster[first] == cluster[second]) & (kinds[first] == kinds[second])
    ones = np.ones(int(alike.sum()), np.int8)
    graph = coo_array((ones, (first[alike], second[alike])), shape=(len(triangles),) * 2)
    count, patch = connected_components(graph, directed=False)
    if count > 4 * PATCHES:
        # A mesh in many pieces: clusters then, connected or not.
        patch = np.unique(np.stack([kinds, cluster], axis=1), axis=0, return_inverse=True)[1].reshape(-1)
    patch, count = _without_empty(patch.astype(np.int64), kinds, area, np.stack([first, second]))
    touching = np.zeros((count, count), np.bool_)
    touching[patch[first], patch[second]] = True
    touching |= touching.T
    patch_kind = np.zeros(count, np.int64)
    patch_kind[patch] = kinds
    merges = _merges(_moments(patch, count, place, normal, area), touching, patch_kind)
    return SurfaceSplit(patch, tuple(merges), count)


def _clusters(features: DoubleArray, area: DoubleArray) -> IntArray:
    """Return a cluster for every row: the nearest of the middles that Lloyd's algorithm finds in some."""
    step = -(-len(features) // CLUSTERED)
    some, weight = features[::step], area[::step]
    chosen = [int(np.argmax(weight))]
    distance = np.sum((some - some[chosen[0]]) ** 2, axis=1)
    while len(chosen) < min(PATCHES, len(some)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.sum((some - some[chosen[-1]]) ** 2, axis=1))
    middles = some[chosen].copy()
    for _ in range(ROUNDS):
        nearest = _nearest(some, middles)
        sums = [np.bincount(nearest, weight * some[:, k], len(middles)) for k in range(some.shape[1])]
        held = np.bincount(nearest, weight, len(middles))
        there = held > 0.0
        middles[there] = np.stack(sums, axis=1)[there] / held[there, None]
    return _nearest(features, middles)


def _nearest(features: DoubleArray, middles: DoubleArray) -> IntArray:
    # Without matrix products, whose sums libraries order as they like: parts are the same everywhere.
    best = np.full(len(features), np.inf)
    nearest = np.zeros(len(features), np.int64)
    for number, middle in enumerate(middles):
        distance = np.zeros(len(features))
        for k in range(features.shape[1]):
            distance += (features[:, k] - middle[k]) ** 2
        closer = distance < best
        best[closer] = distance[closer]
        nearest[closer] = number
    return nearest


def _touching(positions: NDArray[np.floating], triangles: NDArray[np.integer]) -> tuple[IntArray, IntArray]:
    """Return pairs of triangles that share an edge, vertices at one place being one."""
    low = positions.min(axis=0).astype(np.float64)
    extent = float(np.max(positions.max(axis=0) - low)) or 1.0
    cell = np.round((positions - low) / (WELD * extent)).astype(np.int64)
    _, vertex = np.unique(cell, axis=0, return_inverse=True)
    corner = vertex.reshape(-1)[triangles]
    edges = np.sort(np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]]), axis=1)
    triangle = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort((triangle, edges[:, 1], edges[:, 0]))
    edges, triangle = edges[order], triangle[order]
    shared = np.all(edges[1:] == edges[:-1], axis=1)
    return triangle[:-1][shared], triangle[1:][shared]


def _without_empty(
    patch: IntArray, kinds: IntArray, area: DoubleArray, pairs: IntArray
) -> tuple[IntArray, int]:
    """Return patches with an area, numbered without gaps.

    Triangles of others join a patch that they touch, or the largest of their kind.
    """
    held = np.bincount(patch, area)
    both = np.concatenate([pairs, pairs[::-1]], axis=1)
    both = both[:, kinds[both[0]] == kinds[both[1]]]
    for empty in np.flatnonzero(held <= 0.0):
        mine = patch == empty
        beside = patch[both[1, mine[both[0]]]]
        beside = beside[held[beside] > 0.0]
        alike = patch[kinds == kinds[np.argmax(mine)]]
        patch[mine] = beside[0] if len(beside) else alike[np.argmax(held[alike])]
    names, numbered = np.unique(patch, return_inverse=True)
    return numbered.reshape(-1).astype(np.int64), len(names)


def _moments(
    patch: IntArray, count: int, place: DoubleArray, normal: DoubleArray, area: DoubleArray
) -> DoubleArray:
    """Return area, area times place, and area times squared place (count, cells of normals, 5)."""
    rows = np.arange(len(normal))
    axis = np.argmax(np.abs(normal), axis=1)
    major = normal[rows, axis]
    scale = np.maximum(np.abs(major), np.finfo(np.float64).tiny)
    s, t = (
        np.clip((0.5 + 0.5 * normal[rows, (axis + turn) % 3] / scale) * BINS, 0, BINS - 1).astype(np.int64)
        for turn in (1, 2)
    )
    cells = 6 * BINS * BINS
    slot = patch * cells + ((2 * axis + (major < 0.0)) * BINS + s) * BINS + t
    square = np.sum(place * place, axis=1)
    values = (area, *(area * place[:, k] for k in range(3)), area * square)
    sums = [np.bincount(slot, value, count * cells).reshape(count, cells) for value in values]
    return np.stack(sums, axis=-1)


def _spread(moments: DoubleArray) -> DoubleArray:
    """Area times the variance of place among equal normals, summed over normals."""
    area = moments[..., 0]
    mean_square = np.sum(moments[..., 1:4] ** 2, axis=-1) / np.maximum(area, np.finfo(np.float64).tiny)
    spread: DoubleArray = np.sum(np.maximum(moments[..., 4] - mean_square, 0.0), axis=-1)
    return spread


def _merges(moments: DoubleArray, touching: NDArray[np.bool_], kind: IntArray) -> list[tuple[int, int]]:
    count = len(moments)
    spread = _spread(moments)
    cost = np.stack([_spread(moments[i] + moments) - spread[i] - spread for i in range(count)])
    cost[kind[:, None] != kind[None, :]] = np.inf
    np.fill_diagonal(cost, np.inf)
    merges: list[tuple[int, int]] = []
    while True:
        # Parts that touch nothing of their kind any more are joined across gaps.
        near = np.where(touching, cost, np.inf)
        best = near if np.isfinite(near).any() else cost
        kept, merged = (int(i) for i in np.unravel_index(np.argmin(best), best.shape))
        if not np.isfinite(best[kept, merged]):
            return merges
        merges.append((kept, merged))
        moments[kept] += moments[merged]
        spread[kept] = _spread(moments[kept])
        touching[kept] |= touching[merged]
        touching[:, kept] |= touching[:, merged]
        touching[merged] = touching[:, merged] = False
        touching[kept, kept] = False
        cost[merged] = cost[:, merged] = np.inf
        left = np.isfinite(cost[kept])
        grown = _spread(moments[kept] + moments[left]) - spread[kept] - spread[left]
        cost[kept, left] = cost[left, kept] = grown
