"""Sphere maps that draw instead of light: [EMT] §4, figure 15.

All are looked up by the direction of the reflection in the space of the eye, so that they stay with the
viewer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter

from mirrorbake import _core
from mirrorbake.envmap import EnvMap

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

STYLES = ("window", "cold_warm", "silhouette", "hatching")
_PARTS = 8  # of a texel, along each side


def style(name: str, size: int = 256) -> EnvMap:
    """Sphere map of one of `STYLES`, with all its levels.

    ``window``: a window frame in black and white. ``cold_warm``: blue below, yellow above and a white
    highlight, blurred (Gooch). ``silhouette``: black where the surface turns away, as many texels wide in
    every level, so that lines have the same width on the screen wherever they are. ``hatching``: strokes
    that grow denser towards the silhouette.

    Raises
    ------
    InvalidArgument
        For other names, and sizes that are not 8 to 4096.

    Examples
    --------
    >>> style("silhouette", 64).level(0)[32, 32].tolist()
    [1.0, 1.0, 1.0]
    """
    if name not in STYLES:
        raise _core.InvalidArgument(f"name is {name!r}, expected {', '.join(STYLES)}")
    if not 8 <= size <= 4096:
        raise _core.InvalidArgument(f"size is {size}, expected 8 to 4096 texels")
    if name == "silhouette":
        return _silhouette(size)
    draw: dict[str, Callable[[int], NDArray[np.float64]]] = {
        "window": _window,
        "cold_warm": _cold_warm,
        "hatching": _hatching,
    }
    return EnvMap.from_array(draw[name](size).astype(np.float32), "sphere_map").mips()


def _places(size: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    # x to the right and y up, in [−1, 1], several in every texel.
    across = (np.arange(size * _PARTS) + 0.5) / (size * _PARTS) * 2 - 1
    x, y = np.meshgrid(across, -across)
    return x, y


def _mean(values: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    mean: NDArray[np.float64] = values.reshape(size, _PARTS, size, _PARTS, -1).mean((1, 3))
    return np.broadcast_to(mean, (size, size, 3)) if mean.shape[2] == 1 else mean


def _window(size: int) -> NDArray[np.float64]:
    # Two panes by two, to the upper left, as light from a window is painted.
    x, y = _places(size)
    u, v = (x + 0.25) / 0.3, (y - 0.3) / 0.35
    pane = (np.abs(u) < 1) & (np.abs(v) < 1) & (np.abs(u) > 0.12) & (np.abs(v) > 0.1)
    return _mean(pane.astype(np.float64), size)


def _cold_warm(size: int) -> NDArray[np.float64]:
    x, y = _places(size)
    warm = (y > -x)[..., None]
    color = np.where(warm, [0.9, 0.75, 0.2], [0.1, 0.15, 0.6])
    color[np.hypot(x - 0.3, y - 0.4) < 0.22] = 1.0
    blurred: NDArray[np.float64] = gaussian_filter(
        _mean(color, size), (size / 12, size / 12, 0), mode="nearest"
    )
    return blurred


def _hatching(size: int) -> NDArray[np.float64]:
    x, y = _places(size)
    radius = np.hypot(x, y)
    # Strokes of a share of their distance that rises from nothing at half the radius.
    share = np.clip((radius - 0.5) / 0.45, 0, 0.9)
    stroke = np.abs(np.mod((x + y) * 14, 1) - 0.5) * 2 < share
    crossing = np.abs(np.mod((x - y) * 14, 1) - 0.5) * 2 < np.clip((radius - 0.8) / 0.3, 0, 0.9)
    return _mean((~(stroke | crossing)).astype(np.float64), size)


def _silhouette(size: int) -> EnvMap:
    levels = _core.full_level_count(size, size)
    blocks = []
    for level in range(levels):
        side = max(1, size >> level)
        x, y = _places(side)
        # Two texels of the level, but never all of the disc.
        width = min(4.0 / side, 0.5)
        blocks.append(_mean((np.hypot(x, y) < 1 - width).astype(np.float64), side).astype(np.float32).ravel())
    layout = _core.EnvMapLayout("sphere_map", size, size, levels, 3)
    return EnvMap(layout, np.concatenate(blocks), ["R", "G", "B"])
