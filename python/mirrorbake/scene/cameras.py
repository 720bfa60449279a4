"""The cameras of a parameter space."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from mirrorbake import _core

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.scene.config_views import Views
    from mirrorbake.scene.parameters import Point

DEFAULT_ELEVATION_DEGREES = 20.0

FRAME_FILL = 0.9
"""Fraction of the frame's height that the object's bounding sphere takes at the default distance."""


@dataclass(frozen=True)
class Cameras:
    """Where the eye is, as a function of a point's first coordinates. Lengths in metres, angles in degrees.

    On an arc about the vertical through `centre`, on a dome about it, or at one place. The further
    coordinates are the scene's.
    """

    kind: Literal["arc", "dome", "fixed"]
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

    def eye(self, point: Point) -> tuple[float, float, float]:
        """Return the eye's position, world space."""
        radius, height, azimuth = self.radius, self.height, self.start
        if self.kind == "arc":
            azimuth += point[0] * self.degrees
        elif self.kind == "dome":
            azimuth, elevation = point[0], math.radians(point[1])
            radius, height = self.radius * math.cos(elevation), self.radius * math.sin(elevation)
        angle = math.radians(azimuth)
        x, y, z = self.centre
        return (x + radius * math.sin(angle), y + height, z + radius * math.cos(angle))

    def camera(self, point: Point) -> _core.Camera:
        """Return the camera of a point."""
        width, height = self.size
        return _core.Camera(
            self.eye(point), self.centre, vertical_fov_degrees=self.fov, width=width, height=height
        )


def resolve_cameras(views: Views, positions: NDArray[np.floating]) -> Cameras:
    """Return the cameras with what the scene file leaves to the object's size filled in.

    Parameters
    ----------
    views
        The section of the scene file.
    positions
        (V, 3) of the object, world space.
    """
    low, high = positions.min(axis=0).astype(float), positions.max(axis=0).astype(float)
    middle = 0.5 * (low + high)
    centre = views.centre or (middle[0], middle[1], middle[2])
    elevation = math.radians(DEFAULT_ELEVATION_DEGREES)
    sphere = 0.5 * float(np.linalg.norm(high - low))
    distance = sphere / (FRAME_FILL * math.sin(math.radians(0.5 * views.fov)))
    if views.kind == "dome":
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
    )
