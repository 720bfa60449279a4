"""The bake: for every sample, trace the layers, build rendering matrices, solve, store."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.analyze import analyze
from mirrorbake.errors import OptionError, StoreError
from mirrorbake.pem.header import Header, Source
from mirrorbake.pem.run_time import lookups_of
from mirrorbake.pem.store import GROUP_NAME, PemStore, Timings, exclusive
from mirrorbake.pem.view_images import images_of_trace
from mirrorbake.proxy import hull_triangles, proxy_from_attributes, proxy_to_attributes
from mirrorbake.scene.inputs import hash_inputs
from mirrorbake.scene.parameters import space_of
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.build import BuiltScene
    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.plan import Plan
    from mirrorbake.scene.stage import Stage

ProgressReport: TypeAlias = Callable[[int, int, str], None]
"""Called with steps done, steps in all, and what is going on."""

PlanReport: TypeAlias = Callable[["Plan"], None]
"""Called with what was decided, before the first view."""


@dataclass(frozen=True)
class BakeSummary:
    """What a bake did."""

    views: int
    resumed: int
    """How many of the views were there already."""
    plan: Plan
    clamped: int
    """Values of the maps that float16 could not hold."""
    notes: list[str]
    """What the user should know about the inputs."""


def bake(
    config: SceneConfig,
    directory: Path,
    progress: ProgressReport | None = None,
    stage: Stage | None = None,
    on_plan: PlanReport | None = None,
    samples: Sequence[int] | None = None,
) -> BakeSummary:
    """Bake a scene's PEM into a folder, or finish one that was interrupted.

    Parameters
    ----------
    config
        The scene.
    directory
        Made if it does not exist. If it holds a PEM of the same scene, only what is missing is baked.
    progress
        Told about every view.
    stage
        The scene, if it has been prepared already.
    on_plan
        Told what is "auto" in the scene and was decided, before the first view; when resuming, what was
        decided then.
    samples
        Numbers of those to bake; None: all. Each comes out the same, bit for bit, whichever others are
        baked, and when.

    Raises
    ------
    StoreError
        The folder cannot be written to, holds something else, or a PEM of another scene.
    InputError
        The scene is not usable, or has no such sample. Nothing has been written then.
    """
    report = progress or (lambda done, total, text: None)
    source = Source(_core.version(), json.loads(config.model_dump_json()), hash_inputs(config))
    _check_output(directory, source)
    total = len(space_of(config))
    for index in samples or ():
        if not 0 <= index < total:
            raise OptionError(f"sample {index}: expected 0 to {total - 1}")
    report(0, total, "preparing the scene")
    stage = replace(stage or prepare_stage(config), config=config)
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise StoreError(f"{directory}: cannot write: {failure.strerror or failure}") from None
    with exclusive(directory):
        if PemStore.exists(directory):
            store = PemStore.open(directory, writable=True)
            store.remove_stray_files()
        else:
            report(0, total, "finding out what the scene requires")
            plan = analyze(stage)
            store = _create_store(stage.planned(plan), plan, source, directory)
        stage = stage.planned(store.header.plan)
        if on_plan is not None:
            on_plan(store.header.plan)
        done = store.completed()
        resumed = int(done.sum())
        capture = _core.build_cube_pyramid(store.read_capture())
        baker = _ViewBaker(stage, store, capture)
        clamped = 0
        wanted = range(total) if samples is None else samples
        for step, index in enumerate(wanted):
            if not done[index]:
                report(step, len(wanted), f"sample {index + 1} of {total}")
                clamped += baker.bake_view(index)
        report(len(wanted), len(wanted), f"{len(wanted)} samples")
    return BakeSummary(
        views=total, resumed=resumed, plan=store.header.plan, clamped=clamped, notes=stage.built.notes
    )


def _check_output(directory: Path, source: Source) -> None:
    if not directory.exists():
        return
    if not directory.is_dir():
        raise StoreError(f"{directory}: is a file, expected a folder for the PEM")
    if PemStore.exists(directory):
        existing = PemStore.open(directory).header.source
        if existing.fingerprint != source.fingerprint:
            raise StoreError(
                f"{directory}: holds a PEM of another scene ({source.difference_from(existing)}); "
                "bake to another folder or remove it"
            )
    elif any(entry.name != f".{GROUP_NAME}.partial" for entry in directory.iterdir()):
        raise StoreError(f"{directory}: is not empty and holds no PEM; expected a new or an empty folder")


def _create_store(stage: Stage, plan: Plan, source: Source, directory: Path) -> PemStore:
    config, built, tracer = stage.config, stage.built, stage.tracer
    origin = plan.distant["origin"]
    parts = []
    for number, name in enumerate(built.part_names):
        layers: dict[str, Any] = {}
        if plan.has_local(name):
            layers["local"] = _local_ellipsoid(built, number)
        layers["distant"] = plan.distant
        parts.append({"name": name, "layers": layers})
    capture = tracer.capture_cube(origin, plan.map_size, [built.reflector], stage.options)
    irradiance = None
    if plan.has_diffuse:
        irradiance = tracer.vertex_irradiance(built.reflector, DIFFUSE_RAYS, config.trace.seed)
    header = Header(
        source=source,
        plan=plan,
        space=built.space,
        parts=parts,
        static={
            "infinite": proxy_to_attributes(_core.Proxy.infinite(origin)),
            "proxy": None if plan.distant["shape"] == "infinite" else plan.distant,
        },
        map_size=plan.map_size,
        precision=config.maps.precision,
        image_size=config.views.size,
    )
    local_triangles = None
    if plan.has_hull_split:
        local_triangles = (~hull_triangles(built.positions, built.triangles)).astype(np.uint8)
    return PemStore.create(directory, header, capture, irradiance, local_triangles)


DIFFUSE_RAYS = 1024
"""Gather rays per vertex of the diffuse layer."""


def _local_ellipsoid(built: BuiltScene, part: int) -> dict[str, Any]:
    triangles = built.triangles[built.parts == part]
    centre = _core.area_weighted_centroid(built.positions, triangles)
    return proxy_to_attributes(_core.fit_ellipsoid(built.positions[np.unique(triangles)], centre))


class _ViewBaker:
    def __init__(self, stage: Stage, store: PemStore, capture: FloatArray) -> None:
        config = stage.config
        self._stage = stage
        self._config = config
        self._store = store
        self._capture = capture
        self._local_triangles = store.read_local_triangles()
        self._layout = _core.CubePyramidLayout(store.header.map_size)
        self._lookup = lookups_of(config.infer.footprint_scale)
        self._solve = _core.SolveOptions(
            smoothness=config.infer.smoothness,
            level_agreement=config.infer.level_agreement,
            prior_weight=config.infer.prior_weight,
            tolerance=config.infer.tolerance,
            max_iterations=config.infer.iterations,
        )

    def bake_view(self, index: int) -> int:
        """Bake one view; returns how many values had to be clamped."""
        start = time.perf_counter()
        trace = self._stage.trace(self._store.header.space.sample(index))
        trace_s = time.perf_counter() - start
        build_s = solve_s = 0.0
        maps = {}
        for number, part in enumerate(self._store.header.parts):
            for layer, description in part["layers"].items():
                start = time.perf_counter()
                triangles = self._local_triangles if layer == "local" else None
                matrix = _core.build_rendering_matrix(
                    trace.samples,
                    number,
                    proxy_from_attributes(description),
                    self._layout,
                    self._lookup,
                    triangles,
                )
                values = self._values(trace.samples, layer, "local" in part["layers"])
                target = matrix.average(values)
                middle = time.perf_counter()
                maps[part["name"], layer] = self._infer(matrix, target, layer)
                build_s += middle - start
                solve_s += time.perf_counter() - middle
        return self._store.write_view(index, maps, images_of_trace(trace), Timings(trace_s, build_s, solve_s))

    def _values(self, samples: _core.SurfaceSamples, layer: str, has_local: bool) -> FloatArray:
        local = np.asarray(samples.shells[0].radiance)
        if layer == "local":
            return local
        distant = np.asarray(samples.shells[1].radiance)[:, :3]
        return distant if has_local else local[:, :3] + (1.0 - local[:, 3:]) * distant

    def _infer(self, matrix: _core.RenderingMatrix, target: FloatArray, layer: str) -> FloatArray:
        # Never a neighbour's maps as they were baked: a sample is a function of the scene and its number.
        initial = self._capture if layer == "distant" else None
        if matrix.rows == 0:
            channels = target.shape[1]
            return np.zeros((self._layout.texels, channels), np.float32) if initial is None else initial
        weights = _core.display_row_weights(matrix, self._stage.options.samples_per_pixel, target)
        solver = _core.MapSolver([(matrix, [(0, 1.0)])], [self._layout], options=self._solve)
        captured = layer == "distant" and self._config.infer.prior == "captured"
        texels, _ = solver.solve([target], [weights], self._capture if captured else None, initial)
        return np.asarray(texels)
