"""The shells of a reflector's parts: what is drawn behind what ([PEM] §4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from mirrorbake.proxy import proxy_from_attributes

if TYPE_CHECKING:
    from mirrorbake import _core
    from mirrorbake.scene.pose import Pose

HullPolygons = Literal["all", "off hull"]


@dataclass(frozen=True)
class Shell:
    """One shell of a part: a map on a shape, which holds what its rule does.

    And what the rules before it do, as far as no other shell of the part holds that.
    """

    name: str
    """Of its rule; `local` and `distant` are the names of the default two."""
    proxy: dict[str, Any]
    """As `mirrorbake.proxy.proxy_to_attributes` returns it, with the object at rest."""
    map: str
    """Name of the map that lies on it; parts may share one."""
    size: int
    """Texels along a side of a face of the map's finest level."""
    polygons: HullPolygons
    """Whether polygons on the object's convex hull read it."""
    moves: bool
    """Whether the shape moves with the object."""

    def proxy_at(self, pose: Pose) -> _core.Proxy:
        """Return the shape where the object has moved to."""
        return proxy_from_attributes(moved_proxy(self.proxy, pose) if self.moves else self.proxy)


@dataclass(frozen=True)
class Part:
    """A part of the reflector with maps of its own."""

    name: str
    shells: tuple[Shell, ...]
    """Front to back; the last one is opaque, those before it hold premultiplied RGBA."""

    def shell(self, name: str) -> Shell | None:
        """Return the shell of a name, or None."""
        return next((shell for shell in self.shells if shell.name == name), None)


@dataclass(frozen=True)
class MapEntry:
    """A map that is stored once for every sample."""

    name: str
    channels: Literal[3, 4]
    """RGB, or RGBA premultiplied by α."""
    size: int
    """Texels along a side of a face of the finest level."""


def maps_of(parts: tuple[Part, ...]) -> tuple[MapEntry, ...]:
    """Return the maps that the shells of all parts read, each once, in their order."""
    entries: dict[str, MapEntry] = {}
    for part in parts:
        for shell in part.shells:
            channels: Literal[3, 4] = 3 if shell is part.shells[-1] else 4
            entry = entries.setdefault(shell.map, MapEntry(shell.map, channels, shell.size))
            if entry.channels != channels:
                raise ValueError(f"map {shell.map}: is the last shell of one part and not of another")
            if entry.size != shell.size:
                raise ValueError(
                    f"map {shell.map}: has {entry.size} texels in one part and {shell.size} in another"
                )
    return tuple(entries.values())


def moved_proxy(proxy: dict[str, Any], pose: Pose) -> dict[str, Any]:
    """Return a shape that has moved with the object; arguments and result as attributes."""
    moved = dict(proxy)
    for key in ("origin", "centre"):
        if key in proxy:
            moved[key] = pose.moved(np.array(proxy[key])).tolist()
    if "axes" in proxy:
        moved["axes"] = (np.array(proxy["axes"]) @ pose.rotation.T).tolist()
    return moved
