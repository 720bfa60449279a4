"""The contact sheet: ray tracing, the PEM and the static maps side by side, with their errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from mirrorbake.evaluate.contenders import TITLES, render_contenders
from mirrorbake.evaluate.metrics import OBJECT_COVERAGE, display_referred, psnr
from mirrorbake.files import atomic_output
from mirrorbake.pem.view_images import images_of_trace

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.opened import OpenedPem
    from mirrorbake.pem.view_images import ViewImages

ERROR_RANGE = 0.25
"""Display-referred error at which the colour scale of the error images ends."""

ERROR_COLOURS = "inferno"

# Lengths in inches.
CELL = 2.9
GAP = 0.1
MARGIN = 0.16
TITLE = 0.62
ROW_TITLE = 0.34
COLUMN_TITLE = 0.26
ROW_SPACE = 0.14


@dataclass(frozen=True)
class _View:
    title: str
    note: str
    images: ViewImages
    pictures: dict[str, FloatArray]
    """Radiance of the object by contender."""


def contact_sheet(pem: OpenedPem, path: Path) -> None:
    """Write a PNG that compares ray tracing, the PEM and the static maps.

    It shows a sampled view from the middle of the arc, and the view half-way to the next one. Errors are the
    mean over R, G, B of the absolute difference of what a display shows.
    """
    middle = (len(pem.parameters) - 1) // 2
    views = [_sampled_view(pem, middle)]
    if len(pem.parameters) > 1:
        views.append(_view_between(pem, middle))
    with mpl.rc_context({"font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"], "font.size": 9}):
        figure = _draw(views)
        with atomic_output(path) as temporary:
            figure.savefig(temporary, dpi=150, facecolor="white")


def _sampled_view(pem: OpenedPem, index: int) -> _View:
    t = pem.parameters[index]
    return _View(
        title="On a sampled view",
        note=f"t = {t:.3f}: the maps were inferred from this view",
        images=pem.store.read_images(index),
        pictures=render_contenders(pem, t, pem.stage.visibility(t)),
    )


def _view_between(pem: OpenedPem, index: int) -> _View:
    t = 0.5 * (pem.parameters[index] + pem.parameters[index + 1])
    trace = pem.stage.trace(t)
    away = 0.5 * abs(pem.stage.config.views.degrees) / (len(pem.parameters) - 1)
    return _View(
        title="Half-way between two samples",
        note=f"t = {t:.3f}: {away:.3g}° from both, their maps blended",
        images=images_of_trace(trace),
        pictures=render_contenders(pem, t, trace.samples),
    )


def _crop(views: list[_View]) -> tuple[slice, slice]:
    """Return the part of the frame around the object, the same for all views."""
    seen = np.any([view.images.coverage > 0.0 for view in views], axis=0)
    if not seen.any():
        return slice(None), slice(None)
    rows, columns = (np.flatnonzero(seen.any(axis=axis)) for axis in (1, 0))
    top, bottom = _widen(int(rows[0]), int(rows[-1]) + 1, 0, seen.shape[0])
    # Pictures that are taller than wide would make the sheet too long to look at.
    left, right = _widen(int(columns[0]), int(columns[-1]) + 1, bottom - top, seen.shape[1])
    return slice(top, bottom), slice(left, right)


def _widen(first: int, last: int, least: int, limit: int) -> tuple[int, int]:
    """Add a margin to the pixels [first, last) so that they are at least `least`, within [0, limit)."""
    margin = max(2, (last - first) // 12, (least - (last - first) + 1) // 2)
    return max(0, first - margin), min(limit, last + margin)


class _Sheet:
    """A figure whose parts are placed in inches from the top left corner."""

    def __init__(self, width: float, height: float) -> None:
        self.figure = Figure(figsize=(width, height))
        self._width, self._height = width, height

    def axes(self, left: float, top: float, width: float, height: float) -> Axes:
        w, h = self._width, self._height
        axes: Axes = self.figure.add_axes((left / w, 1 - (top + height) / h, width / w, height / h))
        return axes

    def text(self, left: float, baseline: float, words: str, **style: Any) -> None:
        self.figure.text(left / self._width, 1 - baseline / self._height, words, **style)

    def picture(
        self, left: float, top: float, height: float, image: NDArray[np.float64], **style: Any
    ) -> Axes:
        axes = self.axes(left, top, CELL, height)
        axes.set_axis_off()
        axes.imshow(image, aspect="auto", interpolation="lanczos", **style)
        return axes


def _draw(views: list[_View]) -> Figure:
    crop = _crop(views)
    rows, columns = views[0].images.coverage[crop].shape
    cell = CELL * rows / columns
    names = list(views[0].pictures)
    width = 2 * MARGIN + (1 + len(names)) * (CELL + GAP) - GAP
    view_height = ROW_TITLE + COLUMN_TITLE + 2 * cell + GAP + ROW_SPACE
    sheet = _Sheet(width, TITLE + len(views) * view_height)
    sheet.text(MARGIN, 0.38, "mirrorbake", size=16, weight="bold")
    sheet.text(
        MARGIN + 1.55,
        0.38,
        "reflections drawn from environment maps, against ray tracing",
        size=12,
        color="0.35",
    )
    for number, view in enumerate(views):
        _draw_view(sheet, view, crop, cell, TITLE + number * view_height)
    return sheet.figure


def _draw_view(sheet: _Sheet, view: _View, crop: tuple[slice, slice], cell: float, top: float) -> None:
    sheet.text(MARGIN, top + 0.2, view.title, size=11, weight="bold")
    sheet.text(MARGIN + CELL + GAP, top + 0.2, view.note, size=10, color="0.35")
    heading = top + ROW_TITLE + 0.16
    first = top + ROW_TITLE + COLUMN_TITLE
    second = first + cell + GAP
    reference = view.images.beauty
    mask = view.images.coverage >= OBJECT_COVERAGE
    sheet.text(MARGIN, heading, "Ray traced")
    sheet.picture(MARGIN, first, cell, display_referred(reference[crop]))
    _draw_scale(sheet, second, cell)
    for column, (name, light) in enumerate(view.pictures.items(), start=1):
        left = MARGIN + column * (CELL + GAP)
        picture = view.images.composite(light)
        sheet.text(left, heading, TITLES[name])
        decibels = f"{psnr(light, view.images.object, mask):.1f} dB" if mask.any() else ""
        sheet.text(left + CELL, heading, decibels, ha="right", weight="bold")
        sheet.picture(left, first, cell, display_referred(picture[crop]))
        error = np.abs(display_referred(picture) - display_referred(reference)).mean(axis=-1)
        sheet.picture(left, second, cell, error[crop], cmap=ERROR_COLOURS, vmin=0.0, vmax=ERROR_RANGE)


def _draw_scale(sheet: _Sheet, top: float, cell: float) -> None:
    axes = sheet.axes(MARGIN + 0.1, top + 0.5 * cell, CELL - 0.4, 0.12)
    scale = ScalarMappable(Normalize(0.0, ERROR_RANGE), ERROR_COLOURS)
    bar = sheet.figure.colorbar(scale, cax=axes, orientation="horizontal", extend="max")
    bar.outline.set_visible(False)
    bar.set_ticks([0.0, 0.05, 0.1, 0.15, 0.2, 0.25])
    axes.tick_params(length=2, labelsize=8)
    sheet.text(MARGIN + 0.1, top + 0.5 * cell - 0.26, "Absolute error of the display value,")
    sheet.text(MARGIN + 0.1, top + 0.5 * cell - 0.09, "mean of R, G and B (white = 1)")
