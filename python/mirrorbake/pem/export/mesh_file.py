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
    uvs: FloatArray
    """(V, 2) texture coordinates, v up, or (0, 2)."""
    colors: FloatArray
    """(V, 3) that multiply the albedo, in [0, 1], or (0, 3)."""
    tangents: FloatArray
    """(V, 4) unit direction of u and sign of the bitangent, or zeros, of normal textures; or (0, 4)."""
    materials: NDArray[np.uint16]
    """(T,) material of every triangle."""
    irradiance: FloatArray | None
    """(V, 3) at rest, W/m², or (V, 6) with that of the backs; None for a body that is black. Of a lightmap
    the texels, (lightmap², 3|6), rows from the top."""
    lightmap: int = 0
    """Texels along a side of the map on the bounds of `uvs` that irradiance is; 0: it is at the vertices."""


def has_border(positions: FloatArray, triangles: NDArray[np.uint32]) -> bool:
    """Return whether a mesh is open somewhere, so that backs of its triangles can be seen.

    Vertices at one place are one. Every edge of a closed surface is run through as often in one way as in the
    other.

    >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    >>> tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.uint32)
    >>> has_border(corners, tetrahedron), has_border(corners, tetrahedron[:3])
    (False, True)
    """
    _, welded = np.unique(positions, axis=0, return_inverse=True)
    corners = welded.reshape(-1)[triangles].astype(np.int64)
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    low, high = edges.min(axis=1), edges.max(axis=1)
    ways = np.sign(edges[:, 1] - edges[:, 0])
    _, edge = np.unique(low * len(positions) + high, return_inverse=True)
    return bool(np.any(np.bincount(edge.reshape(-1), ways) != 0.0))


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


def write_mesh(mesh: ReflectorMesh) -> tuple[bytes, dict[str, Any]]:
    """Encode a mesh.

    The triangles are sorted by part and material, among them those that carry all shells first.

    Returns
    -------
    tuple
        The file's bytes, and its description for the manifest: `bounds` of positions and texture
        coordinates, the size of the `lightmap`, and for each array its type, its number of components and
        its place in the file after decompression.
    """
    order = np.lexsort((~mesh.whole_stack, mesh.materials, mesh.parts))
    triangles = mesh.triangles[order]
    parts, materials, whole = mesh.parts[order], mesh.materials[order], mesh.whole_stack[order]
    used = vertex_order(triangles)
    renumbered = np.zeros(len(mesh.positions), np.uint32)
    renumbered[used] = np.arange(len(used), dtype=np.uint32)
    indices = renumbered[triangles].ravel()

    positions, bounds = _quantised(mesh.positions[used])
    arrays: dict[str, NDArray[Any]] = {"positions": positions, "indices": indices.astype(np.int32)[:, None]}
    description: dict[str, Any] = {"bounds": bounds, "lightmap": mesh.lightmap or None}
    if len(mesh.normals):
        arrays["normals"] = octahedral(mesh.normals[used])
    if len(mesh.uvs):
        arrays["uvs"], description["uvBounds"] = _coordinates(mesh, used)
    if len(mesh.colors):
        arrays["colors"] = np.rint(np.clip(mesh.colors[used], 0.0, 1.0) * 65535.0).astype(np.uint16)
    if len(mesh.tangents):
        tangents = mesh.tangents[used]
        signs = np.rint(32767.0 * np.sign(tangents[:, 3:])).astype(np.int16)
        arrays["tangents"] = np.concatenate([octahedral(tangents[:, :3]), signs], axis=1)
    if mesh.irradiance is not None:
        arrays["irradiance"] = _halves(mesh.irradiance, mesh, used)
    payload, layout = _pack({name: _differences(array) for name, array in arrays.items()})
    ranges = []
    for part, material in sorted(set(zip(parts.tolist(), materials.tolist(), strict=True))):
        members = np.flatnonzero((parts == part) & (materials == material))
        stacked = int(np.count_nonzero(whole[members]))
        ranges.append(
            {
                "part": part,
                "material": material,
                "start": int(members[0]),
                "stacked": stacked,
                "count": len(members),
            }
        )
    description |= {"arrays": layout, "ranges": ranges, "bytes": len(payload)}
    return gzip.compress(payload, 9, mtime=0), description


def write_irradiance(irradiance: FloatArray, mesh: ReflectorMesh) -> bytes:
    """Encode the irradiance of another sample as the mesh's file has it: its vertices or its texels."""
    order = np.lexsort((~mesh.whole_stack, mesh.materials, mesh.parts))
    used = vertex_order(mesh.triangles[order])
    payload, _ = _pack({"irradiance": _halves(irradiance, mesh, used)})
    return gzip.compress(payload, 9, mtime=0)


def _halves(irradiance: FloatArray, mesh: ReflectorMesh, used: NDArray[np.int64]) -> NDArray[np.float16]:
    """Return the irradiance of the vertices that are used, in their order, or of all texels of a lightmap."""
    rows = irradiance if mesh.lightmap else irradiance[used]
    return rows.astype(np.float16)


def _coordinates(mesh: ReflectorMesh, used: NDArray[np.int64]) -> tuple[NDArray[np.uint16], dict[str, Any]]:
    """Return the texture coordinates of used vertices, v down, as fractions of their bounds, and the bounds.

    A lightmap lies on the bounds of all vertices.
    """
    uvs = mesh.uvs.astype(np.float64) * [1.0, -1.0] + [0.0, 1.0]
    if not mesh.lightmap:
        return _quantised(uvs[used])
    fractions, bounds = _quantised(uvs)
    return fractions[used], bounds


def vertex_order(triangles: NDArray[np.uint32]) -> NDArray[np.int64]:
    """Vertices in the order of their first use, so that differences of indices are small."""
    used, first = np.unique(triangles, return_index=True)
    ordered: NDArray[np.int64] = used[np.argsort(first)].astype(np.int64)
    return ordered


def _quantised(points: NDArray[np.floating[Any]]) -> tuple[NDArray[np.uint16], dict[str, Any]]:
    """Return points as 16-bit fractions of their bounds, and the bounds."""
    wide = points.astype(np.float64)
    low, high = wide.min(axis=0), wide.max(axis=0)
    extent = np.where(high > low, high - low, 1.0)
    fractions = np.rint((wide - low) / extent * 65535.0).astype(np.uint16)
    return fractions, {"low": low.tolist(), "high": (low + extent).tolist()}


def _differences(array: NDArray[Any]) -> NDArray[Any]:
    """Return integers (n, C) each minus the one before, modulo their range; others as they are."""
    if array.dtype.kind == "f":
        return array
    before = np.zeros_like(array)
    before[1:] = array[:-1]
    differences: NDArray[Any] = array - before
    return differences


def _pack(arrays: dict[str, NDArray[Any]]) -> tuple[bytes, dict[str, Any]]:
    """Arrays one after the other, and what each one is."""
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
    return bytes(payload), layout
