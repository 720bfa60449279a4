"""One combination of settings: baked small, drawn, and measured."""

from __future__ import annotations

import copy
import json
import shutil
import time
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from mirrorbake import _core
from mirrorbake.bake.bake import bake
from mirrorbake.evaluate.contenders import Contender, main_run_time, run_time_of
from mirrorbake.evaluate.evaluate import Onlooker
from mirrorbake.evaluate.metrics import flip
from mirrorbake.evaluate.places import choose_views
from mirrorbake.pem.body_light import BodyLight
from mirrorbake.pem.opened import OpenedPem
from mirrorbake.pem.pyramid import coarse_end, pyramid_of, size_of
from mirrorbake.pem.run_time import RunTime
from mirrorbake.pem.store import PemStore
from mirrorbake.scene.build import build_scene
from mirrorbake.scene.stage import Stage, prepare_stage
from mirrorbake.study.middle import overridden
from mirrorbake.study.trade.drawing import Drawing, draw, draw_samples
from mirrorbake.study.trade.kept_traces import KeptTraces
from mirrorbake.study.trade.maps import packed_bytes

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.config import Parts, SceneConfig
    from mirrorbake.study.trade.axes import Setting

PLACES = ("on", "between", "off_5")
"""From which a trial is looked at: every sample, between every two of them, and past the last."""
DRAW_REPEATS = 5
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
    """Of processor time, to trace, build matrices and solve, per degree of the arc (per view, if there is one
    view)."""
    draw_ms: float
    """Of one core, to draw a frame from maps in memory, in software."""
    psnr: dict[str, float | None]
    """dB by place, the mean of its views."""
    flip: dict[str, float | None]
    """By place, the mean of its views."""
    ceiling: dict[str, float]
    """dB of the references by place, of the view whose is lowest."""

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


class _Look(NamedTuple):
    """How a trial looks in one view."""

    psnr: float | None
    flip: float | None
    ceiling: float


class Bench:
    """Where trials are made: the scene, its tracers, what they have traced, and its references.

    To be used as a context: what it leaves in the folder are the references.

    Parameters
    ----------
    config
        The scene with few views, in which nothing is "auto" that an axis is about.
    folder
        Takes the references, and PEMs while they are measured.
    stage
        The scene, if it has been prepared already.
    """

    def __init__(self, config: SceneConfig, folder: Path, stage: Stage | None = None) -> None:
        self.config = config
        self._folder = folder
        self._stages: dict[str, Stage] = {}
        self._lit: dict[str, tuple[Parts | None, _core.Tracer]] = {}
        self._traces = KeptTraces()
        self._own: tuple[OpenedPem, float] | None = None
        if stage is not None:
            self._stages[self._key(config)] = self._traces.keeping(stage)
            self._lit[self._key(config, of_light=True)] = (config.reflector.parts, stage.tracer)

    def __enter__(self) -> Bench:
        """Begin."""
        return self

    def __exit__(self, *failure: object) -> None:
        """Remove the PEMs."""
        for name in ("own", "trial"):
            shutil.rmtree(self._folder / name, ignore_errors=True)

    @staticmethod
    def _key(config: SceneConfig, *, of_light: bool = False) -> str:
        data = json.loads(config.model_dump_json())
        for key in ("samples", "noise"):
            data["trace"].pop(key)
        sections = ["reflector", "material", "surroundings", "trace"]
        if of_light:
            data["reflector"].pop("parts")
        else:
            sections.append("views")
        return json.dumps([data.get(section) for section in sections])

    def stage(self, config: SceneConfig) -> Stage:
        """The tracer of a scene, shared by all that are lit and seen alike."""
        key = self._key(config)
        if key not in self._stages:
            self._stages[key] = self._traces.keeping(self._prepared(config))
        return replace(self._stages[key], config=config)

    def _prepared(self, config: SceneConfig) -> Stage:
        """Prepare a scene; one that is seen from elsewhere, or in other parts, keeps its tracer's light."""
        key = self._key(config, of_light=True)
        if key not in self._lit:
            stage = prepare_stage(config)
            self._lit[key] = (config.reflector.parts, stage.tracer)
            return stage
        parts, tracer = self._lit[key]
        built = build_scene(config)
        if config.reflector.parts != parts:
            names = built.scene.object_part_names(built.reflector)
            materials = built.scene.object_part_materials(built.reflector)
            tracer = tracer.with_parts(built.reflector, built.parts.tolist(), names, materials)
        return Stage(config, built, tracer)

    def measure(self, settings: Mapping[str, Setting]) -> Trial:
        """Bake, draw and measure a combination of settings, by axis.

        Raises
        ------
        InputError
            The scene cannot be baked so.
        """
        overrides = {key: value for setting in settings.values() for key, value in setting.overrides.items()}
        if not overrides:
            # What is only drawn or stored otherwise is baked once.
            if self._own is None:
                self._own = self._bake(self.config, self._folder / "own")
            return self._look(*self._own, settings)
        return self._look(*self._bake(overridden(self.config, overrides), self._folder / "trial"), settings)

    def _bake(self, config: SceneConfig, directory: Path) -> tuple[OpenedPem, float]:
        """Bake a PEM; return it, and seconds of processor time per sample."""
        shutil.rmtree(directory, ignore_errors=True)
        stage = self.stage(config)
        watch = _Stopwatch(self._traces)
        summary = bake(config, directory, watch, stage)
        store = PemStore.open(directory)
        stage = stage.planned(summary.plan)
        pem = OpenedPem(store, stage, RunTime(store, BodyLight.of(stage.built, store.header.lightmap)))
        return pem, watch.seconds / len(pem.space)

    def _look(self, opened: OpenedPem, seconds: float, settings: Mapping[str, Setting]) -> Trial:
        pem, size = _remapped(opened, settings.values())
        drawing = Drawing.joined(setting.drawing for setting in settings.values())
        contender = Contender("PEM", lambda frame, run_time: draw(frame, run_time, drawing))
        onlooker = Onlooker(
            pem,
            self._folder / "references",
            margin=REFERENCE_MARGIN,
            contenders={"pem": contender},
            run_times=(main_run_time(pem),),
        )
        looks: dict[str, list[_Look]] = {}
        for view in choose_views(pem.stage.built.cameras, pem.space, every=True):
            seen = onlooker.look(view) if view.place in PLACES else None
            if seen is None:
                continue
            light, reference = seen.pictures["pem"][seen.run_time], seen.reference
            picture = reference.images.composite(light)
            error = flip(picture, reference.images.beauty, reference.mask)
            looks.setdefault(view.place, []).append(_Look(reference.psnr(light), error, reference.ceiling))
        count = len(pem.store.header.space)
        views = pem.store.header.source.config["views"]
        per_degree = (count - 1) / abs(views["degrees"]) if count > 1 and views["degrees"] else 1.0
        return Trial(
            settings={axis: setting.label for axis, setting in settings.items()},
            bytes_per_degree=size * per_degree,
            bake_s=seconds * per_degree,
            draw_ms=_draw_ms(pem, drawing),
            psnr={place: _mean(look.psnr for look in several) for place, several in looks.items()},
            flip={place: _mean(look.flip for look in several) for place, several in looks.items()},
            ceiling={place: min(look.ceiling for look in several) for place, several in looks.items()},
        )


class _Stopwatch:
    """Measures the samples of a bake in processor time, so that nothing else that runs counts.

    To be given to a bake as its progress: it starts again whenever nothing is done, last before the first
    sample.
    """

    def __init__(self, traces: KeptTraces) -> None:
        self._traces = traces
        self._began = self._now()
        self.seconds = 0.0
        """That the samples took, or would have taken without the traces that were kept."""

    def __call__(self, done: int, total: int, text: str) -> None:
        if done == 0:
            self._began = self._now()
        self.seconds = self._now() - self._began

    def _now(self) -> float:
        return time.process_time() + self._traces.saved_s


def _mean(figures: Iterable[float | None]) -> float | None:
    known = [figure for figure in figures if figure is not None]
    return sum(known) / len(known) if known else None


def _remapped(pem: OpenedPem, settings: Iterable[Setting]) -> tuple[OpenedPem, float]:
    """The PEM with its maps as they come back from storage, and their bytes per view."""
    levels = next((s.levels for s in settings if s.levels is not None), None)
    storage = next((s.storage for s in settings if s.storage is not None), None)
    header = pem.store.header
    faces = header.faces
    capture = pyramid_of(pem.store.read_capture(), header.projection)

    def remap(texels: FloatArray) -> FloatArray:
        if storage is not None:
            texels = storage.apply(texels)
        if levels is None:
            return texels
        return levels.apply(
            texels, size_of(len(texels), faces), coarse_end(capture, len(texels)), header.projection
        )

    size = 0
    # A view in the middle stands for all: they show the same scene.
    index = _middle(len(header.space))
    for part, layer in header.map_names():
        texels = pem.store.read_map(part, layer, index)
        stored = texels if levels is None else texels[: faces * size_of(len(texels), faces) ** 2]
        codes = stored.astype(header.precision) if storage is None else storage.encode(stored)
        size += packed_bytes(codes)
    run_time = (
        copy.copy(pem.run_time) if levels is None and storage is None else replace(pem.run_time, remap=remap)
    )
    return replace(pem, run_time=run_time), float(size)


def _draw_ms(pem: OpenedPem, drawing: Drawing) -> float:
    point = pem.space.sample(_middle(len(pem.space)))
    samples = pem.stage.visibility(point, run_time_of(pem, main_run_time(pem)).places)
    eye = pem.stage.built.cameras.camera(point).eye
    times = []
    # Of one core, so that nothing else that runs counts; the first time reads the maps.
    with _core.ThreadLimit(1):
        for _ in range(1 + DRAW_REPEATS):
            start = time.process_time()
            draw_samples(pem, point, eye, samples, drawing)
            times.append(time.process_time() - start)
    return 1e3 * min(times[1:])


def _middle(count: int) -> int:
    """Number of the sample that is looked at, of so many along the arc (`choose_views`)."""
    return (count - 1) // 2
