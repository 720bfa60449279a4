"""The projections of the sphere: positions in maps from directions, directions from positions, solid angles.

A projection is named by a string: ``cube``, ``dual_paraboloid``, ``sphere_map``, ``latlong``, ``equal_area``,
``angular``, ``fisheye`` (180°) or ``fisheye:DEGREES``. Positions (x, y) run to the right and up, both in
[-1, 1] from the centre of a face.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.arrays import real_array

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "MAP_PROJECTIONS",
    "directions_from_points",
    "dual_paraboloid_texture_matrix",
    "points_from_directions",
    "solid_angle_density",
    "texel_directions",
    "texel_solid_angles",
]

MAP_PROJECTIONS: Mapping[str, _core.MapProjection] = _core.map_projections()
"""Those in which the maps of a PEM can be kept, by their names in scene files."""


def vectors(name: str, values: ArrayLike, components: int) -> NDArray[np.float32]:
    """Return values of shape (..., components) as float32.

    Raises
    ------
    InvalidArgument
        For other shapes; it calls the values by ``name``.
    TypeError
        For values that are not real numbers.
    """
    array = real_array(name, values, np.float32)
    if array.shape[-1:] != (components,):
        raise _core.InvalidArgument(f"{name} has the shape {array.shape}, expected (..., {components})")
    return array


def points_from_directions(
    projection: str, directions: ArrayLike
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Faces and positions of directions.

    Parameters
    ----------
    projection
        Name of the projection.
    directions
        Shape (..., 3), of any finite length above 0.

    Returns
    -------
    faces, points
        Shapes (...) and (..., 2). Directions that a fisheye does not cover lie on its rim.

    Raises
    ------
    InvalidArgument
        For NaN, infinite and zero directions, and for other shapes.

    Examples
    --------
    >>> face, point = points_from_directions("cube", [1.0, 0.5, -2.0])
    >>> int(face), point.tolist()
    (5, [-0.5, 0.25])
    """
    array = vectors("directions", directions, 3)
    faces, points = _core.points_from_directions(projection, array.reshape(-1, 3))
    return faces.reshape(array.shape[:-1]), points.reshape((*array.shape[:-1], 2))


def directions_from_points(projection: str, faces: ArrayLike, points: ArrayLike) -> NDArray[np.float32]:
    """Unit directions (..., 3) at positions (..., 2) of faces (...).

    Positions may lie outside of [-1, 1]: what lies there is the continuation of the projection.

    Raises
    ------
    InvalidArgument
        For faces that do not exist and positions that are not finite.
    """
    array = vectors("points", points, 2)
    numbers = np.broadcast_to(real_array("faces", faces, np.int32), array.shape[:-1])
    directions = _core.directions_from_points(
        projection, np.ascontiguousarray(numbers.reshape(-1)), array.reshape(-1, 2)
    )
    return directions.reshape((*array.shape[:-1], 3))


def texel_directions(projection: str, width: int, height: int, face: int = 0) -> NDArray[np.float32]:
    """Unit directions (height, width, 3) of the centres of the texels of a face."""
    x = (2.0 * np.arange(width) + 1.0) / width - 1.0
    y = 1.0 - (2.0 * np.arange(height) + 1.0) / height
    points = np.stack(np.meshgrid(x, y), axis=-1)
    return directions_from_points(projection, face, points)


def texel_solid_angles(projection: str, width: int, height: int) -> NDArray[np.float64]:
    """Solid angles in steradians (height, width) of the texels of a face; faces are alike.

    Exact to a relative 1e-12. Texels outside of the disc of a round map have 0.

    Examples
    --------
    >>> float(6 * texel_solid_angles("cube", 64, 64).sum() / np.pi).__round__(12)
    4.0
    """
    return _core.texel_solid_angles(projection, width, height)


def solid_angle_density(projection: str, face: int, x: float, y: float) -> float:
    """Solid angle per unit of area of (x, y) at a position, in steradians ([EMT] eq. 2)."""
    return _core.solid_angle_density(projection, face, x, y)


def dual_paraboloid_texture_matrix(frame_from_map: ArrayLike, face: int) -> NDArray[np.float32]:
    """4×4 texture matrix of [EMT] eq. 9–12 for the front (0) or back (1) paraboloid.

    Applied to (r, 1), r the unit reflection vector in the space of ``frame_from_map`` (3×3, orthonormal), it
    gives (s q, t q, ·, q), with t downwards.
    """
    matrix = real_array("frame_from_map", frame_from_map, np.float32)
    return _core.dual_paraboloid_texture_matrix(np.ascontiguousarray(matrix), face)
