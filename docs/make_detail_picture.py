"""Draws the picture of the page on inference: details of the demonstration, traced and from maps.

    python docs/make_detail_picture.py PEM

PEM is what `mirrorbake demo` baked. Knob, rim, handle and spout are shown on a sample, half-way to the next
one and 5 degrees beyond the last, each traced, from the PEM, from its static set and from a captured map at
infinity.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from mirrorbake.evaluate.contenders import main_run_time
from mirrorbake.evaluate.evaluate import Onlooker, SeenView
from mirrorbake.evaluate.metrics import display_referred
from mirrorbake.evaluate.places import choose_views
from mirrorbake.pem.location import Location
from mirrorbake.pem.opened import OpenedPem, open_pem

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake import _core

PICTURE = Path(__file__).parent / "images" / "details.png"
COLUMNS = {"pem": "PEM", "static_set": "static set", "static_infinite": "captured"}
PLACES = {"on": "on a sample", "between": "half-way", "off_5": "5° off"}
CROP = 0.2
"""Side of a crop, as a share of the picture's height."""
CELL, GAP, BETWEEN, LEFT, TOP = 0.98, 0.04, 0.14, 0.62, 0.5
"""Inches."""


def details(positions: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
    """Return the places (3,) of the teapot's details, from its vertices: its spout points along +x."""
    x, y, z = positions.T
    low, high = y.min(), y.max()
    edge = (np.abs(y - (low + 0.75 * (high - low))) < 0.03 * (high - low)) & (np.abs(x) < 0.2 * x.max())
    return {
        "knob": positions[y > low + 0.88 * (high - low)].mean(axis=0),
        "rim": positions[edge & (z > 0.8 * z[edge].max())].mean(axis=0),
        "handle": positions[x < 0.75 * x.min()].mean(axis=0),
        "spout": positions[x > 0.7 * x.max()].mean(axis=0),
    }


def pixel_of(camera: _core.Camera, place: NDArray[np.float32]) -> tuple[float, float]:
    """Return column and row at which a camera sees a place."""
    eye, target, up = (np.array(v, float) for v in (camera.eye, camera.target, camera.up))
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, up) / np.linalg.norm(np.cross(forward, up))
    offset = place - eye
    scale = 0.5 * camera.height / np.tan(0.5 * np.radians(camera.vertical_fov_degrees)) / (offset @ forward)
    above = np.cross(right, forward)
    return 0.5 * camera.width + scale * (offset @ right), 0.5 * camera.height - scale * (offset @ above)


def crop(image: NDArray[Any], seen: SeenView, place: NDArray[np.float32]) -> NDArray[Any]:
    """Return what a display shows around a place; the window of the reference, at most."""
    left, top, width, height = seen.reference.window
    side = round(CROP * seen.view.camera.height)
    column, row = pixel_of(seen.view.camera, place)
    x = int(np.clip(round(column - left - 0.5 * side), 0, max(width - side, 0)))
    y = int(np.clip(round(row - top - 0.5 * side), 0, max(height - side, 0)))
    return np.asarray(display_referred(image[y : y + side, x : x + side]))


def seen_views(pem: OpenedPem) -> dict[str, SeenView]:
    """Look at the PEM from its sample in the middle, half-way to the next one and 5° beyond the last."""
    run_time = main_run_time(pem)
    onlooker = Onlooker(pem, only=COLUMNS, run_times=(run_time,))
    views = choose_views(pem.stage.built.cameras, pem.space, every=True)
    middle = pem.space.sample((len(pem.space) - 1) // 2)
    number = next(i for i, view in enumerate(views) if view.place == "on" and view.point == middle)
    chosen = [views[number], views[number + 1], next(view for view in views if view.place == "off_5")]
    seen = {view.place: onlooker.look(view) for view in chosen}
    return {place: view for place, view in seen.items() if view is not None}


def main() -> None:
    pem = open_pem(Location.of(sys.argv[1]))
    built = pem.stage.built
    rows = details(np.asarray(built.positions))
    places = seen_views(pem)
    names = ["traced", *COLUMNS]
    group = len(names) * (CELL + GAP) + BETWEEN
    width, height = LEFT + len(places) * group, TOP + len(rows) * (CELL + GAP)
    figure = Figure(figsize=(width, height))
    for number, (place, seen) in enumerate(places.items()):
        pictures = {"traced": seen.reference.images.beauty}
        titles = {"traced": "traced"}
        for name, title in COLUMNS.items():
            light = seen.pictures[name][seen.run_time]
            pictures[name] = seen.reference.images.composite(light)
            titles[name] = f"{title}, {seen.reference.psnr(light):.1f} dB"
        for column, name in enumerate(names):
            x = LEFT + number * group + column * (CELL + GAP)
            if column == 0:
                figure.text(x / width, 1 - 0.18 / height, PLACES[place], size=10, weight="bold")
            figure.text(x / width, 1 - 0.4 / height, titles[name], size=7)
            for row, spot in enumerate(rows.values()):
                bottom = height - TOP - (row + 1) * CELL - row * GAP
                axes = figure.add_axes((x / width, bottom / height, CELL / width, CELL / height))
                axes.set_axis_off()
                axes.imshow(crop(pictures[name], seen, spot), interpolation="nearest", aspect="auto")
    for row, name in enumerate(rows):
        middle = height - TOP - (row + 0.5) * CELL - row * GAP
        figure.text(0.08 / width, middle / height, name, size=9, va="center")
    figure.savefig(PICTURE, dpi=110, facecolor="white")


if __name__ == "__main__":
    main()
