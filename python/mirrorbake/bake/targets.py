"""Traced views, as the display fit takes them."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.quality import QUALITIES
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
BAND_ROWS = 16
"""Each band of them has bounds of its own around the object: fewer follow its outline more closely, and leave
less to do at a time."""


@dataclass(frozen=True)
class TracedView:
    """A view with the light that its maps should show."""

    lookups: _core.SurfaceSamples
    """Where the run time's lookups see the reflector."""
    targets: _core.ViewTargets
    images: ViewImages
    draw: Callable[[], Draw] | None = None
    """Gets the renderer ready by whose pictures the view's rows are probed; None: they are analytic."""


def few_samples(stage: Stage, most: int | None = None) -> Stage:
    """Return a planned stage whose pixels all take `trace.samples`, at most `most`, however noisy they stay.

    Of many views for one set of maps: where several show a texel, their noise is averaged, and further views
    are worth more than less noise.
    """
    samples = stage.config.trace.samples
    if most is not None and samples is not None:
        samples = min(samples, most)
    trace = stage.config.trace.model_copy(update={"noise": 0.0, "samples": samples})
    return replace(stage, config=stage.config.model_copy(update={"trace": trace}))


def background_samples(stage: Stage) -> int | None:
    """Per pixel off the object, by `auto.quality`; None: as many as on the object."""
    return QUALITIES[stage.config.auto.quality].background


def bounds(pixel: NDArray[np.integer], window: Window) -> Window | None:
    """Return the rectangle around pixels, numbered row by row within a window; None around none."""
    if not len(pixel):
        return None
    left, top, width, _ = window
    x, y = pixel % width, pixel // width
    return (
        left + int(x.min()),
        top + int(y.min()),
        int(x.max() - x.min()) + 1,
        int(y.max() - y.min()) + 1,
    )


def widened(inner: Window, margin: int, window: Window) -> Window:
    """Return a rectangle with some pixels more on each side, as far as a window holds them."""
    left, top, width, height = window
    x0, y0 = max(inner[0] - margin, left), max(inner[1] - margin, top)
    x1 = min(inner[0] + inner[2] + margin, left + width)
    y1 = min(inner[1] + inner[3] + margin, top + height)
    return (x0, y0, x1 - x0, y1 - y0)


def pieces(window: Window, pixel: NDArray[np.integer]) -> Iterator[tuple[Window, bool]]:
    """Cut a window into rectangles, and tell which hold pixels, or others next to them.

    Parameters
    ----------
    window
        The whole.
    pixel
        Numbers of pixels, row by row within the window.
    """
    left, top, width, height = window
    inner = bounds(pixel, window)
    if inner is None:
        yield window, False
        return
    _, y0, _, down = widened(inner, 1, window)
    yield from _unless_empty((left, top, width, y0 - top), False)
    rows = pixel // width
    for y in range(y0, y0 + down, BAND_ROWS):
        across = min(BAND_ROWS, y0 + down - y)
        near = pixel[(rows + top >= y - 1) & (rows + top <= y + across)]
        band = (left, y, width, across)
        held = bounds(near, window)
        if held is None:
            yield band, False
            continue
        x0, _, wide, _ = widened(held, 1, window)
        yield from _unless_empty((left, y, x0 - left, across), False)
        yield (x0, y, wide, across), True
        yield from _unless_empty((x0 + wide, y, left + width - x0 - wide, across), False)
    end = y0 + down
    yield from _unless_empty((left, end, width, top + height - end), False)


def _unless_empty(rectangle: Window, holds: bool) -> Iterator[tuple[Window, bool]]:
    if rectangle[2] > 0 and rectangle[3] > 0:
        yield rectangle, holds


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
        window = bounds(pixel, (0, 0, camera.width, camera.height))
        if window is not None:
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
        left, top, width, height = window
        targets = self._targets(width, height)
        images = ViewImages(
            np.empty((height, width, 3), np.float32),
            np.empty((height, width), np.float32),
            np.empty((height, width, 3), np.float32),
        )
        background = background_samples(stage)
        elsewhere = stage if background is None else few_samples(stage, background)
        cut = [(window, True)] if background is None else pieces(window, np.asarray(lookups.pixel))
        for rectangle, on_object in cut:
            for band, traced in self._bands(stage if on_object else elsewhere, camera, rectangle):
                x, y = band[0] - left, band[1] - top
                targets.add(traced.samples, x, y)
                images.put(x, y, images_of_trace(traced))
        return TracedView(lookups, targets, images, self._draw(stage, camera, window))

    def _draw(self, stage: Stage, camera: _core.Camera, window: Window) -> Callable[[], Draw] | None:
        if self._renderer is None:
            return None
        return partial(self._renderer, MapsView(camera, window, stage, self._header, self._local_triangles))

    def _targets(self, width: int, height: int) -> _core.ViewTargets:
        return _core.ViewTargets(width, height, self._parts, self._shells, self._stacks)

    def _bands(
        self, stage: Stage, camera: _core.Camera, window: Window
    ) -> Iterator[tuple[Window, _core.LayerTrace]]:
        left, top, width, height = window
        rows = max(1, BATCH // (width * stage.options.samples_per_pixel))
        for y in range(0, height, rows):
            band = (left, top + y, width, min(rows, height - y))
            yield band, stage.tracer.trace_layers(camera, stage.built.reflector, stage.options_of(band))

    def _lookups(self, stage: Stage, camera: _core.Camera, window: Window) -> _core.SurfaceSamples:
        return stage.tracer.trace_visibility(
            camera, stage.built.reflector, stage.options_of(window), self._places
        )
