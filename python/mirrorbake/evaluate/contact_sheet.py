"""The contact sheet: ray tracing, the PEM and the static maps side by side, with their errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from mirrorbake.errors import InputError
from mirrorbake.evaluate.contenders import TITLES
from mirrorbake.evaluate.evaluate import Onlooker
from mirrorbake.evaluate.metrics import display_referred
from mirrorbake.evaluate.places import choose_views
from mirrorbake.files import atomic_output
from mirrorbake.pem.view_images import ViewImages
from mirrorbake.scene.parameters import format_point

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.evaluate.evaluate import SeenView
    from mirrorbake.evaluate.references import Window
    from mirrorbake.pem.opened import OpenedPem

SHEET_NAME = "contact-sheet.png"

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


SHEET_CONTENDERS = ("pem", "static_infinite", "static_proxy")
"""Those that there is room for."""


@dataclass(frozen=True)
class _View:
    title: str
    note: str
    images: ViewImages
    pictures: dict[str, FloatArray]
    """Radiance of the object by contender."""
    decibels: dict[str, float | None]


def contact_sheet(pem: OpenedPem, path: Path) -> None:
    """Write a PNG that compares ray tracing, the PEM and the static maps.

    It shows a sampled view from the middle of the arc, and the view half-way to the next one, both against
    references of an evaluation. Errors are the mean over R, G, B of the absolute difference of what a display
    shows.

    Raises
    ------
    InputError
        The object covers no pixel of those views, or the file is no .png or cannot be written.
    """
    if path.suffix.lower() != ".png":
        raise InputError(f"{path}: expected a name that ends in .png")
    middle = pem.space.sample((len(pem.space) - 1) // 2)
    views = choose_views(pem.stage.built.cameras, pem.space, every=True)
    first = next(i for i, view in enumerate(views) if view.place == "on" and view.point == middle)
    near = [views[first], *(view for view in views[first + 1 : first + 2] if view.place == "between")]
    onlooker = Onlooker(pem)
    seen = [onlooker.look(view) for view in near]
    there = [one for one in seen if one is not None]
    if not there:
        raise InputError(f"{path}: cannot draw: the object covers no pixel of the view in the middle")
    window = _common([one.reference.window for one in there])
    shown = [_view(one, window) for one in there]
    with mpl.rc_context({"font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"], "font.size": 9}):
        figure = _draw(shown)
        with atomic_output(path) as temporary:
            figure.savefig(temporary, dpi=150, facecolor="white")


def _view(seen: SeenView, window: Window) -> _View:
    view, reference = seen.view, seen.reference
    part = _inside(window, reference.window)
    images = reference.images
    where = ("t = " if len(view.point) == 1 else "") + format_point(view.point)
    if view.place == "on":
        title, note = "On a sampled view", f"{where}: the maps were inferred from this view"
    else:
        title = "Half-way between two samples"
        note = f"{where}: {view.degrees:.3g}° from the nearest, their maps blended"
    run_time = seen.run_time
    chosen = [name for name in SHEET_CONTENDERS if name in seen.pictures]
    return _View(
        title=title,
        note=f"{note}; reference of {reference.samples} samples, ceiling {reference.ceiling:.1f} dB",
        images=ViewImages(images.object[part], images.coverage[part], images.background[part]),
        pictures={name: seen.pictures[name][run_time][part] for name in chosen},
        decibels={name: reference.psnr(seen.pictures[name][run_time]) for name in chosen},
    )


def _common(windows: list[Window]) -> Window:
    """What all windows share: views this near to each other show the object in nearly the same place."""
    left, top = (max(window[axis] for window in windows) for axis in (0, 1))
    right, bottom = (min(window[axis] + window[axis + 2] for window in windows) for axis in (0, 1))
    return (left, top, max(right - left, 1), max(bottom - top, 1))


def _inside(window: Window, outer: Window) -> tuple[slice, slice]:
    left, top = window[0] - outer[0], window[1] - outer[1]
    return slice(top, top + window[3]), slice(left, left + window[2])


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
    rows, columns = views[0].images.coverage.shape
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
        _draw_view(sheet, view, cell, TITLE + number * view_height)
    return sheet.figure


def _draw_view(sheet: _Sheet, view: _View, cell: float, top: float) -> None:
    sheet.text(MARGIN, top + 0.2, view.title, size=11, weight="bold")
    sheet.text(MARGIN + CELL + GAP, top + 0.2, view.note, size=10, color="0.35")
    heading = top + ROW_TITLE + 0.16
    first = top + ROW_TITLE + COLUMN_TITLE
    second = first + cell + GAP
    reference = view.images.beauty
    sheet.text(MARGIN, heading, "Ray traced")
    sheet.picture(MARGIN, first, cell, display_referred(reference))
    _draw_scale(sheet, second, cell)
    for column, (name, light) in enumerate(view.pictures.items(), start=1):
        left = MARGIN + column * (CELL + GAP)
        picture = view.images.composite(light)
        sheet.text(left, heading, TITLES[name])
        value = view.decibels[name]
        decibels = "" if value is None else f"{value:.1f} dB"
        sheet.text(left + CELL, heading, decibels, ha="right", weight="bold")
        sheet.picture(left, first, cell, display_referred(picture))
        error = np.abs(display_referred(picture) - display_referred(reference)).mean(axis=-1)
        sheet.picture(left, second, cell, error, cmap=ERROR_COLOURS, vmin=0.0, vmax=ERROR_RANGE)


def _draw_scale(sheet: _Sheet, top: float, cell: float) -> None:
    axes = sheet.axes(MARGIN + 0.1, top + 0.5 * cell, CELL - 0.4, 0.12)
    scale = ScalarMappable(Normalize(0.0, ERROR_RANGE), ERROR_COLOURS)
    bar = sheet.figure.colorbar(scale, cax=axes, orientation="horizontal", extend="max")
    bar.outline.set_visible(False)
    bar.set_ticks([0.0, 0.05, 0.1, 0.15, 0.2, 0.25])
    axes.tick_params(length=2, labelsize=8)
    sheet.text(MARGIN + 0.1, top + 0.5 * cell - 0.26, "Absolute error of the display value,")
    sheet.text(MARGIN + 0.1, top + 0.5 * cell - 0.09, "mean of R, G and B (white = 1)")
