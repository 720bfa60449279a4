"""Traced views, as the display fit takes them."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.renderers import MapsView, renderer_named
from mirrorbake.pem.run_time import model_of
from mirrorbake.pem.view_images import ViewImages, images_of_trace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from mirrorbake.bake.renderers import Draw
    from mirrorbake.pem.header import Header
    from mirrorbake.scene.parameters import Point
    from mirrorbake.scene.stage import Stage

    Window = tuple[int, int, int, int]

BATCH = 1 << 22
"""Samples that are held at a time, were the object to fill the frame."""
KEPT_BYTES = 1 << 30
"""Memory for views that later samples may need again."""


@dataclass(frozen=True)
class TracedView:
    """A view with the light that its maps should show."""

    lookups: _core.SurfaceSamples
    """Where the run time's lookups see the reflector."""
    targets: _core.ViewTargets
    images: ViewImages
    draw: Callable[[], Draw] | None = None
    """Gets the renderer ready by whose pictures the view's rows are probed; None: they are analytic."""


def few_samples(stage: Stage) -> Stage:
    """Return a planned stage whose pixels all take `trace.samples`, however noisy they stay.

    Of many views for one set of maps: where several show a texel, their noise is averaged, and further views
    are worth more than less noise.
    """
    trace = stage.config.trace.model_copy(update={"noise": 0.0})
    return replace(stage, config=stage.config.model_copy(update={"trace": trace}))


class ViewTracer:
    """Traces the views of a planned stage for the run time of a PEM.

    Views are a function of the scene and their camera alone. The last ones are kept, since neighbouring
    samples see the same.
    """

    def __init__(
        self, stage: Stage, header: Header, local_triangles: NDArray[np.uint8] | None = None
    ) -> None:
        self._stage, self._header, self._local_triangles = stage, header, local_triangles
        name = stage.config.infer.renderer
        self._renderer = None if name is None else renderer_named(name)
        self._parts, self._shells, self._stacks = len(header.parts), len(header.rules), header.stacks
        self._places = model_of(header.run_time).places
        width, height = stage.built.cameras.size
        # Sums per pixel; per shell and lookup over a third of the frame, some pixels seeing two parts.
        size = width * height * (56 + (12 + 56 * self._shells) // 2 + 60 * len(self._places))
        self._most = max(KEPT_BYTES // size, 3)
        self._kept: OrderedDict[Point, TracedView] = OrderedDict()
        self._beside: OrderedDict[tuple[float, float], TracedView | None] = OrderedDict()

    def at(self, point: Point) -> TracedView:
        """Return the whole view of a point of the parameter space."""
        if point in self._kept:
            self._kept.move_to_end(point)
            return self._kept[point]
        while len(self._kept) >= self._most:
            self._kept.popitem(last=False)
        stage = self._stage.at(point)
        self._kept[point] = self.trace(stage, stage.built.cameras.camera(point))
        return self._kept[point]

    def around(self, azimuth: float, elevation: float) -> TracedView | None:
        """Return what a view beside the arc shows of the object, from few samples; None: nothing."""
        key = (azimuth, elevation)
        if key in self._beside:
            self._beside.move_to_end(key)
            return self._beside[key]
        while len(self._beside) >= self._most:
            self._beside.popitem(last=False)
        stage = few_samples(self._stage)
        camera = stage.built.cameras.around(azimuth, elevation)
        pixel = np.asarray(self._lookups(stage, camera, (0, 0, 0, 0)).pixel)
        self._beside[key] = None
        if len(pixel):
            x, y = pixel % camera.width, pixel // camera.width
            left, top = int(x.min()), int(y.min())
            window = (left, top, int(x.max()) - left + 1, int(y.max()) - top + 1)
            self._beside[key] = self.stripe(stage, camera, window)
        return self._beside[key]

    def object_pixels(self, stage: Stage, camera: _core.Camera) -> int:
        """Return how many pixels of a camera's view see the object."""
        return len(np.unique(np.asarray(self._lookups(stage, camera, (0, 0, 0, 0)).pixel)))

    def trace(self, stage: Stage, camera: _core.Camera) -> TracedView:
        """Return the whole view of a camera, in the scene of a stage."""
        lookups = self._lookups(stage, camera, (0, 0, 0, 0))
        return self._traced(stage, camera, (0, 0, camera.width, camera.height), lookups)

    def stripe(self, stage: Stage, camera: _core.Camera, window: Window) -> TracedView | None:
        """Return what a part of a camera's view holds; None where it does not see the object."""
        lookups = self._lookups(stage, camera, window)
        return self._traced(stage, camera, window, lookups) if len(lookups) else None

    def _traced(
        self, stage: Stage, camera: _core.Camera, window: Window, lookups: _core.SurfaceSamples
    ) -> TracedView:
        targets = self._targets(window[2], window[3])
        bands = []
        for y, traced in self._bands(stage, camera, window):
            targets.add(traced.samples, 0, y)
            bands.append(images_of_trace(traced))
        images = ViewImages(
            np.concatenate([band.object for band in bands]),
            np.concatenate([band.coverage for band in bands]),
            np.concatenate([band.background for band in bands]),
        )
        return TracedView(lookups, targets, images, self._draw(stage, camera, window))

    def _draw(self, stage: Stage, camera: _core.Camera, window: Window) -> Callable[[], Draw] | None:
        if self._renderer is None:
            return None
        return partial(self._renderer, MapsView(camera, window, stage, self._header, self._local_triangles))

    def _targets(self, width: int, height: int) -> _core.ViewTargets:
        return _core.ViewTargets(width, height, self._parts, self._shells, self._stacks)

    def _bands(
        self, stage: Stage, camera: _core.Camera, window: Window
    ) -> Iterator[tuple[int, _core.LayerTrace]]:
        left, top, width, height = window
        rows = max(1, BATCH // (width * stage.options.samples_per_pixel))
        for y in range(0, height, rows):
            band = (left, top + y, width, min(rows, height - y))
            yield y, stage.tracer.trace_layers(camera, stage.built.reflector, stage.options_of(band))

    def _lookups(self, stage: Stage, camera: _core.Camera, window: Window) -> _core.SurfaceSamples:
        return stage.tracer.trace_visibility(
            camera, stage.built.reflector, stage.options_of(window), self._places
        )
