"""The static set: maps without parameters, inferred from views of a dome."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake.bake.captured import captured_pyramids
from mirrorbake.bake.fit import DisplayFitter, FitView
from mirrorbake.bake.targets import ViewTracer, few_samples
from mirrorbake.pem.layout import read_back, stored_map
from mirrorbake.scene.pose import AT_REST

if TYPE_CHECKING:
    from collections.abc import Callable

    from mirrorbake import _core
    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.store import Contents, SolverReport
    from mirrorbake.scene.stage import Stage

ROWS = 8
"""Of a stripe of a view."""
PIXELS = 400_000
"""Of the object, in all views of a static set, about: of more, stripes are left out, so that they fit in
memory all together. Views add more than pixels do."""
COUNTED_VIEWS = 4
"""In which the object's pixels are counted to find out how many there are in all."""

NEAR_DEGREES = 10.0
"""Around the samples: there is a part of the views of a static set beside them, since most of what a PEM
fades to it is seen from there."""
NEAR_SHARE = 3
"""One view in so many is there."""
FAR_WEIGHT = 0.3
"""Of the pixels of the others, which are spread over the whole dome."""

Range = tuple[float, float]
Place = tuple[float, float]
"""Azimuth and elevation, degrees."""


@dataclass(frozen=True)
class Dome:
    """Directions from which a static set is inferred."""

    count: int
    azimuth: Range
    """Degrees, lowest and highest; they close at 360."""
    elevation: Range
    """Degrees above the horizon."""

    @staticmethod
    def of(stage: Stage) -> Dome:
        """Return the dome of a planned scene."""
        config, cameras = stage.config, stage.built.cameras
        (low, high), (bottom, top) = cameras.range()
        if config.views.kind == "none":
            assert config.views.count is not None, "of views without parameters it is a number"
            return Dome(config.views.count, (low, high), (bottom, top))
        assert config.static.views is not None, "the scene has to be planned first"
        around = min(0.5 * (high - low) + config.static.beyond, 180.0)
        middle = 0.5 * (low + high)
        elevation = (min(config.static.elevation[0], bottom), max(config.static.elevation[1], top))
        return Dome(config.static.views, (middle - around, middle + around), elevation)

    @staticmethod
    def near(stage: Stage) -> Dome:
        """Return the part of the dome that is around a planned scene's samples, with a third of its views."""
        whole, (azimuth, elevation) = Dome.of(stage), stage.built.cameras.range()
        return Dome(
            whole.count // NEAR_SHARE, _widened(azimuth, whole.azimuth), _widened(elevation, whole.elevation)
        )

    def places(self) -> list[Place]:
        """Return azimuths and elevations, evenly spread over the solid angle.

        By powers of the plastic number: M. Roberts, The unreasonable effectiveness of quasirandom sequences,
        2018.
        """
        plastic = 1.32471795724474602596
        number = np.arange(1, self.count + 1)
        around, up = (0.5 + number / plastic) % 1.0, (0.5 + number / plastic**2) % 1.0
        bottom, top = (math.sin(math.radians(angle)) for angle in self.elevation)
        azimuth = self.azimuth[0] + around * (self.azimuth[1] - self.azimuth[0])
        elevation = np.degrees(np.arcsin(bottom + up * (top - bottom)))
        return list(zip(azimuth.tolist(), elevation.tolist(), strict=True))


def _widened(samples: Range, limits: Range) -> Range:
    low, high = min(samples), max(samples)
    return max(low - NEAR_DEGREES, limits[0]), min(high + NEAR_DEGREES, limits[1])


def static_places(stage: Stage) -> list[tuple[Place, float]]:
    """Return from where a static set is inferred, and the weights of these views.

    Without samples beside it all directions of the dome count alike.
    """
    near, whole = Dome.near(stage), Dome.of(stage)
    everywhere = (near.azimuth, near.elevation) == (whole.azimuth, whole.elevation)
    if everywhere or stage.config.views.kind == "none":
        return [(place, 1.0) for place in whole.places()]
    far = replace(whole, count=whole.count - near.count)
    return [
        *((place, 1.0) for place in near.places()),
        *((place, FAR_WEIGHT) for place in far.places()),
    ]


def stripes_of(
    tracer: ViewTracer,
    stage: Stage,
    camera: _core.Camera,
    step: int,
    phase: int,
    weight: float = 1.0,
    rows: int = ROWS,
) -> list[FitView]:
    """Return every so-manieth stripe of a view that sees the object."""
    views = []
    for number in range(phase, -(-camera.height // rows), step):
        y = number * rows
        view = tracer.stripe(stage, camera, (0, y, camera.width, min(rows, camera.height - y)))
        if view is not None:
            views.append(FitView(view, weight=weight))
    return views


def static_views(
    tracer: ViewTracer, stage: Stage, report: Callable[[int, int, str], None] = lambda done, total, text: None
) -> list[FitView]:
    """Return what a static set is fitted to: stripes of views from its dome."""
    cameras, places = stage.built.cameras, static_places(stage)
    stage = few_samples(stage)
    some = places[:: -(-len(places) // COUNTED_VIEWS)]
    seen = [tracer.object_pixels(stage, cameras.around(*place)) for place, _ in some]
    step = max(1, math.ceil(len(places) * sum(seen) / (len(seen) * PIXELS)))
    views: list[FitView] = []
    for number, (place, weight) in enumerate(places):
        report(number, len(places), f"view {number + 1} of {len(places)} for the static set")
        views += stripes_of(tracer, stage, cameras.around(*place), step, number % step, weight)
    return views


def infer_static_set(
    stage: Stage, contents: Contents, report: Callable[[int, int, str], None]
) -> tuple[tuple[FloatArray, ...], SolverReport]:
    """Infer a static set.

    Parameters
    ----------
    stage
        Planned.
    contents
        What the samples share.
    report
        Told about every view.

    Returns
    -------
    tuple
        (T, 4), premultiplied radiance and α, of each map, as they will be read from storage; and how the
        solver ended.
    """
    header = contents.header
    fitter = DisplayFitter(header, stage.config.infer, contents.local_triangles)
    views = static_views(ViewTracer(stage, header, contents.local_triangles), stage, report)
    prior = None
    if stage.config.infer.prior == "captured":
        prior = fitter.captured_prior(captured_pyramids(stage, header, contents.capture))
    texels, solver = fitter.fit(views, AT_REST, prior)
    stored = []
    for pyramid, entry in zip(texels[0], header.maps, strict=True):
        values, _ = stored_map(pyramid, entry.size, header)
        stored.append(read_back(values, entry.size, header))
    return tuple(stored), solver
