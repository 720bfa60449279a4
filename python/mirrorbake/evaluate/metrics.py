"""How images are compared: what a display would show, on the object's pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import flip_evaluator
import numpy as np
from scipy.ndimage import binary_erosion
from skimage.feature import structure_tensor, structure_tensor_eigenvalues
from skimage.metrics import structural_similarity
from skimage.registration import optical_flow_ilk

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

    Mask = NDArray[np.bool_]

DISPLAY_TRANSFORM = "clip to [0,1], then the sRGB transfer function (IEC 61966-2-1), unquantised; exposure 1"
"""What `display_referred` does, in words, for reports."""

WORST_SHARE = 0.01
"""Share of the pixels that `worst_error` looks at."""

FLOW_RADIUS = 5
"""Pixels around a pixel from which its motion is found."""


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


def mean_squared_error(image: FloatArray, reference: FloatArray, mask: Mask) -> float:
    """Mean squared difference of what a display shows, over the pixels of a mask.

    Parameters
    ----------
    image, reference
        Scene-linear radiance, shape (H, W, 3).
    mask
        Which pixels count, shape (H, W).

    Returns
    -------
    float
        In [0,1]; NaN if the mask is empty.

    Raises
    ------
    ValueError
        The shapes differ, or a pixel that counts is not finite.
    """
    if image.shape != reference.shape or image.shape[:2] != mask.shape:
        raise ValueError(f"shapes {image.shape}, {reference.shape} and {mask.shape} do not belong together")
    if not mask.any():
        return math.nan
    difference = display_referred(image[mask]) - display_referred(reference[mask])
    error = float(np.mean(difference * difference))
    if not math.isfinite(error):
        raise ValueError("an image has pixels that are not finite")
    return error


def decibels(mean_squared: float) -> float:
    """Peak signal-to-noise ratio of a mean squared error, peak 1.

    >>> decibels(0.01)
    20.0
    >>> decibels(0.0)
    inf
    """
    return math.inf if mean_squared == 0.0 else -10.0 * math.log10(mean_squared)


def psnr(image: FloatArray, reference: FloatArray, mask: Mask) -> float:
    """Peak signal-to-noise ratio in dB of what a display shows, peak 1, over the pixels of a mask.

    Parameters and errors are those of `mean_squared_error`. `inf` for equal images, NaN if the mask is empty.

    Examples
    --------
    >>> black, white = np.zeros((2, 2, 3), np.float32), np.ones((2, 2, 3), np.float32)
    >>> round(psnr(black, white, np.ones((2, 2), bool)), 6)
    0.0
    """
    return decibels(mean_squared_error(image, reference, mask))


def worst_error(image: FloatArray, reference: FloatArray, mask: Mask) -> float:
    """Root mean squared difference of what a display shows, over the worst 1 % of the pixels of a mask.

    At least one pixel counts. Scene-linear radiance (H, W, 3); in [0,1], NaN if the mask is empty.
    """
    if not mask.any():
        return math.nan
    squared = np.mean((display_referred(image[mask]) - display_referred(reference[mask])) ** 2, axis=-1)
    count = max(1, round(WORST_SHARE * len(squared)))
    return float(np.sqrt(np.mean(np.partition(squared, len(squared) - count)[len(squared) - count :])))


def ssim(image: FloatArray, reference: FloatArray, mask: Mask) -> float:
    """Structural similarity of what a display shows, mean over a mask; 1 for equal images.

    Wang, Bovik, Sheikh, Simoncelli, Image quality assessment, IEEE TIP 13(4), 2004, with their Gaussian
    window of σ = 1.5 pixels, which needs images of at least 11 pixels a side: NaN for smaller ones.

    Parameters
    ----------
    image, reference
        Scene-linear radiance (H, W, 3); neighbours of pixels that count are looked at, too.
    mask
        Which pixels count, shape (H, W).
    """
    if not mask.any() or min(mask.shape) < 11:
        return math.nan
    _, similarity = structural_similarity(
        display_referred(image),
        display_referred(reference),
        channel_axis=-1,
        data_range=1.0,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )
    return float(similarity[mask].mean())


def flip(image: FloatArray, reference: FloatArray, mask: Mask) -> float:
    """FLIP error of what a display shows, mean over a mask; 0 for equal images, 1 at most.

    Andersson et al., FLIP: A difference evaluator for alternating images, HPG 2020, at 67 pixels per degree.

    Parameters
    ----------
    image, reference
        Scene-linear radiance (H, W, 3); neighbours of pixels that count are looked at, too.
    mask
        Which pixels count, shape (H, W).
    """
    if not mask.any():
        return math.nan
    shown = [display_referred(picture).astype(np.float32) for picture in (reference, image)]
    error, _, _ = flip_evaluator.evaluate(*shown, "LDR", applyMagma=False, computeMeanError=False)
    return float(np.asarray(error).reshape(mask.shape)[mask].mean())


@dataclass(frozen=True)
class Motion:
    """How what is seen moves between two neighbouring frames, and where that can be told.

    Found by optical flow (Le Besnerais and Champagnat, Dense optical flow by iterative local window
    registration, ICIP 2005).
    """

    flow: NDArray[np.float64]
    """(2, H, W): pixels down and to the right."""
    weight: NDArray[np.float64]
    """(H, W): how well its surroundings determine a pixel's motion, the smaller eigenvalue of the structure
    tensor; 0 outside of the mask and near its edge."""


def motion(frames: tuple[FloatArray, FloatArray], mask: Mask) -> Motion:
    """Find the motion between two frames.

    Parameters
    ----------
    frames
        Scene-linear radiance (H, W, 3).
    mask
        Pixels of the object in both frames, shape (H, W).
    """
    inside = binary_erosion(mask, iterations=FLOW_RADIUS)
    a, b = (display_referred(frame) @ _LUMA for frame in frames)
    tensor = structure_tensor(a, sigma=FLOW_RADIUS / 2, mode="nearest")
    weight = np.where(inside, structure_tensor_eigenvalues(tensor)[1], 0.0)
    flow = optical_flow_ilk(a, b, radius=FLOW_RADIUS) if inside.any() else np.zeros((2, *mask.shape))
    return Motion(flow, weight)


def sliding(frames: tuple[FloatArray, FloatArray], true: Motion) -> float:
    """Error of the motion between two neighbouring frames: the "wobble" of reflections ([PEM] §6).

    Parameters
    ----------
    frames
        Scene-linear radiance (H, W, 3).
    true
        Motion between the ray-traced frames of the same cameras.

    Returns
    -------
    float
        RMS of the difference of the motions, pixels per frame; NaN where no pixel determines one.
    """
    if true.weight.max(initial=0.0) < _LEAST_TEXTURE:
        return math.nan
    a, b = (display_referred(frame) @ _LUMA for frame in frames)
    difference = optical_flow_ilk(a, b, radius=FLOW_RADIUS) - true.flow
    return float(np.sqrt(np.average(np.sum(difference**2, axis=0), weights=true.weight)))


_LEAST_TEXTURE = 1e-12
"""Squared gradient below which a surface is plain but for rounding."""
_LUMA = np.array([0.2126, 0.7152, 0.0722])
"""Rec. 709."""


def mean_or_none(values: list[float | None]) -> float | None:
    """Mean of the finite values; None if there are none."""
    finite = [value for value in values if value is not None and math.isfinite(value)]
    return math.fsum(finite) / len(finite) if finite else None
