"""The cameras of a scene's views."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core

if TYPE_CHECKING:
    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.config import (
        Views,
    )

DEFAULT_ELEVATION_DEGREES = 20.0

FRAME_FILL = 0.9
"""Fraction of the frame's height that the object's bounding sphere takes at the default distance."""


@dataclass(frozen=True)
class Arc:
    """The path of the eye: a circular arc about the vertical through `centre`. Lengths in metres."""

    centre: tuple[float, float, float]
    radius: float
    height: float
    start: float
    degrees: float
    fov: float
    size: tuple[int, int]

    def eye(self, t: float) -> tuple[float, float, float]:
        """Return the eye's position for t in [0,1], world space."""
        angle = math.radians(self.start + t * self.degrees)
        x, y, z = self.centre
        return (x + self.radius * math.sin(angle), y + self.height, z + self.radius * math.cos(angle))

    def camera(self, t: float) -> _core.Camera:
        """Return the camera for t in [0,1]."""
        width, height = self.size
        return _core.Camera(
            self.eye(t), self.centre, vertical_fov_degrees=self.fov, width=width, height=height
        )


def resolve_arc(views: Views, positions: FloatArray) -> Arc:
    low, high = positions.min(axis=0).astype(float), positions.max(axis=0).astype(float)
    middle = 0.5 * (low + high)
    centre = views.centre or (middle[0], middle[1], middle[2])
    elevation = math.radians(DEFAULT_ELEVATION_DEGREES)
    sphere = 0.5 * float(np.linalg.norm(high - low))
    distance = sphere / (FRAME_FILL * math.sin(math.radians(0.5 * views.fov)))
    radius = distance * math.cos(elevation) if views.radius is None else views.radius
    height = radius * math.tan(elevation) if views.height is None else views.height
    return Arc(
        centre=(float(centre[0]), float(centre[1]), float(centre[2])),
        radius=radius,
        height=height,
        start=views.start,
        degrees=views.degrees,
        fov=views.fov,
        size=views.size,
    )
