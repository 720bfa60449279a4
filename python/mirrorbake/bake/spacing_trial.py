"""Trial bakes of single cells: how well views between maps are met, by how far apart the maps are."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from mirrorbake.bake.estimate import bytes_of_pictures, stored_bytes
from mirrorbake.bake.quality import NEAR_DEGREES
from mirrorbake.bake.sample import SampleBaker
from mirrorbake.bake.trial import Look, blended, small_bake, small_plan
from mirrorbake.scene.parameters import space_of
from mirrorbake.scene.spacing_law import SpacingTrial

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mirrorbake.bake.sample import Maps
    from mirrorbake.bake.targets import TracedView
    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.parameters import ParameterSpace, Point
    from mirrorbake.scene.plan import Plan
    from mirrorbake.scene.stage import Stage

    Ranges = list[tuple[float, float]]

PLACES = 3
"""Views in a cell that are held out."""
NEAR_NODES = 4
"""Along an axis of a trial whose maps are fitted to neighbours' views, which the middle cell has all."""


@dataclass(frozen=True)
class CameraAxis:
    """An axis along which the cameras of a scene move, with the number of its maps open or given."""

    key: Literal["count", "rings"]
    extent: float
    """Degrees."""
    closed: bool
    nodes: int | None
    """None: open."""

    def spacing(self, nodes: int) -> float:
        """Degrees between so many maps; 0 where there is but one."""
        gaps = nodes if self.closed else nodes - 1
        return self.extent / gaps if gaps > 0 else 0.0

    def nodes_for(self, degrees: float) -> int:
        """Return the fewest maps that are no further apart, or as many as are given."""
        if self.nodes is not None:
            return self.nodes
        gaps = math.ceil(self.extent / degrees - 1e-9)
        return max(gaps, 3) if self.closed else gaps + 1

    def step(self, degrees: float) -> float:
        """Degrees between maps, where they are open to be so far apart."""
        return degrees if self.nodes is None else self.spacing(self.nodes)


def camera_axes(config: SceneConfig) -> list[CameraAxis]:
    """Return the axes of a scene with an arc or a dome."""
    views = config.views
    extent = abs(views.degrees)
    if views.kind == "arc":
        return [CameraAxis("count", extent, closed=False, nodes=views.count)]
    bottom, top = views.elevation
    return [
        CameraAxis("count", extent, closed=extent == 360.0, nodes=views.count),
        CameraAxis("rings", top - bottom, closed=False, nodes=views.rings),
    ]


@dataclass(frozen=True)
class CellTrial:
    """What a trial found, and what a bake like it takes."""

    found: SpacingTrial
    view_seconds: float
    """To trace one view."""
    row_seconds: float
    """For one view in one fit."""
    bytes: float
    """Of a sample."""
    around: int
    """Views beside an arc, around each sample."""


def cell_trial(
    stage: Stage, plan_of: Callable[[Stage], Plan], degrees: float, traced: int | None = None
) -> CellTrial | None:
    """Bake a cell in the middle of a scene, small, and look at views within it that are in no fit.

    Parameters
    ----------
    stage
        Of the scene, in its parts.
    plan_of
        Decides the rest, for a stage whose maps have their places.
    degrees
        Between maps along the axes where that is open.
    traced
        Views in the cell that are traced, too; None: as the plan has it.

    Returns
    -------
    CellTrial
        None: the views in the cell do not see the object.
    """
    cell = _cell(stage, degrees)
    plan = plan_of(cell)
    small, contents = small_bake(cell, small_plan(plan, {} if traced is None else {"views.traced": traced}))
    space, ranges = small.space, _middle_cell(small.space)
    corners = [node for node, _ in space.neighbours([0.5 * (low + high) for low, high in ranges])]
    baker = SampleBaker(small, contents)
    maps: dict[int, Maps] = {}
    views: dict[int, TracedView] = {}
    rows, tracing, fitting = 0, 0.0, 0.0
    for corner in corners:
        if corner in maps:
            continue
        start = time.perf_counter()
        nodes, seen = baker.with_neighbours(corner)
        middle = time.perf_counter()
        fitted = baker.fit(nodes, seen)
        tracing += middle - start
        fitting += time.perf_counter() - middle
        rows += len(seen)
        views.update({id(one.view): one.view for one in seen})
        # Where all nodes are in one fit, that of any other is the same.
        maps.update(fitted if len(nodes) == len(space) else {corner: fitted[corner]})
    looks = [Look(small, contents.header, place) for place in _held_out(ranges)]
    decibels = [
        look.decibels(blended(contents, maps, space.neighbours(place)))
        for look, place in zip(looks, _held_out(ranges), strict=True)
        if look.seen.any()
    ]
    if not decibels:
        return None
    given = small.config.views.traced
    assert given is not None, "the scene has been planned"
    pixels = math.prod(cell.built.cameras.size) / math.prod(small.built.cameras.size)
    mine = contents.header
    kept = sum(
        stored_bytes(values, mine.precision) * (plan.size_of(*name) / mine.maps[mine.map_of(*name)].size) ** 2
        for name, values in maps[corners[0]].items()
    )
    kept += pixels * bytes_of_pictures(next(iter(views.values())).images, mine.precision)
    return CellTrial(
        SpacingTrial(degrees, given, float(np.mean(decibels))),
        pixels * tracing / len(views),
        pixels * fitting / rows,
        kept,
        small.config.views.around or 0,
    )


def _cell(stage: Stage, degrees: float) -> Stage:
    """Return a stage of few nodes around the middle of a scene's cameras, at rest."""
    views, cameras = stage.config.views, stage.built.cameras
    axes = camera_axes(stage.config)
    steps = [axis.step(degrees) for axis in axes]
    widest = max(steps)
    nodes = []
    for axis, step in zip(axes, steps, strict=True):
        wanted = NEAR_NODES if widest <= NEAR_DEGREES else 2
        if step == 0.0:
            wanted = 1
        elif (wanted - 1) * step > axis.extent * (1.0 + 1e-9):
            wanted = 2
        nodes.append(wanted)
    span = (nodes[0] - 1) * steps[0]
    turn = math.copysign(1.0, views.degrees)
    start = views.start + 0.5 * views.degrees - 0.5 * turn * span
    changed: dict[str, Any] = {"start": start, "degrees": turn * span, "count": nodes[0]}
    if views.kind == "dome":
        half, middle = 0.5 * (nodes[1] - 1) * steps[1], 0.5 * sum(views.elevation)
        changed |= {"elevation": (middle - half, middle + half), "rings": nodes[1]}
    config = stage.config.model_copy(
        update={"views": views.model_copy(update=changed), "motion": None, "light": None}
    )
    cameras = replace(
        cameras,
        start=start,
        degrees=turn * span,
        elevation=changed.get("elevation", cameras.elevation),
    )
    built = replace(stage.built, cameras=cameras, space=space_of(config))
    return replace(stage, config=config, built=built, moved={}, cut={})


def _middle_cell(space: ParameterSpace) -> Ranges:
    ranges = []
    for axis in space.axes:
        cells = axis.cells()
        low, high = cells[(len(cells) - 1) // 2]
        ranges.append((low, high) if len(axis.values) > 1 else (axis.values[0], axis.values[0]))
    return ranges


def _held_out(ranges: Ranges) -> list[Point]:
    """Return points spread over a cell; of two axes by powers of the plastic number, as `Dome.places`."""
    plastic = 1.32471795724474602596
    if sum(high > low for low, high in ranges) < 2:
        shares: Sequence[tuple[float, ...]] = [
            (((2 * number + 1) / (2 * PLACES)),) * len(ranges) for number in range(PLACES)
        ]
    else:
        shares = [
            ((0.5 + number / plastic) % 1.0, (0.5 + number / plastic**2) % 1.0)
            for number in range(1, PLACES + 1)
        ]
    return [
        tuple(low + share * (high - low) for (low, high), share in zip(ranges, row, strict=True))
        for row in shares
    ]
