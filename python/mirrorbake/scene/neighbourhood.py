"""What of a parameter space lies around a node, as far as the camera moves: the scene stays the node's."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

from mirrorbake.scene.parameters import CAMERA_AXES, jittered

if TYPE_CHECKING:
    from mirrorbake.scene.parameters import ParameterSpace, View


def beside(space: ParameterSpace, index: int) -> list[int]:
    """Return the nodes one step of the grid away along one axis.

    Examples
    --------
    >>> from mirrorbake.scene.parameters import Axis, ParameterSpace
    >>> beside(ParameterSpace((Axis("arc", (0.0, 0.5, 1.0), 0.0, 1.0),)), 1)
    [0, 2]
    """
    places = space.places(index)
    found = []
    for number, axis in enumerate(space.axes):
        if axis.name not in CAMERA_AXES:
            continue
        count = len(axis.values)
        for place in (places[number] - 1, places[number] + 1):
            if axis.period is not None or 0 <= place < count:
                found.append(space.number([*places[:number], place % count, *places[number + 1 :]]))
    return [other for other in dict.fromkeys(found) if other != index]


def block(space: ParameterSpace, index: int) -> list[int]:
    """Return the nodes of all cells that touch a node, in the order of their numbers."""
    mine = space.places(index)
    still = [number for number, axis in enumerate(space.axes) if axis.name not in CAMERA_AXES]
    return [
        other
        for other in space.near(index, 1)
        if all(space.places(other)[number] == mine[number] for number in still)
    ]


def views_around(space: ParameterSpace, index: int, per_cell: int, seed: int) -> list[View]:
    """Return views in all cells that touch a node; every node of a cell gets the same.

    Parameters
    ----------
    space
        The space.
    index
        Of the node.
    per_cell
        Views in each cell, stratified along every axis by a shuffled Latin square.
    seed
        Another seed gives other places.
    """
    ranges: list[list[tuple[int, tuple[float, float]]]] = []
    for axis, place in zip(space.axes, space.places(index), strict=True):
        if axis.name not in CAMERA_AXES:
            ranges.append([(place, (axis.values[place], axis.values[place]))])
            continue
        cells = axis.cells()
        touching = {0} if len(axis.values) == 1 else {place - 1, place}
        if axis.period is not None:
            touching = {cell % len(cells) for cell in touching}
        ranges.append([(cell, cells[cell]) for cell in sorted(touching) if 0 <= cell < len(cells)])
    views = []
    for combination in itertools.product(*ranges):
        key = (seed, *(number for number, _ in combination))
        points = jittered([cell for _, cell in combination], per_cell, key)
        views += [space.view(point) for point in points]
    return views
