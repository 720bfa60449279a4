"""Cuts long edges of a mesh, so that what is stored at its vertices has vertices enough."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

MOST_TRIANGLES = 1 << 22
"""That a mesh may get."""
SAME_PLANE = 1e-3
"""How far apart, in radians, triangles of a flat face may be."""


def refined(mesh: _core.TriangleMesh, longest_edge: float, scale: float = 1.0) -> _core.TriangleMesh:
    """Return a mesh of the same surface without edges longer than a limit.

    Edges are halved, on both sides alike, until none is too long: the surface stays as closed as it was, also
    along seams, where several vertices lie in one place. New vertices have the means of the ends' values,
    made unit vectors where these are; triangles keep the part of the one that they are cut from. Of a mesh
    without normals triangles share vertices only in one plane: beyond a crease the light is another.

    Parameters
    ----------
    mesh
        Any.
    longest_edge
        Metres, above 0.
    scale
        Metres of a unit of the mesh.

    Raises
    ------
    InputError
        It would have more than `MOST_TRIANGLES`.
    """
    triangles, vertex = np.asarray(mesh.triangles).astype(np.int64), np.arange(len(mesh.positions))
    if not len(mesh.normals):
        triangles, vertex = _apart_at_creases(np.asarray(mesh.positions), triangles)
    positions = np.asarray(mesh.positions)[vertex]
    parts = np.asarray(mesh.parts)
    others = {
        name: np.asarray(values)[vertex]
        for name in ("normals", "uvs", "colors", "tangents")
        if len(values := getattr(mesh, name))
    }
    while True:
        is_long = scale * _lengths(positions, triangles) > longest_edge
        if not is_long.any():
            break
        # Each halved edge is one triangle more.
        count = len(triangles) + int(is_long.sum())
        if count > MOST_TRIANGLES:
            raise InputError(
                f"reflector.longest_edge: {longest_edge:g} makes {count} triangles or more; "
                f"expected at most {MOST_TRIANGLES}"
            )
        ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1)[is_long]
        pairs, place = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
        middle = np.full(triangles.shape, -1, np.int64)
        middle[is_long] = len(positions) + place.reshape(-1)
        positions = np.concatenate([positions, _means(positions, pairs)])
        others = {name: np.concatenate([v, _between(name, v, pairs)]) for name, v in others.items()}
        triangles, source = _cut(triangles, middle)
        parts = parts[source] if len(parts) else parts
    return _core.TriangleMesh(
        positions,
        triangles.astype(np.uint32),
        others.get("normals"),
        others.get("uvs"),
        parts if len(parts) else None,
        others.get("colors"),
        others.get("tangents"),
    )


def _apart_at_creases(
    positions: NDArray[np.float32], triangles: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return triangles that share vertices only in one plane, and which vertex each of theirs was."""
    a, b, c = (positions[triangles[:, k]].astype(np.float64) for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    facing = np.repeat(np.round(normals / SAME_PLANE).astype(np.int64), 3, axis=0)
    corners, place = np.unique(
        np.concatenate([triangles.reshape(-1, 1), facing], axis=1), axis=0, return_inverse=True
    )
    return place.reshape(triangles.shape), corners[:, 0]


def _lengths(positions: NDArray[np.float32], triangles: NDArray[np.int64]) -> NDArray[np.float64]:
    """(T, 3) of the edges from each corner to the next."""
    corners = positions[triangles].astype(np.float64)
    lengths: NDArray[np.float64] = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1)
    return lengths


def _means(values: NDArray[np.float32], pairs: NDArray[np.int64]) -> NDArray[np.float32]:
    means: NDArray[np.float32] = np.float32(0.5) * values[pairs[:, 0]] + np.float32(0.5) * values[pairs[:, 1]]
    return means


def _between(name: str, values: NDArray[np.float32], pairs: NDArray[np.int64]) -> NDArray[np.float32]:
    means = _means(values, pairs)
    if name == "normals":
        return _unit(means, values[pairs[:, 0]])
    if name == "tangents":
        # Without one at an end, or between mirrored halves, there is none.
        there = np.all(values[pairs, 3] != 0.0, axis=1) & (values[pairs[:, 0], 3] == values[pairs[:, 1], 3])
        means[:, :3] = _unit(means[:, :3], values[pairs[:, 0], :3])
        means[:, 3] = values[pairs[:, 0], 3]
        means[~there] = 0.0
    return means


def _unit(vectors: NDArray[np.float32], instead: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return vectors of length 1; where they are 0, as between opposite ones, others."""
    lengths = np.linalg.norm(vectors.astype(np.float64), axis=1, keepdims=True)
    units: NDArray[np.float64] = instead.astype(np.float64)
    np.divide(vectors, lengths, out=units, where=lengths > 1e-6)
    return units.astype(np.float32)


def _cut(
    triangles: NDArray[np.int64], middle: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cut triangles (T, 3) at the middles of their edges.

    Parameters
    ----------
    triangles
        Corners.
    middle
        (T, 3) the vertex on the edge from each corner to the next; -1: it stays whole.

    Returns
    -------
    tuple
        Triangles, and which one each of them was cut from, in its order.
    """
    halved = middle >= 0
    count = halved.sum(axis=1)
    # Turned so that one halved edge is the first, and of two the third is whole.
    first = np.where(
        count == 1, np.argmax(halved, axis=1), np.where(count == 2, np.argmin(halved, axis=1) + 1, 0)
    )
    turn = (np.arange(3)[None, :] + first[:, None]) % 3
    a, b, c = np.take_along_axis(triangles, turn, axis=1).T
    ab, bc, ca = np.take_along_axis(middle, turn, axis=1).T
    pieces = {
        0: [(a, b, c)],
        1: [(a, ab, c), (ab, b, c)],
        2: [(ab, b, bc), (a, ab, bc), (a, bc, c)],
        3: [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)],
    }
    found = [
        (np.stack(corners, axis=-1)[count == halves], np.flatnonzero(count == halves))
        for halves, several in pieces.items()
        for corners in several
    ]
    source = np.concatenate([numbers for _, numbers in found])
    order = np.argsort(source, kind="stable")
    return np.concatenate([corners for corners, _ in found])[order], source[order]
