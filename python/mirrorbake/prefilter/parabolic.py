"""Phong by two filters of constant size on paraboloid maps, as hardware of 1999 did it: [EMT] §3.2.5.

A lobe of the sphere is nearly a disc anywhere on a paraboloid map, but twice as wide at the rim as in the
middle. So the map is filtered twice, with the smallest and the largest radius, and both are blended by d²,
the squared distance from the centre of the map.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import fftconvolve

from mirrorbake import _core
from mirrorbake.envmap import EnvMap

if TYPE_CHECKING:
    from numpy.typing import NDArray


def filter_radii(exponent: float, clamp: float = 0.1) -> tuple[float, float]:
    """Smallest and largest radius, in halves of a face, at which the lobe has fallen to ``clamp``.

    Raises
    ------
    InvalidArgument
        For an exponent below 1, or a clamp outside of (0, 1).
    """
    if not exponent >= 1:
        raise _core.InvalidArgument(f"exponent is {exponent}, expected 1 or more")
    if not 0 < clamp < 1:
        raise _core.InvalidArgument(f"clamp is {clamp}, expected between 0 and 1")
    angle = np.arccos(clamp ** (1 / exponent))
    return float(np.tan(angle / 2)), float(1 - np.tan((np.pi / 2 - angle) / 2))


def filter_widths(exponent: float, size: int = 512, clamp: float = 0.1) -> tuple[int, int]:
    """Widths of both filters in texels of faces of ``size``: the table of [EMT] §3.2.5.

    >>> [filter_widths(n) for n in (10, 50, 100, 250, 500)]
    [(174, 260), (78, 136), (56, 100), (36, 66), (26, 48)]
    """
    small, large = (2 * int(np.ceil(radius * size / 2)) for radius in filter_radii(exponent, clamp))
    return small, large


def shrink_factors(exponent: float, size: int = 512, clamp: float = 0.1, largest: int = 7) -> tuple[int, int]:
    """Powers of two by which hardware with filters of ``largest`` texels has to shrink the map first.

    >>> shrink_factors(10), shrink_factors(500)
    ((32, 64), (4, 8))
    """
    small, large = (
        1 << max(0, int(np.ceil(np.log2(width / largest)))) for width in filter_widths(exponent, size, clamp)
    )
    return small, large


def distortion(radius: float, distance: float) -> float:
    """By which share the radii of a circle on the map differ from their mean on the sphere: fig. 12.

    Circles stay circles, since a paraboloid map is a stereographic projection, but not about the image of
    their centre; radii count from there.

    Parameters
    ----------
    radius
        Of the circle, in halves of a face.
    distance
        Of its centre from that of the map, in the same unit.

    Examples
    --------
    >>> round(distortion(0.5, 1.0), 2), distortion(0.5, 0.0)
    (0.24, 0.0)
    """
    # Farthest and nearest lie on the line through the centre of the map.
    outer = 2 * (np.arctan(distance + radius) - np.arctan(distance))
    inner = 2 * (np.arctan(distance) - np.arctan(distance - radius))
    return float(abs(inner - outer) / (inner + outer))


def parabolic_phong(envmap: EnvMap, exponent: float, size: int = 128, clamp: float = 0.1) -> EnvMap:
    """Normalised Phong map, approximately, as a dual paraboloid.

    Faces get a border of the other hemisphere as wide as the larger filter.

    Parameters
    ----------
    envmap
        Any map.
    exponent
        1 or more.
    size
        Texels of a face.
    clamp
        Weights below it are left out.

    Raises
    ------
    InvalidArgument
        For values out of range, and lobes so wide that the border would be wider than a face.
    """
    source = envmap.resample("dual_paraboloid", size)
    border = filter_widths(exponent, size, clamp)[1] // 2
    if border > size:
        raise _core.InvalidArgument(f"exponent is {exponent}, expected a filter no wider than the map")
    wide = source.with_border(border).astype(np.float64)
    place = (np.arange(size) + 0.5) / size * 2 - 1
    blend = np.minimum(1, place[:, None] ** 2 + place[None, :] ** 2)[..., None]
    small, large = (
        _filtered(wide, _kernel(radius, exponent, size, clamp), border)
        for radius in filter_radii(exponent, clamp)
    )
    return EnvMap.from_array(((1 - blend) * small + blend * large).astype(np.float32), "dual_paraboloid")


def _kernel(radius: float, exponent: float, size: int, clamp: float) -> NDArray[np.float64]:
    # Phong's weight at the angle that the radius stands for, of which the rim is that of the clamp.
    half = int(np.ceil(radius * size / 2))
    offset = np.arange(-half, half + 1) / (radius * size / 2)
    share = np.hypot(offset[:, None], offset[None, :])
    weight = np.cos(np.minimum(share * np.arccos(clamp ** (1 / exponent)), np.pi / 2)) ** exponent
    kernel: NDArray[np.float64] = np.where(share <= 1, weight, 0)
    kernel /= kernel.sum()
    return kernel


def _filtered(wide: NDArray[np.float64], kernel: NDArray[np.float64], border: int) -> NDArray[np.float64]:
    result: NDArray[np.float64] = fftconvolve(wide, kernel[None, :, :, None], mode="same", axes=(1, 2))
    size = wide.shape[1] - 2 * border
    return result[:, border : border + size, border : border + size]
