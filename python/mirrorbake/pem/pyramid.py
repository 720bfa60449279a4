"""How the maps of a PEM are stored: the finest level, and what the coarser ones add to its means."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

LARGEST_HALF = 65504.0


def decimate(level: FloatArray) -> FloatArray:
    """Next coarser level: the mean of every 2×2 block of each face.

    Parameters
    ----------
    level
        Shape (6, S, S, C), S even, float32.

    Returns
    -------
    array
        Shape (6, S/2, S/2, C), float32.
    """
    top = level[:, 0::2, 0::2] + level[:, 0::2, 1::2]
    bottom = level[:, 1::2, 0::2] + level[:, 1::2, 1::2]
    return (top + bottom) * np.float32(0.25)


def residual_texels(size: int) -> int:
    """Number of texels of all levels but the finest, for a power of two."""
    return sum(6 * s * s for s in coarser_sizes(size))


def coarser_sizes(size: int) -> list[int]:
    """Sides of the levels below one of `size` texels, down to 1."""
    return [size >> level for level in range(1, size.bit_length())]


def split_pyramid(pyramid: FloatArray, size: int, dtype: str) -> tuple[NDArray[Any], NDArray[Any], int]:
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

    Returns
    -------
    tuple
        The finest level (6, S, S, C), the residuals (R, C), and how many values were clamped to ±65504
        because float16 ends there.
    """
    channels = pyramid.shape[1]
    clamped = 0
    if dtype == "float16":
        clamped = int(np.count_nonzero(np.abs(pyramid) > LARGEST_HALF))
        pyramid = np.clip(pyramid, -LARGEST_HALF, LARGEST_HALF)
    count = 6 * size * size
    finest = pyramid[:count].reshape(6, size, size, channels).astype(dtype)
    residuals = np.empty((residual_texels(size), channels), dtype)
    level = finest.astype(np.float32)
    offset = 0
    for s in coarser_sizes(size):
        level = decimate(level)
        texels = 6 * s * s
        values = pyramid[count + offset : count + offset + texels]
        residuals[offset : offset + texels] = (values - level.reshape(texels, channels)).astype(dtype)
        offset += texels
    return finest, residuals, clamped


def join_pyramid(finest: NDArray[Any], residuals: NDArray[Any]) -> FloatArray:
    """Inverse of `split_pyramid`, up to the rounding of the storage. Returns shape (texels, C), float32."""
    size, channels = finest.shape[1], finest.shape[3]
    level = finest.astype(np.float32)
    pyramid = np.empty((6 * size * size + residuals.shape[0], channels), np.float32)
    offset = 6 * size * size
    pyramid[:offset] = level.reshape(-1, channels)
    for s in coarser_sizes(size):
        level = decimate(level)
        texels = 6 * s * s
        start = offset - 6 * size * size
        pyramid[offset : offset + texels] = (
            level.reshape(texels, channels) + residuals[start : start + texels]
        )
        offset += texels
    return pyramid
