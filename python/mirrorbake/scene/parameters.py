"""The space over which a PEM is parameterized ([PEM] §1: "any number of dimensions").

A space is the product of named axes. Maps are stored at its *nodes*, the grid of the axes' values; *views*
are traced anywhere in it, and each names the nodes whose blend draws it. Both are functions of the space
alone, so that any sample can be made without any other.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mirrorbake.errors import OptionError
from mirrorbake.scene.config_axes import scene_axes

if TYPE_CHECKING:
    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.config_views import Views

Point: TypeAlias = tuple[float, ...]
"""One coordinate per axis."""

PointLike: TypeAlias = float | Sequence[float]
"""A point; a number alone stands for a point of a space of one axis."""

CAMERA_AXES: Mapping[str, str] = {
    "arc": "a parameter of the arc",
    "azimuth": "an azimuth in degrees",
    "elevation": "an elevation in degrees",
}
"""Axes that move the camera and leave the scene as it is, with what their coordinates are."""

SAME_NODE = 1e-6
"""A coordinate this close to a node, in steps of the grid, means the node: it may have been printed with
a few digits."""


@dataclass(frozen=True)
class Axis:
    """One dimension of a space."""

    name: str
    """One of `CAMERA_AXES`, or of the sections that change the scene."""
    values: tuple[float, ...]
    """Where maps are stored: rising, within [low, high]. One value: the same maps serve the whole axis."""
    low: float
    high: float
    period: float | None = None
    """The axis closes after this length, which is high − low; None: it is open."""

    def place(self, value: float) -> list[tuple[int, float]]:
        """Return the one or two nodes that a coordinate within the axis lies at, and their weights."""
        values = self.values
        if len(values) == 1:
            return [(0, 1.0)]
        knots = values if self.period is None else (*values, values[0] + self.period)
        last = len(knots) - 1
        upper = min(max(int(np.searchsorted(knots, value, side="right")), 1), last)
        weight = (value - knots[upper - 1]) / (knots[upper] - knots[upper - 1])
        if abs(weight - round(weight)) < SAME_NODE:
            return [((upper - 1 + round(weight)) % len(values), 1.0)]
        return [(upper - 1, 1.0 - weight), (upper % len(values), weight)]

    def contains(self, value: float) -> bool:
        """Whether a coordinate lies on the axis; all finite ones do if it closes."""
        return math.isfinite(value) if self.period is not None else self.low <= value <= self.high

    def cells(self) -> list[tuple[float, float]]:
        """Return the stretches between neighbouring nodes; the whole axis if there is but one node."""
        values = self.values
        if len(values) == 1:
            return [(self.low, self.high)]
        knots = values if self.period is None else (*values, values[0] + self.period)
        return list(itertools.pairwise(knots))


@dataclass(frozen=True)
class View:
    """A point at which rays are traced."""

    point: Point
    nodes: tuple[tuple[int, float], ...]
    """Numbers of the samples whose blend draws it, with their weights, which sum to 1."""


@dataclass(frozen=True)
class ParameterSpace:
    """A product of axes, the last one running fastest; without any axis it has one sample, the point ()."""

    axes: tuple[Axis, ...] = ()

    def __len__(self) -> int:
        """Return the number of nodes."""
        return math.prod(self.shape)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of nodes along every axis."""
        return tuple(len(axis.values) for axis in self.axes)

    def samples(self) -> list[Point]:
        """Return the points of all nodes, in the order of their numbers."""
        return [tuple(point) for point in itertools.product(*(axis.values for axis in self.axes))]

    def sample(self, index: int) -> Point:
        """Return the point of one node."""
        places = self.places(index)
        return tuple(axis.values[place] for axis, place in zip(self.axes, places, strict=True))

    def point(self, value: PointLike) -> Point:
        """Return a point of this space.

        Raises
        ------
        OptionError
            It has another number of coordinates, or lies outside; the message names the axis.

        Examples
        --------
        >>> ParameterSpace((Axis("arc", (0.0, 1.0), 0.0, 1.0),)).point(0.25)
        (0.25,)
        """
        values = (value,) if isinstance(value, (int, float)) else tuple(value)
        point = tuple(float(coordinate) for coordinate in values)
        if len(point) != len(self.axes):
            names = ", ".join(axis.name for axis in self.axes) or "none"
            raise OptionError(
                f"view = {format_point(point)}: expected {len(self.axes)} coordinates ({names})"
            )
        for axis, coordinate in zip(self.axes, point, strict=True):
            if not axis.contains(coordinate):
                limits = f"from {axis.low:g} to {axis.high:g}" if axis.period is None else "a finite angle"
                raise OptionError(f"view = {format_point(point)}: expected {_meaning(axis.name)}, {limits}")
        return tuple(
            coordinate if axis.period is None else _wrapped(axis, coordinate)
            for axis, coordinate in zip(self.axes, point, strict=True)
        )

    def neighbours(self, point: PointLike) -> list[tuple[int, float]]:
        """Return the nodes whose multilinear blend stands for a point: (number, weight), weights above 0.

        Raises
        ------
        OptionError
            The point is not of this space.

        Examples
        --------
        >>> ParameterSpace((Axis("arc", (0.0, 0.5, 1.0), 0.0, 1.0),)).neighbours(0.625)
        [(1, 0.75), (2, 0.25)]
        """
        values = self.point(point)
        places = [axis.place(value) for axis, value in zip(self.axes, values, strict=True)]
        blend = []
        for corner in itertools.product(*places):
            weight = math.prod(share for _, share in corner)
            blend.append((self.number([place for place, _ in corner]), weight))
        return blend

    def near(self, index: int, radius: int) -> list[int]:
        """Return the nodes at most so many steps of the grid away along every axis, the node itself included.

        Examples
        --------
        >>> ParameterSpace((Axis("arc", (0.0, 0.5, 1.0), 0.0, 1.0),)).near(0, 1)
        [0, 1]
        """
        ranges = []
        for axis, place in zip(self.axes, self.places(index), strict=True):
            steps = range(place - radius, place + radius + 1)
            count = len(axis.values)
            if axis.period is None:
                ranges.append([step for step in steps if 0 <= step < count])
            else:
                ranges.append(sorted({step % count for step in steps}))
        return [self.number(places) for places in itertools.product(*ranges)]

    def middle_after(self, index: int) -> Point | None:
        """Return the centre of the cell that a node begins: as far from maps as can be; None at an open end.

        An axis with a single node stays at it; None if all do.
        """
        middle = []
        for axis, place in zip(self.axes, self.places(index), strict=True):
            cells = axis.cells() if len(axis.values) > 1 else [(axis.values[0], axis.values[0])]
            if place >= len(cells):
                return None
            middle.append(0.5 * (cells[place][0] + cells[place][1]))
        return tuple(middle) if any(count > 1 for count in self.shape) else None

    def view(self, point: PointLike) -> View:
        """Return a point with the nodes that draw it."""
        return View(self.point(point), tuple(self.neighbours(point)))

    def jittered_views(self, per_cell: int, seed: int) -> list[View]:
        """Return views spread over all cells between nodes, at places that depend on cell and seed alone.

        Parameters
        ----------
        per_cell
            Views in each cell, stratified along every axis by a shuffled Latin square.
        seed
            Another seed gives other places.
        """
        views = []
        for number, cell in enumerate(itertools.product(*(axis.cells() for axis in self.axes))):
            views += [self.view(point) for point in jittered(cell, per_cell, (seed, number))]
        return views

    def spread(self, count: int) -> list[Point]:
        """Return points that cover the whole space evenly.

        The ends and even steps between of a single open axis, else a low-discrepancy sequence (M. Roberts,
        The unreasonable effectiveness of quasirandom sequences, 2018: powers of generalised golden ratios).
        """
        free = [axis for axis in self.axes if axis.high > axis.low]
        if not free:
            return [tuple(axis.values[0] for axis in self.axes)]
        if len(free) == 1 and free[0].period is None:
            shares = np.linspace(0.0, 1.0, count)[:, None]
        else:
            ratio = 2.0
            for _ in range(60):
                ratio = (1.0 + ratio) ** (1.0 / (len(free) + 1))
            steps = ratio ** -np.arange(1.0, len(free) + 1.0)
            shares = (0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0
        points = []
        for row in shares:
            along = dict(zip((axis.name for axis in free), row, strict=True))
            points.append(
                tuple(
                    axis.low + float(along.get(axis.name, 0.0)) * (axis.high - axis.low) for axis in self.axes
                )
            )
        return points

    def scene_coordinates(self, point: Point) -> dict[str, float]:
        """Return the coordinates of a point that change the scene, by axis: those that move no camera."""
        return {
            axis.name: value
            for axis, value in zip(self.axes, point, strict=True)
            if axis.name not in CAMERA_AXES
        }

    @property
    def changes_scene(self) -> bool:
        """Whether an axis changes more than the camera."""
        return any(axis.name not in CAMERA_AXES for axis in self.axes)

    def to_attributes(self) -> list[dict[str, Any]]:
        """Return plain values, as a PEM's attributes keep them."""
        return [
            {
                "name": axis.name,
                "values": list(axis.values),
                "low": axis.low,
                "high": axis.high,
                "period": axis.period,
            }
            for axis in self.axes
        ]

    @staticmethod
    def from_attributes(axes: Sequence[Mapping[str, Any]]) -> ParameterSpace:
        """Inverse of `to_attributes`."""
        return ParameterSpace(
            tuple(
                Axis(axis["name"], tuple(axis["values"]), axis["low"], axis["high"], axis["period"])
                for axis in axes
            )
        )

    def places(self, index: int) -> tuple[int, ...]:
        """Return the place of a node along every axis."""
        if not 0 <= index < len(self):
            raise IndexError(f"sample {index} of {len(self)}")
        return tuple(int(place) for place in np.unravel_index(index, self.shape)) if self.axes else ()

    def number(self, places: Sequence[int]) -> int:
        """Return the number of the node at a place along every axis."""
        return int(np.ravel_multi_index(tuple(places), self.shape)) if self.axes else 0


def format_point(point: Point) -> str:
    """Return a point in words.

    >>> format_point((0.5,)), format_point((20.0, 35.5))
    ('0.5', '20,35.5')
    """
    return ",".join(f"{value:g}" for value in point)


def _meaning(axis: str) -> str:
    return CAMERA_AXES.get(axis, f"a parameter of the {axis}")


def _wrapped(axis: Axis, value: float) -> float:
    assert axis.period is not None
    return axis.values[0] + (value - axis.values[0]) % axis.period


def jittered(cell: Sequence[tuple[float, float]], count: int, seed: tuple[int, ...]) -> list[Point]:
    """Return points of a cell, (low, high) along every axis, stratified by a shuffled Latin square."""
    generator = np.random.default_rng(seed)
    columns = [
        low + (generator.permutation(count) + generator.random(count)) / count * (high - low)
        for low, high in cell
    ]
    return [tuple(float(column[i]) for column in columns) for i in range(count)]


_ENDS = 2
"""Nodes of an axis before a plan has decided on them."""


def space_of(config: SceneConfig) -> ParameterSpace:
    """Return the space of a scene file: the camera's axes, then those that change the scene.

    Where a plan is to decide how far apart the maps are, they are at the ends of the axis.
    """
    changes = [_unit_axis(name, axis.count) for name, axis in scene_axes(config).items()]
    return ParameterSpace((*_camera_axes(config.views), *changes))


def _camera_axes(views: Views) -> list[Axis]:
    if views.kind == "arc":
        return [_unit_axis("arc", _ENDS if views.count is None else views.count)]
    if views.kind in ("fixed", "none"):
        return []
    low, high = sorted((views.start, views.start + views.degrees))
    closed = abs(views.degrees) == 360.0
    bottom, top = views.elevation
    azimuths = _even(low, high, _ENDS if views.count is None else views.count, closed=closed)
    elevations = _even(bottom, top, _ENDS if views.rings is None else views.rings, closed=False)
    return [
        Axis("azimuth", tuple(azimuths), low, high, 360.0 if closed else None),
        Axis("elevation", tuple(elevations), bottom, top),
    ]


def _even(low: float, high: float, count: int, *, closed: bool) -> list[float]:
    if count == 1 or low == high:
        return [low if closed else 0.5 * (low + high)]
    return [low + i * (high - low) / (count if closed else count - 1) for i in range(count)]


def _unit_axis(name: str, count: int) -> Axis:
    return Axis(name, tuple(i / (count - 1) for i in range(count)) if count > 1 else (0.0,), 0.0, 1.0)
