"""Renderers of which only pictures are to be had, by name, for bakes with `infer.matrix = "probed"`.

A scene file names a renderer, it never holds code: the name is one that this process has registered, or an
entry point of an installed package in the group ``mirrorbake.renderers``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from mirrorbake import _core
from mirrorbake.errors import OptionError
from mirrorbake.pem.run_time import model_of, shell_maps
from mirrorbake.scene.config_axes import arranged

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.header import Header
    from mirrorbake.scene.stage import Stage

GROUP = "mirrorbake.renderers"
"""Of entry points."""


@dataclass(frozen=True)
class MapsView:
    """A view that a renderer is to draw from maps."""

    camera: _core.Camera
    window: tuple[int, int, int, int]
    """Part of the camera's image to draw: x, y, width and height in pixels, from the top left."""
    stage: Stage
    """The scene, with the mesh as `built.positions`, `normals`, `triangles` and `parts`."""
    header: Header
    """Of the PEM: parts, their shells with shapes and maps, run time."""
    local_triangles: NDArray[np.uint8] | None
    """(T,), 0 for triangles that read no shell of polygons off the hull; None: all read all."""


Draw: TypeAlias = Callable[[Sequence["FloatArray"]], "FloatArray"]
"""Draws a view from the maps of `header.maps` in order, premultiplied radiance and α (T, 4), each level as
it is given. Returns float32 (S, H, W, 4) of the window, a picture for each of S lookups of a pixel, whose
mean is what is shown: the light that the object reflects, times coverage, and coverage; linear in radiance,
so without tone mapping, clamping or background. A renderer that multisamples hands out its samples, one that
draws enlarged pictures their pixels; in the mean alone too many texels lie together to be told apart."""

Renderer: TypeAlias = Callable[[MapsView], Draw]
"""Gets ready to draw a view."""


def software(view: MapsView) -> Draw:
    """Draw with the library's own run time, which a probed bake can be checked with."""
    return drawn_by(view, model_of(view.header.run_time))


def drawn_by(view: MapsView, model: _core.RunTimeModel) -> Draw:
    """Draw in software as a run time of one's own would."""
    header, stage = view.header, view.stage
    pose = arranged(stage.config, stage.place).pose
    pictures = []
    for place in model.places:
        one = _core.RunTimeModel(
            name=model.name,
            places=[place],
            footprint_scale=model.footprint_scale,
            filter=model.filter,
            max_taps=model.max_taps,
        )
        lookups = stage.tracer.trace_visibility(
            view.camera, stage.built.reflector, stage.options_of(view.window), [place]
        )
        pictures.append((lookups, one))

    def draw(maps: Sequence[FloatArray]) -> FloatArray:
        def read(part: str, shell: str) -> FloatArray:
            number = header.map_of(part, shell)
            return np.ascontiguousarray(maps[number][:, : header.maps[number].channels])

        parts = shell_maps(header, read, pose, view.local_triangles)
        return np.stack([_core.render_reflector(lookups, parts, None, one) for lookups, one in pictures])

    return draw


_registered: dict[str, Renderer] = {"software": software}


def register_renderer(name: str, renderer: Renderer) -> None:
    """Make a renderer known in this process under a name, in place of one that had it."""
    _registered[name] = renderer


def renderer_named(name: str) -> Renderer:
    """Return the renderer of a name.

    Raises
    ------
    OptionError
        None is registered, and no installed package has such an entry point.
    """
    if name in _registered:
        return _registered[name]
    installed = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in installed:
        known = ", ".join(sorted({*_registered, *installed}))
        raise OptionError(
            f"infer.renderer = {name!r}: expected one of {known}, or an entry point of an installed package "
            f"in the group {GROUP}"
        )
    loaded: Renderer = installed[name].load()
    return loaded
