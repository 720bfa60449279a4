"""Other ways to draw the same maps: filter, coordinates, Fresnel."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from mirrorbake import _core
from mirrorbake.evaluate.contenders import away_of, nearest_sample
from mirrorbake.scene.reflectance import is_plain, materials_of, reflectance

if TYPE_CHECKING:
    from collections.abc import Iterable

    from mirrorbake.arrays import FloatArray
    from mirrorbake.evaluate.contenders import Frame
    from mirrorbake.pem.opened import OpenedPem
    from mirrorbake.scene.parameters import Point
    from mirrorbake.scene.stage import Stage

FresnelModel: TypeAlias = Literal["traced", "exact", "table", "Schlick", "Schlick at vertices"]
FILTERS: dict[str, tuple[Any, int]] = {
    "nearest": ("nearest", 1),
    "bilinear": ("bilinear", 1),
    "trilinear": ("trilinear", 1),
    "1 to 4 taps": ("anisotropic", 4),
    "1 to 16 taps": ("anisotropic", 16),
}
"""Filter and taps of a run time, by the label of a setting."""


@dataclass(frozen=True)
class Drawing:
    """How maps are drawn, where that differs from the library's renderer."""

    nearest: bool = False
    """Without blending: the maps of the nearest sample."""
    filter: str | None = None
    """One of `FILTERS`; None: the run time's."""
    coordinates: Literal["pixel", "vertex"] = "pixel"
    """Where lookups are computed: at the vertices they are interpolated, as [PEM] §5 does."""
    fresnel: FresnelModel = "traced"
    """`traced`: the tracer's, of normals and textures as they are; others evaluate the material's model."""

    @staticmethod
    def joined(drawings: Iterable[Drawing]) -> Drawing:
        """The one that differs from the renderer in all that these differ in."""
        changed: dict[str, Any] = {}
        usual = Drawing()
        for drawing in drawings:
            for entry in fields(Drawing):
                value = getattr(drawing, entry.name)
                if value != getattr(usual, entry.name):
                    changed[entry.name] = value
        return Drawing(**changed)


def run_time_for(model: _core.RunTimeModel, drawing: Drawing) -> _core.RunTimeModel:
    """A run time with the filter of a drawing."""
    if drawing.filter is None:
        return model
    kind, taps = FILTERS[drawing.filter]
    return _core.RunTimeModel(
        name=f"{model.name}, {drawing.filter}",
        places=model.places,
        footprint_scale=model.footprint_scale,
        filter=kind,
        max_taps=taps,
    )


def label_of(model: _core.RunTimeModel) -> str:
    """The label in `FILTERS` of a run time's own filter."""
    own = (model.filter, model.max_taps if model.filter == "anisotropic" else 1)
    return next(label for label, value in FILTERS.items() if value == own)


def fresnel_models(stage: Stage) -> list[FresnelModel]:
    """The ways to evaluate a reflector's reflectance, `traced` first; that alone where textures change it."""
    if not is_plain(stage):
        return ["traced"]
    models = {material.fresnel.model for material in materials_of(stage)}
    if models <= {"constant"}:
        return ["traced"]
    exact: list[FresnelModel] = [] if models <= {"constant", "schlick"} else ["exact"]
    return ["traced", *exact, "table", "Schlick", "Schlick at vertices"]


def draw(frame: Frame, run_time: str, drawing: Drawing) -> FloatArray:
    """Draw a PEM: radiance (H, W, 3) of the reflector in a frame's window, 0 where it is not seen.

    Parameters
    ----------
    frame
        The view.
    run_time
        One of `RUN_TIMES`, whose places the lookups have.
    drawing
        What differs from the library's renderer.
    """
    pem, point = frame.pem, frame.view.point
    shown: Point = nearest_sample(pem, point) if drawing.nearest else point
    samples = frame.samples(run_time)
    return draw_samples(pem, shown, frame.view.camera.eye, samples, drawing, away_of(pem, frame))


def draw_samples(
    pem: OpenedPem,
    point: Point,
    eye: Any,
    samples: _core.SurfaceSamples,
    drawing: Drawing,
    away: float = 0.0,
) -> FloatArray:
    """Draw a PEM from samples where an eye sees the reflector; as `draw`."""
    stage = pem.stage.at(point)
    model = run_time_for(pem.run_time.model, drawing)
    parts = pem.run_time.parts_of("pem", point, away)
    cosine = _Cosine(stage, eye, samples) if drawing.fresnel != "traced" else None
    light = np.zeros((len(samples), 3), np.float32)
    number_of_sample = np.asarray(samples.part)
    for number, shells in enumerate(parts):
        through = np.ones((len(samples), 1), np.float32)
        incident = np.zeros_like(light)
        for shell in shells:
            layer = _read(stage, eye, samples, shell, number, model, drawing)
            incident += through * layer[:, :3]
            through *= 1.0 - layer[:, 3:]
        here = number_of_sample == number
        share = np.asarray(samples.fresnel)
        if cosine is not None:
            share = cosine.reflectance(materials_of(stage)[number].fresnel, drawing.fresnel)
        light[here] = (share * incident)[here]
    diffuse = pem.run_time.diffuse_at(samples, point)
    if diffuse is not None:
        light += diffuse
    pixel, size = np.asarray(samples.pixel), samples.width * samples.height
    count = np.maximum(np.bincount(pixel, minlength=size), 1)
    image = np.stack([np.bincount(pixel, light[:, k], size) / count for k in range(3)], axis=-1)
    return image.reshape(samples.height, samples.width, 3).astype(np.float32)


def _read(
    stage: Stage,
    eye: Any,
    samples: _core.SurfaceSamples,
    shell: _core.ShellMap,
    part: int,
    model: _core.RunTimeModel,
    drawing: Drawing,
) -> FloatArray:
    built = stage.built
    mine = built.parts == part
    if shell.triangles is not None:
        mine = mine & (np.asarray(shell.triangles) > 0)
    triangles = mine.astype(np.uint8)
    proxy = shell.proxy
    if drawing.coordinates == "vertex":
        mesh = built.scene.object_mesh(built.reflector)
        lookups = proxy.mirror_lookup(eye, built.positions, np.asarray(mesh.normals))
        samples = _core.with_vertex_lookups(samples, built.positions, built.triangles, lookups)
        proxy = _core.Proxy.infinite((0.0, 0.0, 0.0))
    map_ = _core.ShellMap(proxy, shell.topology, shell.texels, triangles)
    return np.asarray(_core.shell_light(samples, map_, model))


class _Cosine:
    """Cosines between normals and the eye, at samples and at vertices, and the reflectance there."""

    def __init__(self, stage: Stage, eye: Any, samples: _core.SurfaceSamples) -> None:
        self._samples = samples
        # r = 2(n·v)n - v, so that n·r = n·v.
        normals, reflection = np.asarray(samples.normal), np.asarray(samples.reflection)
        self._pixel = np.clip(np.sum(normals * reflection, axis=1), 0.0, 1.0)
        built = stage.built
        mesh = built.scene.object_mesh(built.reflector)
        towards = np.asarray(eye, np.float32) - built.positions
        towards /= np.linalg.norm(towards, axis=1, keepdims=True)
        self._vertex = np.clip(np.abs(np.sum(np.asarray(mesh.normals) * towards, axis=1)), 0.0, 1.0)
        self._triangles = built.triangles

    def reflectance(self, material: _core.Fresnel, how: FresnelModel) -> FloatArray:
        """F (n, 3) of every sample."""
        assert how != "traced"
        if how != "Schlick at vertices":
            return reflectance(material, how, self._pixel)
        corners = reflectance(material, "Schlick", self._vertex)[
            self._triangles[np.asarray(self._samples.triangle)]
        ]
        second = np.asarray(self._samples.barycentric)
        first = 1.0 - second.sum(axis=1, keepdims=True)
        weights = np.concatenate([first, second], axis=1)
        found: FloatArray = np.einsum("nk,nkc->nc", weights, corners).astype(np.float32)
        return found
