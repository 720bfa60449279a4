"""Where an object that moves is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Pose:
    """Where the object has moved to; lengths in metres.

    It turns about the vertical through the scene's zero, which is the centre of its base at rest.
    """

    offset: NDArray[np.float64]
    """(3,) that it has moved."""
    turned: float
    """Degrees about the vertical."""

    @property
    def rotation(self) -> NDArray[np.float64]:
        """The matrix (3, 3) of the turn."""
        return rotation_matrix((0.0, self.turned, 0.0))

    def moved(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points (..., 3) that move with the object."""
        if not self.turned and not self.offset.any():
            return points
        moved: NDArray[np.float64] = points @ self.rotation.T + self.offset
        return moved

    def at_rest(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Inverse of `moved`."""
        if not self.turned and not self.offset.any():
            return points
        rest: NDArray[np.float64] = (points - self.offset) @ self.rotation
        return rest


AT_REST = Pose(np.zeros(3), 0.0)


def rotation_matrix(degrees: tuple[float, float, float]) -> NDArray[np.float64]:
    """Rotate about x, then y, then z: the matrix `world_from_object`, shape (3, 3)."""
    (sx, cx), (sy, cy), (sz, cz) = ((math.sin(math.radians(d)), math.cos(math.radians(d))) for d in degrees)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    rotation: NDArray[np.float64] = about_z @ about_y @ about_x
    return rotation
