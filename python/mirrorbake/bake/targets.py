"""Traced views, as the display fit takes them."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
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

    def trace(self, stage: Stage, camera: _core.Camera) -> TracedView:
        """Return the whole view of a camera, in the scene of a stage."""
        targets = self._targets(camera.width, camera.height)
        bands = []
        for y, traced in self._bands(stage, camera):
            targets.add(traced.samples, 0, y)
            bands.append(images_of_trace(traced))
        images = ViewImages(
            np.concatenate([band.object for band in bands]),
            np.concatenate([band.coverage for band in bands]),
            np.concatenate([band.background for band in bands]),
        )
        whole = (0, 0, camera.width, camera.height)
        return TracedView(
            self._lookups(stage, camera, (0, 0, 0, 0)), targets, images, self._draw(stage, camera, whole)
        )

    def stripe(self, stage: Stage, camera: _core.Camera, window: Window) -> TracedView | None:
        """Return what a part of a camera's view holds; None where it does not see the object."""
        lookups = self._lookups(stage, camera, window)
        if not len(lookups):
            return None
        traced = stage.tracer.trace_layers(camera, stage.built.reflector, stage.options_of(window))
        targets = self._targets(window[2], window[3])
        targets.add(traced.samples)
        return TracedView(lookups, targets, images_of_trace(traced), self._draw(stage, camera, window))

    def _draw(self, stage: Stage, camera: _core.Camera, window: Window) -> Callable[[], Draw] | None:
        if self._renderer is None:
            return None
        return partial(self._renderer, MapsView(camera, window, stage, self._header, self._local_triangles))

    def _targets(self, width: int, height: int) -> _core.ViewTargets:
        return _core.ViewTargets(width, height, self._parts, self._shells, self._stacks)

    def _bands(self, stage: Stage, camera: _core.Camera) -> Iterator[tuple[int, _core.LayerTrace]]:
        rows = max(1, BATCH // (camera.width * stage.options.samples_per_pixel))
        for y in range(0, camera.height, rows):
            window = (0, y, camera.width, min(rows, camera.height - y))
            yield y, stage.tracer.trace_layers(camera, stage.built.reflector, stage.options_of(window))

    def _lookups(self, stage: Stage, camera: _core.Camera, window: Window) -> _core.SurfaceSamples:
        return stage.tracer.trace_visibility(
            camera, stage.built.reflector, stage.options_of(window), self._places
        )
