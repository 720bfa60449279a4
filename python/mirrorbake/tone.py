"""From scene-linear radiance to what a display shows.

>>> import numpy as np
>>> [round(float(value), 3) for value in tone_map(np.array([0.18, 0.5, 2.0], np.float32))]
[0.185, 0.321, 0.96]
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from mirrorbake.errors import OptionError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

TONES = ("none", "neutral")
Tone = Literal["none", "neutral"]

# Khronos PBR Neutral Tone Mapper, specification 1.0: a dielectric's reflectance, where compression begins,
# how fast what is brighter fades to white.
_FRESNEL = 0.04
_START = 0.8 - _FRESNEL
_DESATURATION = 0.15


def tone_map(radiance: FloatArray) -> FloatArray:
    """Khronos PBR Neutral: keeps colours below 0.8 and compresses what is brighter.

    Parameters
    ----------
    radiance
        Shape (..., 3), scene-linear, after exposure.

    Returns
    -------
    array
        The same shape, linear, in [0, 1].
    """
    colour = np.maximum(np.asarray(radiance, np.float64), 0.0)
    low = colour.min(axis=-1, keepdims=True)
    # What a dielectric reflects of its surroundings is taken off, so that a base colour comes out as painted.
    colour = colour - np.where(low < 2.0 * _FRESNEL, low - low * low / (4.0 * _FRESNEL), _FRESNEL)
    peak = colour.max(axis=-1, keepdims=True)
    room = 1.0 - _START
    bright = peak > _START
    new_peak = 1.0 - room * room / np.where(bright, peak + room - _START, 1.0)
    scaled = colour * new_peak / np.where(bright, peak, 1.0)
    fade = 1.0 - 1.0 / (_DESATURATION * np.maximum(peak - new_peak, 0.0) + 1.0)
    mapped = np.where(bright, scaled + fade * (new_peak - scaled), colour)
    result: FloatArray = mapped.astype(np.float32)
    return result


def displayed(radiance: FloatArray, exposure: float, tone: str) -> FloatArray:
    """Radiance (..., 3) after `exposure` stops and a tone mapping of `TONES`: linear, [0, 1] is what shows.

    Raises
    ------
    OptionError
        The exposure is not from -20 to 20, or the tone mapping is unknown.
    """
    check_display(exposure, tone)
    exposed = np.asarray(radiance * np.float32(2.0**exposure), np.float32)
    return tone_map(exposed) if tone == "neutral" else exposed


def check_display(exposure: float, tone: str) -> None:
    """Raise OptionError for what `displayed` refuses."""
    if not -20.0 <= exposure <= 20.0:
        raise OptionError(f"exposure = {exposure:g}: expected -20 to 20 stops")
    if tone not in TONES:
        raise OptionError(f"tone-map = {tone!r}: expected {' or '.join(TONES)}")


def srgb_bytes(linear: FloatArray) -> NDArray[np.uint8]:
    """Linear values to sRGB in 8 bits (IEC 61966-2-1); clips to [0, 1]."""
    return np.rint(srgb_encoded(linear) * 255.0).astype(np.uint8)


def srgb_encoded(linear: FloatArray) -> NDArray[np.float64]:
    """Linear values as sRGB in [0, 1] (IEC 61966-2-1); clips to [0, 1]."""
    x = np.clip(np.asarray(linear, np.float64), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(x, 1.0 / 2.4) - 0.055)
