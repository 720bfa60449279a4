"""Where a scene has its zero: near the object, since float32 positions are coarse far from theirs."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Loaded = TypeVar("Loaded")

Origin = tuple[float, float, float]
"""In the coordinates of a file, metres, double precision."""

WORLD: Origin = (0.0, 0.0, 0.0)

FAR = 16.0
"""Radii of a thing from zero beyond which it gets a zero of its own. Below, rounding moves its points by
less than a millionth of its size."""


def origin_near(positions: NDArray[np.floating]) -> Origin:
    """Return a zero for a thing: its middle if that is far away, else the zero that it has.

    Parameters
    ----------
    positions
        (V, 3).

    Examples
    --------
    >>> origin_near(np.array([[1e5, 0, 0], [1e5 + 2, 0, 0]]))
    (100001.0, 0.0, 0.0)
    >>> origin_near(np.array([[3.0, 0, 0], [5, 0, 0]]))
    (0.0, 0.0, 0.0)
    """
    low, high = positions.min(axis=0).astype(np.float64), positions.max(axis=0).astype(np.float64)
    middle, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    if np.linalg.norm(middle) <= FAR * radius:
        return WORLD
    return (float(middle[0]), float(middle[1]), float(middle[2]))


def loaded_nearby(
    load: Callable[[Origin], Loaded], positions_of: Callable[[Loaded], NDArray[np.floating]]
) -> tuple[Loaded, Origin]:
    """Load a file, again with a zero of its own if what is in it lies far from the file's.

    Parameters
    ----------
    load
        Reads the file relative to a place.
    positions_of
        (V, 3) of what matters in it.
    """
    loaded = load(WORLD)
    origin = origin_near(positions_of(loaded))
    return (loaded, origin) if origin == WORLD else (load(origin), origin)
