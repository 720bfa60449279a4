"""What the exporters need to know of a PEM, whatever its container looks like."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake.pem.export.map_sets import run_time_attributes
from mirrorbake.pem.export.materials import Materials, export_materials
from mirrorbake.pem.export.mesh_file import ReflectorMesh
from mirrorbake.pem.export.reads import texels_read
from mirrorbake.pem.pyramid import pyramid_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.opened import OpenedPem
    from mirrorbake.scene.parameters import ParameterSpace


@dataclass(frozen=True)
class MapEntry:
    """A map that there is once for every sample, whichever shells read it."""

    name: str
    size: int
    """Texels along a side of the finest level."""
    opaque: bool
    """Whether it has no α: the last one of its parts."""


@dataclass(frozen=True)
class Shell:
    """One layer of a part's environment."""

    name: str
    proxy: dict[str, Any]
    """As `mirrorbake.proxy.proxy_to_attributes` returns it."""
    map: int
    """Number of the map that lies on it."""
    moves: bool = False
    """Whether its shape moves with the object."""
    on_hull: bool = True
    """Whether triangles on the object's convex hull read it."""


@dataclass(frozen=True)
class Part:
    """A part of the reflector with its shells, front to back."""

    name: str
    shells: tuple[Shell, ...]


@dataclass(frozen=True)
class ExportSource:
    """A PEM as the exporters see it."""

    parts: tuple[Part, ...]
    space: ParameterSpace
    """At whose nodes the samples are."""
    motion: dict[str, Any] | None
    """How the object moves along the axis `motion`: `to` (metres) and `turn` (degrees about the vertical in
    `pivot`) at 1; None if it stays."""
    projection: str
    """Of all maps."""
    maps: tuple[MapEntry, ...]
    pyramid: Callable[[int, int], FloatArray]
    """`pyramid(sample, map)`: all levels of a map, (texels, 3) or, not opaque, (texels, 4)."""
    static_maps: tuple[FloatArray, ...] | None
    """The static set: the pyramids of all maps, drawn far from the samples; None if there is none."""
    reads: Callable[[int], Sequence[NDArray[np.bool_]]] | None
    """`reads(sample)`: the texels (texels,) of each map that views near a sample read; None: all count."""
    fade_degrees: float | None
    """Degrees beyond the samples at which half of what is drawn is the static set."""
    still: Callable[[int], FloatArray]
    """`still(sample)`: the ray-traced picture (H, W, 3) of a sample's view, scene-linear."""
    mesh: ReflectorMesh
    materials: Materials
    irradiance: Callable[[int], FloatArray] | None
    """`irradiance(sample)`: as the mesh has it, where it changes between samples, else None."""
    static: FloatArray
    """All levels of the static map, (texels, 3)."""
    static_proxy: dict[str, Any]
    static_size: int
    camera: dict[str, Any]
    origin: tuple[float, float, float]
    """Where the zero of all positions lies in the scene file's world, metres."""
    run_time: dict[str, Any]
    title: str
    notes: tuple[str, ...]
    """What the exported data lack compared with the PEM."""


def export_source(pem: OpenedPem) -> ExportSource:
    """Look at an opened PEM as the exporters do."""
    store, stage = pem.store, pem.stage
    header, built = store.header, stage.built
    parts = tuple(
        Part(
            part.name,
            tuple(
                Shell(
                    shell.name,
                    shell.proxy,
                    header.map_of(part.name, shell.name),
                    shell.moves,
                    shell.polygons == "all",
                )
                for shell in part.shells
            ),
        )
        for part in header.parts
    )
    mesh = built.scene.object_mesh(built.reflector)
    of_part = built.scene.object_part_materials(built.reflector)
    numbers = sorted(set(of_part))
    materials = export_materials(built.scene, numbers)
    local = store.read_local_triangles()
    whole = np.ones(len(built.triangles), np.bool_) if local is None else local != 0

    def irradiance(sample: int) -> FloatArray:
        values = store.read_irradiance(sample)
        assert values is not None
        return values

    first = store.read_irradiance()
    changes = first is not None and store.has_irradiance_per_sample

    are_uvs_read = len(materials.textures) > 0 or header.lightmap > 0
    readers = {header.map_of(*name): name for name in header.map_names()}

    def pyramid(sample: int, number: int) -> FloatArray:
        return store.read_map(*readers[number], sample)

    stored = store.read_static_maps()
    static_maps = None
    if stored is not None:
        static_maps = tuple(
            np.ascontiguousarray(texels[:, : entry.channels])
            for texels, entry in zip(stored, header.maps, strict=True)
        )
    fade = header.static["fade"]

    return ExportSource(
        parts=parts,
        space=header.space,
        motion=_motion(header.source.config),
        projection=header.projection,
        maps=tuple(MapEntry(entry.name, entry.size, entry.channels == 3) for entry in header.maps),
        pyramid=pyramid,
        static_maps=static_maps,
        # The one sample of a PEM without parameters is drawn from everywhere.
        reads=None if header.is_static_set else partial(texels_read, pem),
        fade_degrees=None if fade is None or static_maps is None else fade["degrees"],
        still=lambda sample: store.read_images(sample).beauty,
        mesh=ReflectorMesh(
            positions=built.positions,
            normals=np.asarray(mesh.normals),
            triangles=built.triangles,
            parts=built.parts,
            whole_stack=whole,
            uvs=np.asarray(mesh.uvs) if are_uvs_read else np.zeros((0, 2), np.float32),
            colors=np.asarray(mesh.colors),
            tangents=np.asarray(mesh.tangents),
            materials=np.array([numbers.index(number) for number in of_part], np.uint16)[built.parts],
            irradiance=first,
            lightmap=header.lightmap,
        ),
        materials=materials,
        irradiance=irradiance if changes else None,
        static=pyramid_of(store.read_capture(), header.projection),
        static_proxy=header.static["proxy"] or header.static["infinite"],
        static_size=header.map_size,
        camera=_camera(pem),
        origin=header.origin,
        run_time=run_time_attributes(pem.run_time.model),
        title=_title(header.source.config),
        notes=materials.notes,
    )


def _camera(pem: OpenedPem) -> dict[str, Any]:
    cameras = pem.stage.built.cameras
    azimuths, elevations = cameras.range()
    return {
        "kind": cameras.kind,
        "target": list(cameras.centre),
        "radius": cameras.radius,
        "height": cameras.height,
        "startDegrees": cameras.start,
        "degrees": cameras.degrees,
        "azimuths": list(azimuths),
        "elevations": list(elevations),
        "verticalFovDegrees": cameras.fov,
        "aspect": cameras.size[0] / cameras.size[1],
        "pixels": cameras.size[1],
    }


def _motion(config: dict[str, Any]) -> dict[str, Any] | None:
    motion = config.get("motion")
    if motion is None:
        return None
    return {
        "to": list(motion["to"]),
        "turn": motion["turn"],
        "pivot": [0.0, 0.0, 0.0],
    }


def _title(config: dict[str, Any]) -> str:
    reflector = config["reflector"]
    for key in ("object", "scene_object"):
        if reflector.get(key):
            return str(reflector[key])
    mesh = reflector.get("mesh")
    return str(mesh).replace("\\", "/").rsplit("/", 1)[-1] if mesh else "reflector"
