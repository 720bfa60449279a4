"""What texture coordinates of a mesh are good for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake import _core
    from mirrorbake.arrays import FloatArray

OVERLAP_GRID = 256
OVERLAP_POINTS = 200_000
"""Points of the surface by which overlaps of its texture coordinates are looked for."""
MOST_OVERLAP = 0.1
"""Share of a texture's places that may belong to several places of the surface: seams do."""


def atlas_coordinates(mesh: _core.TriangleMesh) -> FloatArray:
    """Return a mesh's texture coordinates (V, 2) as shares of their bounds, v up; (0, 2) without any.

    What lies on them neither repeats nor depends on the tiles that the coordinates run through.
    """
    uvs = np.asarray(mesh.uvs, np.float64).reshape(-1, 2)
    if not len(uvs) or not np.isfinite(uvs).all():
        return np.zeros((0, 2), np.float32)
    low, high = atlas_bounds(mesh)
    shares: FloatArray = ((uvs - low) / (high - low)).astype(np.float32)
    return shares


def atlas_bounds(mesh: _core.TriangleMesh) -> NDArray[np.float64]:
    """Return the least and the largest texture coordinates of a mesh, (2, 2); 1 apart where all are alike."""
    uvs = np.asarray(mesh.uvs, np.float64)
    low, high = uvs.min(axis=0), uvs.max(axis=0)
    return np.stack([low, np.where(high > low, high, low + 1.0)])


def has_own_texels(positions: FloatArray, triangles: NDArray[np.uint32], uvs: FloatArray) -> bool:
    """Whether every place of a surface has a place of its own in a texture.

    Parameters
    ----------
    positions
        (V, 3).
    triangles
        (T, 3).
    uvs
        (V, 2), or empty.

    Returns
    -------
    bool
        False without coordinates, for those outside of [0, 1], and for those that places far from each other
        share, as tiles and mirrored halves do.
    """
    if not len(uvs) or not np.isfinite(uvs).all() or uvs.min() < -1e-4 or uvs.max() > 1.0 + 1e-4:
        return False
    a, b, c = (uvs[triangles[:, corner]].astype(np.float64) for corner in range(3))
    p, q, r = (positions[triangles[:, corner]].astype(np.float64) for corner in range(3))
    area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    surface = np.linalg.norm(np.cross(q - p, r - p), axis=1)
    if surface[area < 1e-12].sum() > 0.01 * surface.sum():
        return False
    random = np.random.default_rng(0)
    chosen = random.choice(len(area), OVERLAP_POINTS, p=area / area.sum())
    x, y = random.random((2, OVERLAP_POINTS, 1))
    x, y = np.where(x + y > 1.0, 1.0 - x, x), np.where(x + y > 1.0, 1.0 - y, y)
    uv = a[chosen] + x * (b - a)[chosen] + y * (c - a)[chosen]
    place = p[chosen] + x * (q - p)[chosen] + y * (r - p)[chosen]
    column, row = np.clip((OVERLAP_GRID * uv).astype(np.int64), 0, OVERLAP_GRID - 1).T
    cell = OVERLAP_GRID * row + column
    count = np.bincount(cell, minlength=OVERLAP_GRID**2)
    variance = np.zeros(OVERLAP_GRID**2)
    for axis in range(3):
        centred = place[:, axis] - place[:, axis].mean()
        mean = np.bincount(cell, centred, OVERLAP_GRID**2) / np.maximum(count, 1)
        variance += np.bincount(cell, (centred - mean[cell]) ** 2, OVERLAP_GRID**2) / np.maximum(count, 1)
    several = count > 1
    far = np.sqrt(variance[several]) > 0.05 * float(np.linalg.norm(np.ptp(positions, axis=0)))
    return bool(several.any() and far.mean() <= MOST_OVERLAP)
