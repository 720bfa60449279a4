"""How images are compared: what a display would show, on the object's pixels."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

DISPLAY_TRANSFORM = "clip to [0,1], then the sRGB transfer function (IEC 61966-2-1), unquantised; exposure 1"
"""What `display_referred` does, in words, for reports."""

OBJECT_COVERAGE = 0.5
"""A pixel belongs to the object if at least this fraction of its samples sees it."""


def display_referred(radiance: FloatArray) -> NDArray[np.float64]:
    """Scene-linear radiance as a display shows it, in [0,1].

    Values are clipped to [0,1] and encoded with the sRGB transfer function (IEC 61966-2-1:1999); they are not
    quantised. NaN stays NaN.

    Examples
    --------
    >>> display_referred(np.array([0.0, 0.0031308, 0.5, 7.0], np.float32)).round(4).tolist()
    [0.0, 0.0404, 0.7354, 1.0]
    """
    x = np.clip(radiance.astype(np.float64), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1.0 / 2.4) - 0.055)


def psnr(image: FloatArray, reference: FloatArray, mask: NDArray[np.bool_]) -> float:
    """Peak signal-to-noise ratio in dB of what a display shows, peak 1, over the pixels of a mask.

    Parameters
    ----------
    image, reference
        Scene-linear radiance, shape (H, W, 3).
    mask
        Which pixels count, shape (H, W).

    Returns
    -------
    float
        `inf` for equal images, NaN if the mask is empty.

    Raises
    ------
    ValueError
        The shapes differ, or a pixel that counts is not finite.

    Examples
    --------
    >>> black, white = np.zeros((2, 2, 3), np.float32), np.ones((2, 2, 3), np.float32)
    >>> psnr(black, white, np.ones((2, 2), bool))
    0.0
    """
    if image.shape != reference.shape or image.shape[:2] != mask.shape:
        raise ValueError(f"shapes {image.shape}, {reference.shape} and {mask.shape} do not belong together")
    if not mask.any():
        return math.nan
    difference = display_referred(image[mask]) - display_referred(reference[mask])
    error = float(np.mean(difference * difference))
    if not math.isfinite(error):
        raise ValueError("an image has pixels that are not finite")
    return math.inf if error == 0.0 else -10.0 * math.log10(error)


def mean_or_none(values: list[float | None]) -> float | None:
    """Mean of the finite values; None if there are none."""
    finite = [value for value in values if value is not None and math.isfinite(value)]
    return math.fsum(finite) / len(finite) if finite else None
