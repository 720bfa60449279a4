"""How the maps of a PEM are stored: the finest level, and what the coarser ones add to its means."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.envmap import EnvMap
from mirrorbake.projection import MAP_PROJECTIONS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

LARGEST_HALF = 65504.0


def topology_of(projection: str, size: int) -> _core.TexelTopology:
    """Return how the texels of a map lie to each other, by its projection's name in scene files."""
    return _core.TexelTopology.of(MAP_PROJECTIONS[projection], size)


def pyramid_of(finest: FloatArray, projection: str) -> FloatArray:
    """Return all levels (texels, C) of a finest level (F, S, S, C), weighted by solid angles."""
    if projection == "cube":
        return np.asarray(_core.build_cube_pyramid(finest))
    mips = EnvMap.from_array(finest, MAP_PROJECTIONS[projection].projection).mips()
    return np.ascontiguousarray(mips.values.reshape(-1, finest.shape[-1]))


def capture(
    tracer: _core.Tracer,
    origin: Sequence[float],
    projection: str,
    size: int,
    hidden: Sequence[int],
    options: _core.TraceOptions,
) -> FloatArray:
    """Return the radiance (F, S, S, 3) that arrives at a point, some objects removed."""
    kept = MAP_PROJECTIONS[projection].projection
    return np.asarray(tracer.capture(origin, kept, size, size, hidden, options))


def decimate(level: FloatArray) -> FloatArray:
    """Next coarser level: the mean of every 2×2 block of each face.

    Parameters
    ----------
    level
        Shape (F, S, S, C), S even, float32.

    Returns
    -------
    array
        Shape (F, S/2, S/2, C), float32.
    """
    top = level[:, 0::2, 0::2] + level[:, 0::2, 1::2]
    bottom = level[:, 1::2, 0::2] + level[:, 1::2, 1::2]
    return (top + bottom) * np.float32(0.25)


def coarse_end(pyramid: FloatArray, texels: int) -> FloatArray:
    """Return the levels of a pyramid (T, C) that a smaller one of so many texels has."""
    return pyramid[len(pyramid) - texels :]


def size_of(texels: int, faces: int = 6) -> int:
    """Return the side of the finest level of a pyramid of so many texels.

    >>> size_of(6 * (16 + 4 + 1)), size_of(2 * (4 + 1), faces=2)
    (4, 2)
    """
    return math.isqrt((3 * (texels // faces) + 1) // 4)


def residual_texels(size: int, faces: int = 6) -> int:
    """Number of texels of all levels but the finest, for a power of two."""
    return sum(faces * s * s for s in coarser_sizes(size))


def coarser_sizes(size: int) -> list[int]:
    """Sides of the levels below one of `size` texels, down to 1."""
    return [size >> level for level in range(1, size.bit_length())]


def split_pyramid(
    pyramid: FloatArray, size: int, dtype: str, faces: int = 6
) -> tuple[NDArray[Any], NDArray[Any], int]:
    """Split a pyramid into what is stored: the finest level and the residuals of the others.

    Parameters
    ----------
    pyramid
        Shape (texels, C): levels one after the other, the finest first.
    size
        Texels along a side of the finest level.
    dtype
        'float16' or 'float32'. Residuals refer to the finest level as it is stored, so they also take up its
        rounding.
    faces
        Of the projection (`MAP_PROJECTIONS`).

    Returns
    -------
    tuple
        The finest level (F, S, S, C), the residuals (R, C), and how many values were clamped to ±65504
        because float16 ends there.
    """
    channels = pyramid.shape[1]
    clamped = 0
    if dtype == "float16":
        clamped = int(np.count_nonzero(np.abs(pyramid) > LARGEST_HALF))
        pyramid = np.clip(pyramid, -LARGEST_HALF, LARGEST_HALF)
    count = faces * size * size
    finest = pyramid[:count].reshape(faces, size, size, channels).astype(dtype)
    residuals = np.empty((residual_texels(size, faces), channels), dtype)
    level = finest.astype(np.float32)
    offset = 0
    for s in coarser_sizes(size):
        level = decimate(level)
        texels = faces * s * s
        values = pyramid[count + offset : count + offset + texels]
        residuals[offset : offset + texels] = (values - level.reshape(texels, channels)).astype(dtype)
        offset += texels
    return finest, residuals, clamped


def join_pyramid(finest: NDArray[Any], residuals: NDArray[Any]) -> FloatArray:
    """Inverse of `split_pyramid`, up to the rounding of the storage. Returns shape (texels, C), float32."""
    faces, size, channels = finest.shape[0], finest.shape[1], finest.shape[3]
    level = finest.astype(np.float32)
    offset = faces * size * size
    pyramid = np.empty((offset + residuals.shape[0], channels), np.float32)
    pyramid[:offset] = level.reshape(-1, channels)
    for s in coarser_sizes(size):
        level = decimate(level)
        texels = faces * s * s
        start = offset - faces * size * size
        pyramid[offset : offset + texels] = (
            level.reshape(texels, channels) + residuals[start : start + texels]
        )
        offset += texels
    return pyramid
