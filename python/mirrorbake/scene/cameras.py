"""The cameras of a parameter space."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from mirrorbake import _core

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from mirrorbake.scene.config_views import Views
    from mirrorbake.scene.parameters import Point

DEFAULT_ELEVATION_DEGREES = 20.0

SAME_DIRECTION = 1e-5
"""Radians by which eyes may differ in float32."""

FRAME_FILL = 0.9
"""Fraction of the frame's height that the object's bounding sphere takes at the default distance."""


@dataclass(frozen=True)
class Cameras:
    """Where the eye is, as a function of a point's first coordinates. Lengths in metres, angles in degrees.

    On an arc about the vertical through `centre`, on a dome about it, or at one place. The further
    coordinates are the scene's.
    """

    kind: Literal["arc", "dome", "fixed", "none"]
    centre: tuple[float, float, float]
    """All cameras look at it."""
    radius: float
    """Of the arc's circle, or of the dome's sphere."""
    height: float
    """Of the arc above the centre; of no meaning for a dome."""
    start: float
    degrees: float
    fov: float
    size: tuple[int, int]
    elevation: tuple[float, float] = (0.0, 0.0)
    """Of a dome, and of `none`: the lowest and the highest."""

    def eye(self, point: Point) -> tuple[float, float, float]:
        """Return the eye's position."""
        radius, height, azimuth = self.radius, self.height, self.start
        if self.kind == "arc":
            azimuth += point[0] * self.degrees
        elif self.kind == "dome":
            azimuth, elevation = point[0], math.radians(point[1])
            radius, height = self.radius * math.cos(elevation), self.radius * math.sin(elevation)
        elif self.kind == "none":
            azimuth += 0.5 * self.degrees
            elevation = math.radians(0.5 * (self.elevation[0] + self.elevation[1]))
            radius, height = self.radius * math.cos(elevation), self.radius * math.sin(elevation)
        angle = math.radians(azimuth)
        x, y, z = self.centre
        return (x + radius * math.sin(angle), y + height, z + radius * math.cos(angle))

    def camera(self, point: Point) -> _core.Camera:
        """Return the camera of a point."""
        return self._looking_from(self.eye(point))

    def around(self, azimuth: float, elevation: float) -> _core.Camera:
        """Return a camera at any azimuth and elevation, degrees, as far from the centre as all others."""
        distance = self.radius
        if self.kind in ("arc", "fixed"):
            distance = math.hypot(self.radius, self.height)
        a, e = math.radians(azimuth), math.radians(elevation)
        x, y, z = self.centre
        return self._looking_from(
            (
                x + distance * math.cos(e) * math.sin(a),
                y + distance * math.sin(e),
                z + distance * math.cos(e) * math.cos(a),
            )
        )

    def _looking_from(self, eye: tuple[float, float, float]) -> _core.Camera:
        width, height = self.size
        return _core.Camera(eye, self.centre, vertical_fov_degrees=self.fov, width=width, height=height)

    def angles_of(self, eye: Sequence[float]) -> tuple[float, float]:
        """Return azimuth and elevation of a place as the centre sees it, degrees."""
        x, y, z = (float(a) - b for a, b in zip(eye, self.centre, strict=True))
        return math.degrees(math.atan2(x, z)), math.degrees(math.atan2(y, math.hypot(x, z)))

    def range(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the azimuths and the elevations that the cameras have: lowest and highest, degrees."""
        low, high = sorted((self.start, self.start + self.degrees))
        if self.kind == "fixed":
            low = high = self.start
        if self.kind in ("dome", "none"):
            return (low, high), self.elevation
        elevation = math.degrees(math.atan2(self.height, self.radius))
        return (low, high), (elevation, elevation)

    def degrees_outside(self, eye: Sequence[float]) -> float:
        """Return how far a place is from where the cameras are, seen from the centre; 0 among them.

        The nearest of them is looked for at the nearest azimuth and elevation, which is exact unless both
        lie beyond.
        """
        (low, high), (bottom, top) = self.range()
        azimuth, elevation = self.angles_of(eye)
        middle = 0.5 * (low + high)
        turn = (azimuth - middle + 180.0) % 360.0 - 180.0
        turn = min(max(turn, low - middle), high - middle)
        nearest = self.around(middle + turn, min(max(elevation, bottom), top)).eye
        a, b = (np.array(place, float) - np.array(self.centre) for place in (eye, nearest))
        angle = math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b))
        return math.degrees(angle) if angle > SAME_DIRECTION else 0.0


def resolve_cameras(
    views: Views, positions: NDArray[np.floating], origin: Sequence[float] = (0.0, 0.0, 0.0)
) -> Cameras:
    """Return the cameras with what the scene file leaves to the object's size filled in.

    Parameters
    ----------
    views
        The section of the scene file.
    positions
        (V, 3) of the object.
    origin
        Where their zero lies in the scene file's world.
    """
    low, high = positions.min(axis=0).astype(float), positions.max(axis=0).astype(float)
    middle = 0.5 * (low + high)
    centre = middle if views.centre is None else np.subtract(views.centre, origin)
    elevation = math.radians(DEFAULT_ELEVATION_DEGREES)
    sphere = 0.5 * float(np.linalg.norm(high - low))
    distance = sphere / (FRAME_FILL * math.sin(math.radians(0.5 * views.fov)))
    if views.kind in ("dome", "none"):
        radius, height = views.radius or distance, 0.0
    else:
        radius = distance * math.cos(elevation) if views.radius is None else views.radius
        height = radius * math.tan(elevation) if views.height is None else views.height
    return Cameras(
        kind=views.kind,
        centre=(float(centre[0]), float(centre[1]), float(centre[2])),
        radius=radius,
        height=height,
        start=views.start,
        degrees=views.degrees,
        fov=views.fov,
        size=views.size,
        elevation=views.elevation,
    )
