"""The place from which an object's surroundings are seen: its middle, or one beside what stands there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.errors import InputError

if TYPE_CHECKING:
    from mirrorbake.scene.stage import Stage

    Place = tuple[float, float, float]

CELLS = 9
"""Places that are tried along each side of the object's bounding box."""


@dataclass(frozen=True)
class CapturePlace:
    """Where the maps' origin is."""

    position: Place
    inside: str | None
    """The object that the middle lies inside, so that the place is another; None: it is the middle."""


def capture_place(stage: Stage) -> CapturePlace:
    """Return the place from which all maps but the local ones are seen.

    That is the middle of the object, unless it lies inside another one, as a ring's does around a pole: from
    there a map would show the dark inside of that. Then it is the nearest of a grid of places in the object's
    box from which no other object is in the way. One that holds the whole box is a room and not in the way.

    Raises
    ------
    InputError
        There is none: other objects fill the box.
    """
    built = stage.built
    x, y, z = _core.area_weighted_centroid(built.positions, built.triangles)
    middle: Place = (float(x), float(y), float(z))
    low, high = built.positions.min(axis=0).astype(float), built.positions.max(axis=0).astype(float)
    names = built.scene.object_names
    others = {
        names[number]: mesh
        for number, mesh in enumerate(map(built.scene.object_mesh, range(len(names))))
        if number != built.reflector and _overlaps(mesh, low, high)
    }
    inside = next((name for name, mesh in others.items() if _core.encloses(mesh, middle)), None)
    if inside is None:
        return CapturePlace(middle, None)
    steps = (np.arange(CELLS) + 0.5) / CELLS
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    places = low + grid * (high - low)
    distance = np.sum((places - middle) ** 2, axis=1)
    places = places[np.argsort(distance, kind="stable")]
    held = {
        name: np.array([_core.encloses(mesh, tuple(place)) for place in places.tolist()])
        for name, mesh in others.items()
    }
    in_the_way = [within for within in held.values() if not within.all()]
    if held[inside].all():
        return CapturePlace(middle, None)
    free = ~np.any(in_the_way, axis=0)
    if not free.any():
        raise InputError(
            f"reflector: its middle, ({x:.4g}, {y:.4g}, {z:.4g}), lies inside the object {inside!r}, and no "
            "place in its bounding box is free; expected an object with space around it"
        )
    x, y, z = places[np.argmax(free)].tolist()
    return CapturePlace((x, y, z), inside)


def _overlaps(mesh: _core.TriangleMesh, low: np.ndarray, high: np.ndarray) -> bool:
    positions = np.asarray(mesh.positions)
    return bool(np.all(positions.min(axis=0) <= high) and np.all(positions.max(axis=0) >= low))
