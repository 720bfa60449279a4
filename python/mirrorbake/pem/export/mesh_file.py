"""The reflector's mesh as a small binary file for the web."""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray


@dataclass(frozen=True)
class ReflectorMesh:
    """What a renderer needs of the reflector; world space, metres."""

    positions: FloatArray
    """(V, 3)."""
    normals: FloatArray
    """(V, 3) unit vectors, or (0, 3) for flat shading."""
    triangles: NDArray[np.uint32]
    """(T, 3), counter-clockwise seen from outside."""
    parts: NDArray[np.uint16]
    """(T,) part of every triangle."""
    whole_stack: NDArray[np.bool_]
    """(T,) False for triangles that only the last shell of their part is drawn on: those on the hull."""
    diffuse: FloatArray | None
    """(V, 3) radiance that the body reflects before any coat, or None."""


def octahedral(normals: FloatArray) -> NDArray[np.int16]:
    """Unit vectors (V, 3) on an unfolded octahedron, (V, 2), as signed 16-bit fractions.

    Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors, JCGT 3(2), 2014: the
    largest error of this size is 5e-5 rad.
    """
    n = normals.astype(np.float64)
    n = n / np.maximum(np.abs(n).sum(axis=1, keepdims=True), 1e-30)
    folded = (1.0 - np.abs(n[:, [1, 0]])) * np.where(n[:, :2] >= 0.0, 1.0, -1.0)
    xy = np.where(n[:, 2:] >= 0.0, n[:, :2], folded)
    fractions: NDArray[np.int16] = np.rint(xy * 32767.0).astype(np.int16)
    return fractions


def write_mesh(mesh: ReflectorMesh, part_count: int) -> tuple[bytes, dict[str, Any]]:
    """Encode a mesh.

    The triangles are sorted by part, within a part those that carry all shells first.

    Returns
    -------
    tuple
        The file's bytes, and its description for the manifest: `bounds` of the positions, and for each
        array its type, its number of components and its place in the file after decompression.
    """
    order = np.lexsort((~mesh.whole_stack, mesh.parts))
    triangles = mesh.triangles[order]
    parts, whole = mesh.parts[order], mesh.whole_stack[order]
    # Vertices in the order of their first use, so that differences of indices are small.
    used, first = np.unique(triangles, return_index=True)
    used = used[np.argsort(first)]
    renumbered = np.zeros(len(mesh.positions), np.uint32)
    renumbered[used] = np.arange(len(used), dtype=np.uint32)
    indices = renumbered[triangles].ravel()

    positions = mesh.positions[used].astype(np.float64)
    low, high = positions.min(axis=0), positions.max(axis=0)
    extent = np.where(high > low, high - low, 1.0)
    quantised = np.rint((positions - low) / extent * 65535.0).astype(np.uint16)
    arrays: dict[str, NDArray[Any]] = {
        "positions": quantised,
        "indices": np.diff(indices.astype(np.int64), prepend=0).astype(np.int32),
    }
    if len(mesh.normals):
        arrays["normals"] = octahedral(mesh.normals[used])
    if mesh.diffuse is not None:
        arrays["diffuse"] = mesh.diffuse[used].astype(np.float16)

    payload = bytearray()
    layout: dict[str, Any] = {}
    for name, array in arrays.items():
        table = array.reshape(len(array), -1)
        # One component after the other, and in each the low bytes apart from the high ones: like with like.
        planes = np.ascontiguousarray(table.T).view(np.uint8).reshape(table.shape[1], -1, array.itemsize)
        layout[name] = {
            "type": array.dtype.name,
            "components": table.shape[1],
            "count": table.shape[0],
            "offset": len(payload),
        }
        payload += np.ascontiguousarray(planes.transpose(0, 2, 1)).tobytes()
    ranges = []
    for part in range(part_count):
        members = np.flatnonzero(parts == part)
        start = int(members[0]) if len(members) else 0
        stacked = int(np.count_nonzero(whole[members]))
        ranges.append({"start": start, "stacked": stacked, "count": len(members)})
    description = {
        "bounds": {"low": low.tolist(), "high": (low + extent).tolist()},
        "arrays": layout,
        "parts": ranges,
        "bytes": len(payload),
    }
    return gzip.compress(bytes(payload), 9, mtime=0), description
