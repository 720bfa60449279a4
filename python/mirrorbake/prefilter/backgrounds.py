"""World projections as backgrounds, and chrome from a table of colours: [WP], its last two sections.

Cameras look along −Z with +X to the right and +Y up, turned by ``world_from_camera``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.arrays import real_array
from mirrorbake.projection import vectors

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from mirrorbake.envmap import EnvMap


def rotation(axis: ArrayLike, degrees: float) -> NDArray[np.float64]:
    """3×3 matrix that turns about an axis, counter-clockwise for somebody whom it points at.

    >>> (rotation([0, 1, 0], 90) @ [0, 0, 1]).round(6).tolist()
    [1.0, 0.0, 0.0]
    """
    a = real_array("axis", axis, np.float64)
    length = float(np.linalg.norm(a))
    if a.shape != (3,) or not 0 < length < np.inf:
        raise _core.InvalidArgument(f"axis is {axis!r}, expected three finite numbers that are not all 0")
    x, y, z = a / length
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    turn: NDArray[np.float64] = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return turn


def perspective(width: int, height: int, field_of_view: float) -> NDArray[np.float64]:
    """Directions (height, width, 3) of a camera; ``field_of_view`` is that of the height, in degrees."""
    return _core.lens_directions("perspective", width, height, field_of_view)


def fisheye(size: int, field_of_view: float = 180.0) -> NDArray[np.float64]:
    """Directions (size, size, 3) of an equidistant fisheye, 180° for Omnimax; beyond its disc NaN."""
    return _core.lens_directions("fisheye", size, size, field_of_view)


def background(
    envmap: EnvMap,
    directions: ArrayLike,
    world_from_camera: ArrayLike | None = None,
    world_from_camera_end: ArrayLike | None = None,
    *,
    steps: int = 8,
) -> NDArray[np.float32]:
    """Picture (height, width, C) of what a camera sees of a map, filtered by EWA over every pixel.

    Parameters
    ----------
    envmap
        With its levels, or without: then they are made.
    directions
        (height, width, 3) of the pixels' middles, as `perspective` and `fisheye` give them; NaN stays black.
    world_from_camera
        Rotation 3×3.
    world_from_camera_end
        Where the camera has turned to when the shutter closes. The picture is then the mean along the path of
        every pixel, which differs from pixel to pixel: ``steps`` pieces, each filtered over an ellipse as
        long as it is.
    steps
        Pieces of the path.

    Raises
    ------
    InvalidArgument
        For other shapes, matrices that are no rotations, half a turn, and steps outside of 1 to 1024.
    """
    d = real_array("directions", directions, np.float64)
    if d.ndim != 3 or d.shape[2] != 3 or min(d.shape[:2]) < 2:
        raise _core.InvalidArgument(
            f"directions has shape {d.shape}, expected (height, width, 3), 2 at least"
        )
    start = _matrix("world_from_camera", world_from_camera)
    end = start if world_from_camera_end is None else _matrix("world_from_camera_end", world_from_camera_end)
    maps = envmap if envmap.levels > 1 else envmap.mips()
    count = 1 if world_from_camera_end is None else steps
    return _core.background(maps.layout, maps.values, np.ascontiguousarray(d), start, end, count)


def chrome(colors: ArrayLike, directions: ArrayLike, spread: ArrayLike = 0.0) -> NDArray[np.float32]:
    """Colours (..., C) by the elevation of directions (..., 3) alone: [WP] "cheap chrome effects".

    Parameters
    ----------
    colors
        (n, C) from straight down to straight up, at equal steps of elevation, linear in between.
    directions
        Of any length above 0.
    spread
        Degrees of elevation that a pixel sees, (...): the table is averaged over them.

    Raises
    ------
    InvalidArgument
        For fewer than two colours and directions that are not finite or zero.
    """
    table = real_array("colors", colors, np.float64)
    if table.ndim != 2 or len(table) < 2:
        raise _core.InvalidArgument(f"colors has shape {table.shape}, expected (n, channels), n 2 or more")
    d = vectors("directions", directions, 3).astype(np.float64)
    length = np.linalg.norm(d, axis=-1)
    if not (np.isfinite(length) & (length > 0)).all():
        raise _core.InvalidArgument("directions has NaN, infinite or zero vectors, expected others")
    elevation = np.arcsin(np.clip(d[..., 1] / length, -1, 1)) / np.pi + 0.5
    half = np.maximum(np.asarray(spread, np.float64) / 360, 1e-6)
    low, high = np.clip(elevation - half, 0, 1), np.clip(elevation + half, 0, 1)
    # The integral of straight lines between the colours.
    step = 1 / (len(table) - 1)
    whole = np.concatenate([np.zeros((1, table.shape[1])), np.cumsum((table[1:] + table[:-1]) / 2 * step, 0)])

    def integral(t: NDArray[np.float64]) -> NDArray[np.float64]:
        i = np.minimum((t / step).astype(int), len(table) - 2)
        x = (t - i * step)[..., None]
        slope = (table[i + 1] - table[i]) / step
        result: NDArray[np.float64] = whole[i] + x * (table[i] + x * slope / 2)
        return result

    mean: NDArray[np.float32] = ((integral(high) - integral(low)) / (high - low)[..., None]).astype(
        np.float32
    )
    return mean


def _matrix(name: str, matrix: ArrayLike | None) -> NDArray[np.float64]:
    m = np.eye(3) if matrix is None else np.ascontiguousarray(real_array(name, matrix, np.float64))
    if m.shape != (3, 3):
        raise _core.InvalidArgument(f"{name} has shape {m.shape}, expected (3, 3)")
    return m
