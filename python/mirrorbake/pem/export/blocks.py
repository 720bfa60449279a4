"""Atlases of which only some blocks matter: which ones, and a filling of the others that costs little."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mirrorbake.pem.export.radiance_code import to_atlas

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

BLOCK = 4
"""Pixels along a side: of 8, the images are an eighth larger, and the blocks' file takes 2 kB less."""


def blocks_of(texels: NDArray[np.bool_], size: int, projection: str) -> NDArray[np.bool_]:
    """Return the blocks of an atlas (`to_atlas`) with one of some texels (T,) in them: (⌈H/4⌉, ⌈W/4⌉)."""
    atlas = to_atlas(texels[:, None].astype(np.uint8), size, projection)[..., 0] > 0
    height, width = atlas.shape
    whole = np.zeros((-(-height // BLOCK) * BLOCK, -(-width // BLOCK) * BLOCK), np.bool_)
    whole[:height, :width] = atlas
    parts = whole.reshape(whole.shape[0] // BLOCK, BLOCK, whole.shape[1] // BLOCK, BLOCK)
    found: NDArray[np.bool_] = np.any(parts, axis=(1, 3))
    return found


def pixels_of(blocks: NDArray[np.bool_], height: int, width: int) -> NDArray[np.bool_]:
    """Return which pixels (H, W) of an atlas lie in blocks."""
    pixels: NDArray[np.bool_] = np.repeat(np.repeat(blocks, BLOCK, axis=0), BLOCK, axis=1)[:height, :width]
    return pixels


def filled(image: NDArray[np.uint8], known: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return an image (H, W, C) whose unknown pixels are smooth, so that they cost next to nothing.

    Each takes the mean of the known ones in the smallest square of 2ᵏ pixels, aligned to its size, that has
    any: the pull and push of Gortler et al., The Lumigraph, SIGGRAPH 1996, without its blending.
    """
    height, width = known.shape
    levels = max(height - 1, width - 1, 1).bit_length()
    side = 1 << levels
    total = np.zeros((side, side, image.shape[2]), np.float32)
    total[:height, :width] = np.where(known[..., None], image, 0)
    count = np.zeros((side, side, 1), np.float32)
    count[:height, :width, 0] = known
    pyramid = [(total, count)]
    for _ in range(levels):
        pyramid.append((_sums(pyramid[-1][0]), _sums(pyramid[-1][1])))
    out: FloatArray = np.zeros((1, 1, image.shape[2]), np.float32)
    for sums, counts in reversed(pyramid):
        finer = out if len(out) == len(sums) else np.repeat(np.repeat(out, 2, axis=0), 2, axis=1)
        out = np.where(counts > 0.0, sums / np.maximum(counts, 1.0), finer)
    result: NDArray[np.uint8] = np.where(known[..., None], image, np.rint(out[:height, :width])).astype(
        np.uint8
    )
    return result


def _sums(values: FloatArray) -> FloatArray:
    """Sums of all squares of 2×2 pixels."""
    sums: FloatArray = values[::2, ::2] + values[1::2, ::2] + values[::2, 1::2] + values[1::2, 1::2]
    return sums
