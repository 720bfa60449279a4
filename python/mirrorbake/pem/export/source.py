"""What the exporters need to know of a PEM, whatever its container looks like."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.pem.export.mesh_file import ReflectorMesh

if TYPE_CHECKING:
    from collections.abc import Callable

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.opened import OpenedPem
    from mirrorbake.scene.parameters import ParameterSpace


@dataclass(frozen=True)
class Shell:
    """One layer of a part's environment."""

    name: str
    proxy: dict[str, Any]
    """As `mirrorbake.proxy.proxy_to_attributes` returns it."""
    size: int
    """Texels along a side of the finest level."""
    opaque: bool
    """Whether it has no α: the last one of its part."""


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
    pyramid: Callable[[int, int, int], FloatArray]
    """`pyramid(sample, part, shell)`: all levels of a map, (texels, 3) or, not opaque, (texels, 4)."""
    still: Callable[[int], FloatArray]
    """`still(sample)`: the ray-traced picture (H, W, 3) of a sample's view, scene-linear."""
    mesh: ReflectorMesh
    material: dict[str, Any]
    static: FloatArray
    """All levels of the static map, (texels, 3)."""
    static_proxy: dict[str, Any]
    static_size: int
    camera: dict[str, Any]
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
                Shell(shell.name, shell.proxy, header.map_size, opaque=shell is part.shells[-1])
                for shell in part.shells
            ),
        )
        for part in header.parts
    )
    material = built.scene.material(built.scene.object_material(built.reflector))
    mesh = built.scene.object_mesh(built.reflector)
    local = store.read_local_triangles()
    whole = np.ones(len(built.triangles), np.bool_) if local is None else local != 0
    irradiance = store.read_irradiance()
    diffuse, notes = None, []
    if irradiance is not None:
        diffuse = (irradiance * (np.array(material.albedo) / math.pi)).astype(np.float32)
        if material.albedo_texture.texture >= 0:
            notes.append("the texture of the diffuse layer is left out: its colour is the material's albedo")
    if material.specular_texture.texture >= 0:
        notes.append("the texture of the reflectance is left out")

    def pyramid(sample: int, part: int, shell: int) -> FloatArray:
        return store.read_map(parts[part].name, parts[part].shells[shell].name, sample)

    return ExportSource(
        parts=parts,
        space=header.space,
        motion=_motion(header.source.config),
        pyramid=pyramid,
        still=lambda sample: store.read_images(sample).beauty,
        mesh=ReflectorMesh(
            positions=built.positions,
            normals=np.asarray(mesh.normals),
            triangles=built.triangles,
            parts=built.parts,
            whole_stack=whole,
            diffuse=diffuse,
        ),
        material={
            "fresnel": material.fresnel.model.name,
            "r0": list(material.fresnel.r0),
            "eta": list(material.fresnel.eta),
            "k": list(material.fresnel.k),
            "coated": material.layers == _core.LayerModel.coated,
        },
        static=_core.build_cube_pyramid(store.read_capture()),
        static_proxy=header.static["proxy"] or header.static["infinite"],
        static_size=header.map_size,
        camera=_camera(pem),
        run_time=run_time_attributes(pem.run_time.model),
        title=_title(header.source.config),
        notes=tuple(notes),
    )


def run_time_attributes(model: _core.RunTimeModel) -> dict[str, Any]:
    """Return plain values of what the page needs to know of a run-time model."""
    return {
        "name": model.name,
        "places": [list(place) for place in model.places],
        "footprintScale": model.footprint_scale,
        "filter": model.filter,
        "maxTaps": model.max_taps,
    }


def _camera(pem: OpenedPem) -> dict[str, Any]:
    cameras = pem.stage.built.cameras
    return {
        "kind": cameras.kind,
        "target": list(cameras.centre),
        "radius": cameras.radius,
        "height": cameras.height,
        "startDegrees": cameras.start,
        "degrees": cameras.degrees,
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
        "pivot": list(config["reflector"]["position"]),
    }


def _title(config: dict[str, Any]) -> str:
    reflector = config["reflector"]
    for key in ("object", "scene_object"):
        if reflector.get(key):
            return str(reflector[key])
    mesh = reflector.get("mesh")
    return str(mesh).replace("\\", "/").rsplit("/", 1)[-1] if mesh else "reflector"
