"""The static set: maps without parameters, inferred from views of a dome."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake.bake.captured import captured_pyramids
from mirrorbake.bake.fit import DisplayFitter, FitView
from mirrorbake.bake.targets import ViewTracer
from mirrorbake.pem.layout import read_back, stored_map
from mirrorbake.scene.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Callable

    from mirrorbake import _core
    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.store import Contents, SolverReport
    from mirrorbake.scene.stage import Stage

ROWS = 8
"""Of a stripe of a view."""
PIXELS = 24 << 16
"""Of all views of a static set, about: of more, stripes are left out. Views add more than pixels do."""

Range = tuple[float, float]


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
            return Dome(config.views.count, (low, high), (bottom, top))
        assert config.static.views is not None, "the scene has to be planned first"
        around = min(0.5 * (high - low) + config.static.beyond, 180.0)
        middle = 0.5 * (low + high)
        elevation = (min(config.static.elevation[0], bottom), max(config.static.elevation[1], top))
        return Dome(config.static.views, (middle - around, middle + around), elevation)

    def places(self) -> list[tuple[float, float]]:
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


def stripes_of(
    tracer: ViewTracer, stage: Stage, camera: _core.Camera, step: int, phase: int
) -> list[FitView]:
    """Return every so-manieth stripe of a view that sees the object."""
    views = []
    for number in range(phase, -(-camera.height // ROWS), step):
        y = number * ROWS
        view = tracer.stripe(stage, camera, (0, y, camera.width, min(ROWS, camera.height - y)))
        if view is not None:
            views.append(FitView(view))
    return views


def static_views(
    tracer: ViewTracer, stage: Stage, report: Callable[[int, int, str], None] = lambda done, total, text: None
) -> list[FitView]:
    """Return what a static set is fitted to: stripes of views from all over its dome."""
    cameras, places = stage.built.cameras, Dome.of(stage).places()
    width, height = cameras.size
    step = max(1, math.ceil(len(places) * width * height / PIXELS))
    views: list[FitView] = []
    for number, place in enumerate(places):
        report(number, len(places), f"view {number + 1} of {len(places)} for the static set")
        views += stripes_of(tracer, stage, cameras.around(*place), step, number % step)
    return views


def infer_static_set(
    stage: Stage, contents: Contents, report: Callable[[int, int, str], None]
) -> tuple[FloatArray, SolverReport]:
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
        (M, T, 4), premultiplied radiance and α of all maps, as they will be read from storage; and how the
        solver ended.
    """
    header = contents.header
    fitter = DisplayFitter(header, stage.config.infer, contents.local_triangles)
    views = static_views(ViewTracer(stage, header), stage, report)
    prior = None
    if stage.config.infer.prior == "captured":
        prior = fitter.captured_prior(captured_pyramids(stage, header, contents.capture))
    texels, solver = fitter.fit(views, Pose.of(stage.config, 0.0), prior)
    stored = [read_back(stored_map(pyramid, header)[0], header) for pyramid in texels[0]]
    return np.stack(stored), solver
