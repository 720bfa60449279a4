"""The maps of a PEM as exporters see them, whatever its container looks like."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake.errors import OptionError
from mirrorbake.pem.pyramid import pyramid_of
from mirrorbake.pem.run_time import model_of
from mirrorbake.pem.shells import moved_proxy
from mirrorbake.projection import MAP_PROJECTIONS
from mirrorbake.scene.config_axes import arranged
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from collections.abc import Callable

    from mirrorbake import _core
    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.header import Header
    from mirrorbake.pem.shells import Shell
    from mirrorbake.pem.store import PemStore
    from mirrorbake.scene.parameters import ParameterSpace, Point


@dataclass(frozen=True, eq=False)
class ShellMap:
    """One shell of a part: its map and the shape that the map lies on."""

    name: str
    proxy: dict[str, Any]
    """As `mirrorbake.proxy.proxy_to_attributes` returns it: world space, metres."""
    size: int
    """Texels along a side of a face of the finest level."""
    pyramid: FloatArray
    """(texels, C), float32: all levels, the finest first; opaque RGB, or premultiplied RGBA."""
    projection: str = "cube"
    off_hull: bool = False
    """Triangles on the reflector's convex hull do not read it."""

    @property
    def channels(self) -> int:
        """Numbers per texel."""
        return int(self.pyramid.shape[1])

    @property
    def levels(self) -> int:
        """Number of levels, down to one texel a face."""
        return self.size.bit_length()

    def level(self, index: int) -> FloatArray:
        """Level of shape (F, s, s, C), s = size >> index; F faces of the projection."""
        faces = MAP_PROJECTIONS[self.projection].faces
        start = sum(faces * (self.size >> i) ** 2 for i in range(index))
        side = self.size >> index
        return self.pyramid[start : start + faces * side * side].reshape(faces, side, side, self.channels)


@dataclass(frozen=True, eq=False)
class MapSet:
    """What draws the reflector at one point of the parameter space."""

    name: str
    """`static`, or `sample-0000` and so on."""
    point: Point | None
    """Where it was sampled; None for the static set."""
    parts: dict[str, list[ShellMap]]
    """Shells of every part, front to back."""


def axis_descriptions(space: ParameterSpace) -> list[dict[str, Any]]:
    """Axes of the parameter space, for the descriptions beside exported maps; `period` where it closes."""
    return [
        {key: value for key, value in axis.items() if value is not None} for axis in space.to_attributes()
    ]


def run_time_of(store: PemStore) -> dict[str, Any]:
    """How the maps are to be read, as they were when they were inferred, as plain values."""
    return run_time_attributes(model_of(store.header.run_time))


def run_time_attributes(model: _core.RunTimeModel) -> dict[str, Any]:
    """Return plain values of what a renderer needs to know of a run-time model."""
    return {
        "name": model.name,
        "places": [list(place) for place in model.places],
        "footprintScale": model.footprint_scale,
        "filter": model.filter,
        "maxTaps": model.max_taps,
    }


def fade_degrees(store: PemStore) -> float | None:
    """Degrees beyond the samples at which half of what is drawn is the static set; None if there is none."""
    fade = store.header.static["fade"]
    return None if fade is None else float(fade["degrees"])


def static_set(store: PemStore) -> MapSet:
    """The set that needs no parameter: the PEM's static set at the object's place at rest.

    A PEM without one has the captured surroundings instead, on the outermost shell's geometry.
    """
    header = store.header
    stored = store.read_static_maps()
    if stored is not None:
        texels = [
            np.ascontiguousarray(values[:, : entry.channels])
            for values, entry in zip(stored, header.maps, strict=True)
        ]
        return MapSet("static", None, _parts(header, texels.__getitem__, lambda shell: shell.proxy))
    proxy = header.static["proxy"] or header.static["infinite"]
    pyramid = pyramid_of(store.read_capture(), header.projection)
    shell = ShellMap("static", proxy, header.map_size, pyramid, header.projection)
    return MapSet("static", None, {part.name: [shell] for part in header.parts})


def sample_set(store: PemStore, index: int) -> MapSet:
    """The maps of one sample.

    Raises
    ------
    OptionError
        There is no such sample.
    """
    header = store.header
    count = len(header.space)
    if not 0 <= index < count:
        raise OptionError(f"sample = {index}: expected 0 to {count - 1}")
    config = parse_config(header.source.config, str(store.location))
    place = header.space.scene_coordinates(header.space.sample(index))
    pose = arranged(config, place).pose
    readers = {header.map_of(*name): name for name in header.map_names()}
    parts = _parts(
        header,
        lambda number: store.read_map(*readers[number], index),
        lambda shell: moved_proxy(shell.proxy, pose) if shell.moves else shell.proxy,
    )
    return MapSet(f"sample-{index:04d}", header.space.sample(index), parts)


def _parts(
    header: Header, read: Callable[[int], FloatArray], proxy_of: Callable[[Shell], dict[str, Any]]
) -> dict[str, list[ShellMap]]:
    """Return the shells of all parts; those that are the same in several parts are one object."""
    known: list[tuple[Shell, ShellMap]] = []

    def entry(part: str, shell: Shell) -> ShellMap:
        for other, made in known:
            if other == shell:
                return made
        made = ShellMap(
            shell.name,
            proxy_of(shell),
            shell.size,
            read(header.map_of(part, shell.name)),
            header.projection,
            off_hull=shell.polygons == "off hull",
        )
        known.append((shell, made))
        return made

    return {part.name: [entry(part.name, shell) for shell in part.shells] for part in header.parts}
