"""Views beside an arc that its samples are fitted to, too, so that their maps hold off the arc."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mirrorbake.scene.cameras import Cameras
    from mirrorbake.scene.parameters import Point

STRIPS = (3.0, 8.0)
"""Half the widths, in degrees, of the strips along an arc over which the views are spread."""
WEIGHT = 0.56
"""Of the pixels of all views around a sample together, were they all next to it; its own view has 1."""
HALF_AT = 4.0
"""Degrees from the sample at which a view counts half."""
HIGHEST = 85.0
"""Elevation, degrees, up to which there are views."""
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


class PlaceAround(NamedTuple):
    """From where a view beside an arc is traced, and how much it counts."""

    azimuth: float
    """Degrees, as of `Cameras.around`."""
    elevation: float
    weight: float
    """Of its pixels in the fit of the sample."""


def places_around(cameras: Cameras, point: Point, count: int) -> list[PlaceAround]:
    """Return views around a sample of an arc.

    Half of them lie in a disc of `STRIPS[0]` degrees around it, the others in a ring from there to
    `STRIPS[1]`. The places are points of two lattices along the whole arc that go on beyond its ends, so that
    neighbouring samples share them and a sample's are a function of the scene and its own place.

    Parameters
    ----------
    cameras
        Of the arc.
    point
        Of the sample.
    count
        Of views around a sample, in the mean.

    Examples
    --------
    >>> from mirrorbake.scene.cameras import Cameras
    >>> arc = Cameras("arc", (0.0, 0.0, 0.0), 1.0, 0.36, 20.0, 4.0, 30.0, (8, 8))
    >>> len(places_around(arc, (0.0,), 8)), len(places_around(arc, (1.0,), 0))
    (6, 0)
    """
    azimuth, elevation = cameras.angles_of(cameras.eye(point))
    if count <= 0:
        return []
    across = max(math.cos(math.radians(elevation)), 1e-3)
    places = []
    inner = 0.0
    for outer in STRIPS:
        area = math.pi * (outer**2 - inner**2) / (0.5 * count)
        for along, up in _lattice(azimuth * across, outer, area):
            away = math.hypot(along - azimuth * across, up)
            if inner < away <= outer and abs(elevation + up) <= HIGHEST:
                weight = WEIGHT / count / (1.0 + (away / HALF_AT) ** 2)
                places.append(PlaceAround(along / across, elevation + up, weight))
        inner = outer
    return places


def _lattice(middle: float, half: float, area: float) -> Iterator[tuple[float, float]]:
    """Yield the points of a strip, degrees along and across it, that are up to `half` from a place along it.

    Neighbours along are a golden ratio of the strip's width apart across, so that any stretch is covered
    evenly. Each point stands for `area`, square degrees.
    """
    step = area / (2.0 * half)
    for number in range(math.ceil((middle - half) / step), math.floor((middle + half) / step) + 1):
        yield number * step, half * (2.0 * ((0.5 + number * GOLDEN) % 1.0) - 1.0)
