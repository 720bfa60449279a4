"""One combination of settings: baked small, drawn, and measured."""

from __future__ import annotations

import copy
import json
import shutil
import time
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from mirrorbake import _core
from mirrorbake.bake.bake import bake
from mirrorbake.evaluate.evaluate import Onlooker
from mirrorbake.evaluate.metrics import flip
from mirrorbake.evaluate.places import View, choose_views
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import Stage, prepare_stage
from mirrorbake.study.trade.maps import packed_bytes

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.study.trade.axes import Setting

PLACES = ("on", "between", "off_5")
"""From which a trial is looked at."""
DRAW_REPEATS = 3
REFERENCE_MARGIN = 10.0
"""dB that references get to spare, so that most better trials are measured against the same ones."""


@dataclass(frozen=True)
class Trial:
    """What a combination of settings costs, and how far off it is."""

    settings: dict[str, str]
    """Labels by axis, of those that are not the scene's own."""
    bytes_per_degree: float
    """Of the maps, compressed as on disk, per degree of the arc (per view, if there is one view)."""
    bake_s: float
    """Tracing, building matrices and solving per degree of the arc (per view, if there is one view)."""
    draw_ms: float
    """To draw one frame from maps in memory, in software."""
    psnr: dict[str, float | None]
    """dB by place."""
    flip: dict[str, float | None]
    """By place."""
    ceiling: dict[str, float]
    """dB of the references by place."""

    @property
    def near(self) -> float | None:
        """Mean PSNR in dB on a sample and between two: what a study ranks by."""
        values = [value for place in ("on", "between") if (value := self.psnr.get(place)) is not None]
        return sum(values) / len(values) if values else None

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self)

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> Trial:
        """Inverse of `to_dict`. Raises TypeError for what is not one."""
        return Trial(**data)


def overridden(config: SceneConfig, overrides: Mapping[str, Any]) -> SceneConfig:
    """Return a scene with other values of some keys, such as `maps.size`.

    Raises
    ------
    InputError
        A value is out of range.
    """
    data: dict[str, Any] = json.loads(config.model_dump_json())
    for key, value in overrides.items():
        section, name = key.split(".")
        data[section][name] = value
    return parse_config(data, "study")


class Bench:
    """Where trials are made: the scene, its tracers and its references.

    Parameters
    ----------
    config
        The scene with few views, in which nothing is "auto" that an axis is about.
    folder
        Takes the references, and a PEM while it is measured.
    """

    def __init__(self, config: SceneConfig, folder: Path) -> None:
        self.config = config
        self._folder = folder
        self._stages: dict[str, Stage] = {}

    def stage(self, config: SceneConfig) -> Stage:
        """The tracer of a scene, shared by all that are lit and seen alike."""
        data = json.loads(config.model_dump_json())
        data["trace"].pop("samples")
        sections = ("reflector", "material", "surroundings", "views", "trace")
        key = json.dumps([data.get(section) for section in sections])
        if key not in self._stages:
            self._stages[key] = prepare_stage(config)
        return replace(self._stages[key], config=config)

    def measure(self, settings: Mapping[str, Setting]) -> Trial:
        """Bake, draw and measure a combination of settings, by axis.

        Raises
        ------
        InputError
            The scene cannot be baked so.
        """
        overrides = {key: value for setting in settings.values() for key, value in setting.overrides.items()}
        config = overridden(self.config, overrides)
        directory = self._folder / "trial"
        shutil.rmtree(directory, ignore_errors=True)
        try:
            stage = self.stage(config)
            bake(config, directory, None, stage)
            return self._look(open_pem(directory, stage), settings)
        finally:
            shutil.rmtree(directory, ignore_errors=True)

    def _look(self, opened: OpenedPem, settings: Mapping[str, Setting]) -> Trial:
        pem, size = _remapped(opened, settings.values())
        contender = next(
            (setting.contender for setting in settings.values() if setting.contender != "pem"), "pem"
        )
        onlooker = Onlooker(pem, self._folder / "references", (contender,), REFERENCE_MARGIN)
        psnr: dict[str, float | None] = {}
        errors: dict[str, float | None] = {}
        ceiling: dict[str, float] = {}
        for view in _views(pem):
            seen = onlooker.look(view)
            if seen is None or contender not in seen.pictures:
                continue
            light, reference = seen.pictures[contender][seen.run_time], seen.reference
            psnr[view.place] = reference.psnr(light)
            errors[view.place] = flip(
                reference.images.composite(light), reference.images.beauty, reference.mask
            )
            ceiling[view.place] = reference.ceiling
        header = pem.store.header
        count = len(header.space)
        timings = [pem.store.read_timings(index) for index in range(count)]
        seconds = sum(t.trace_s + t.build_s + t.solve_s for t in timings) / count
        views = header.source.config["views"]
        per_degree = (count - 1) / abs(views["degrees"]) if count > 1 and views["degrees"] else 1.0
        return Trial(
            settings={axis: setting.label for axis, setting in settings.items()},
            bytes_per_degree=size * per_degree,
            bake_s=seconds * per_degree,
            draw_ms=_draw_ms(pem),
            psnr=psnr,
            flip=errors,
            ceiling=ceiling,
        )


def _views(pem: OpenedPem) -> list[View]:
    """The first view of each of `PLACES`."""
    views = choose_views(pem.stage.built.cameras, pem.space)
    return [
        next(view for view in views if view.place == p) for p in PLACES if any(v.place == p for v in views)
    ]


def _remapped(pem: OpenedPem, settings: Iterable[Setting]) -> tuple[OpenedPem, float]:
    """The PEM with its maps as they come back from storage, and their bytes per view."""
    levels = next((s.levels for s in settings if s.levels is not None), None)
    storage = next((s.storage for s in settings if s.storage is not None), None)
    header = pem.store.header
    finest = 6 * header.map_size**2
    capture = _core.build_cube_pyramid(pem.store.read_capture())

    def remap(texels: FloatArray) -> FloatArray:
        if storage is not None:
            texels = storage.apply(texels)
        return texels if levels is None else levels.apply(texels, header.map_size, capture)

    size = 0
    # A view in the middle stands for all: they show the same scene.
    index = len(header.space) // 2
    for part, layer in header.map_names():
        texels = pem.store.read_map(part, layer, index)
        stored = texels if levels is None else texels[:finest]
        codes = stored.astype(header.precision) if storage is None else storage.encode(stored)
        size += packed_bytes(codes)
    run_time = (
        copy.copy(pem.run_time) if levels is None and storage is None else replace(pem.run_time, remap=remap)
    )
    return replace(pem, run_time=run_time), float(size)


def _draw_ms(pem: OpenedPem) -> float:
    point = pem.space.sample(len(pem.space) // 2)
    samples = pem.stage.visibility(point)
    pem.run_time.render("pem", point, samples)
    times = []
    for _ in range(DRAW_REPEATS):
        start = time.perf_counter()
        pem.run_time.render("pem", point, samples)
        times.append(time.perf_counter() - start)
    return 1e3 * min(times)
