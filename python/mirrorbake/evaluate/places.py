"""The places from which an evaluation looks at a PEM: on its samples, between them, and away from them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.scene.cameras import Cameras
    from mirrorbake.scene.parameters import ParameterSpace, Point

    Vector = NDArray[np.float64]

OFF_DEGREES = (1, 2, 5, 10, 15)
"""Beyond the end of the arc."""
RAISED_DEGREES = 10
"""Above and below the arc."""
DOME = ((0.15, 55.0), (0.5, 40.0), (0.85, 8.0))
"""The held-out dome: place along the arc, and elevation in degrees."""
MOST_PAIRS = 5
"""Stretches of the arc that are looked at unless every view is."""

PLACES = (
    "on",
    "between",
    *(f"off_{degrees}" for degrees in OFF_DEGREES),
    f"above_{RAISED_DEGREES}",
    f"below_{RAISED_DEGREES}",
    "dome",
)

PLACE_TITLES = {
    "on": "on a sample",
    "between": "half-way between two",
    **{f"off_{degrees}": f"{degrees}° past the end of the arc" for degrees in OFF_DEGREES},
    f"above_{RAISED_DEGREES}": f"{RAISED_DEGREES}° above the arc",
    f"below_{RAISED_DEGREES}": f"{RAISED_DEGREES}° below the arc",
    "dome": "held-out dome",
}


@dataclass(frozen=True)
class View:
    """A camera, and what a PEM is asked for there."""

    place: str
    """One of `PLACES`."""
    degrees: float
    """Between the directions towards this eye and towards the nearest sampled one, seen from the target."""
    point: Point
    """Of the parameter space, at which the PEM is drawn: of views outside of it, the nearest in it."""
    camera: _core.Camera


def choose_views(cameras: Cameras, space: ParameterSpace, *, every: bool = False) -> list[View]:
    """Choose the views of an evaluation.

    Parameters
    ----------
    cameras
        Where the eye is at the points of the space.
    space
        With maps at its nodes.
    every
        Look at every sample and between every two. Otherwise the samples are cut into √n/2 equal stretches,
        at most 5, for n samples, and the one in the middle of each is looked at, with the place half-way to
        the next.

    Returns
    -------
    list
        A view between samples, in the middle of a cell of the grid, follows the first of them. Then come
        views further around past the last sample, above and below the middle one, and on a dome (of a PEM
        over a dome: within it, off its samples). Where the arc goes full circle there is no place past its
        end.
    """
    samples = space.samples()
    sampled = [cameras.camera(point) for point in samples]
    views = []
    for index in _chosen(len(samples), every=every):
        views.append(View("on", 0.0, samples[index], sampled[index]))
        middle = space.middle_after(index)
        if middle is not None:
            views.append(_view("between", middle, cameras.camera(middle), sampled))
    turn = math.copysign(1.0, cameras.degrees)
    for degrees in OFF_DEGREES:
        view = _view(f"off_{degrees}", samples[-1], turned(sampled[-1], turn * degrees, 0.0), sampled)
        # On a full circle the first sample is nearer than the last.
        if view.degrees > 0.5 * angle_between(view.camera, sampled[-1]):
            views.append(view)
    middle_sample = (len(samples) - 1) // 2
    for name, degrees in (("above", RAISED_DEGREES), ("below", -RAISED_DEGREES)):
        if abs(elevation(sampled[middle_sample]) + degrees) < 89.0:
            camera = turned(sampled[middle_sample], 0.0, degrees)
            views.append(_view(f"{name}_{RAISED_DEGREES}", samples[middle_sample], camera, sampled))
    if cameras.kind == "arc":
        for share, height in DOME:
            point = (share, *samples[middle_sample][1:])
            camera = cameras.camera(point)
            views.append(_view("dome", point, turned(camera, 0.0, height - elevation(camera)), sampled))
    elif cameras.kind == "dome":
        views += [_view("dome", point, cameras.camera(point), sampled) for point in space.spread(len(DOME))]
    return views


def _chosen(count: int, *, every: bool) -> list[int]:
    if every:
        return list(range(count))
    pairs = min(max(round(0.5 * math.sqrt(count)), 1), MOST_PAIRS)
    return [int((stretch + 0.5) * (count - 1) / pairs) for stretch in range(pairs)]


def _view(place: str, point: Point, camera: _core.Camera, sampled: list[_core.Camera]) -> View:
    return View(place, min(angle_between(camera, other) for other in sampled), point, camera)


def _offset(camera: _core.Camera) -> Vector:
    offset: Vector = np.array(camera.eye, float) - np.array(camera.target, float)
    return offset


def angle_between(a: _core.Camera, b: _core.Camera) -> float:
    """Degrees between the directions from the target to the eyes of two cameras."""
    x, y = _offset(a), _offset(b)
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(x, y))), float(x @ y)))


def elevation(camera: _core.Camera) -> float:
    """Degrees of the eye above the horizontal through the target."""
    x, y, z = _offset(camera)
    return math.degrees(math.atan2(y, math.hypot(x, z)))


def turned(camera: _core.Camera, azimuth: float, raised: float) -> _core.Camera:
    """Return a camera whose eye moves on a sphere about its target.

    Parameters
    ----------
    camera
        Not straight above its target.
    azimuth
        Degrees about the vertical, from +Z towards +X.
    raised
        Degrees of elevation that are added.
    """
    x, y, z = _offset(camera)
    across, distance = math.hypot(x, z), math.hypot(x, y, z)
    around = math.atan2(x, z) + math.radians(azimuth)
    up = math.atan2(y, across) + math.radians(raised)
    offset = distance * np.array(
        [math.cos(up) * math.sin(around), math.sin(up), math.cos(up) * math.cos(around)]
    )
    eye = np.array(camera.target, float) + offset
    return _core.Camera(
        (float(eye[0]), float(eye[1]), float(eye[2])),
        camera.target,
        camera.up,
        camera.vertical_fov_degrees,
        camera.width,
        camera.height,
    )
