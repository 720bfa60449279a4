"""A trial before the bake: how far two small samples beat a map that is merely captured, half-way between."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.contents import contents_of
from mirrorbake.bake.sample import SampleBaker
from mirrorbake.pem.header import Source
from mirrorbake.pem.pyramid import pyramid_of, topology_of
from mirrorbake.pem.run_time import model_of, shell_maps
from mirrorbake.proxy import proxy_from_attributes
from mirrorbake.scene.plan import USUAL_WEIGHT, with_weight
from mirrorbake.scene.pose import AT_REST
from mirrorbake.tone import srgb_encoded

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.header import Header
    from mirrorbake.pem.store import Contents
    from mirrorbake.scene.parameters import Point
    from mirrorbake.scene.plan import DecisionValue, Plan
    from mirrorbake.scene.stage import Stage

    Shells = list[list[_core.ShellMap]]

WANTED_DECIBELS = 8.0
"""By which a PEM should beat a captured map at infinity, half-way between samples."""
SIDE = 96
"""Longer side of the trial's pictures, in pixels."""
MAP_SIZE = 64
"""Texels along a side of the trial's maps, at most."""
SAMPLES = 32
"""Per pixel, of the trial's targets at most, before those that `trace.noise` adds."""
REFERENCE_SAMPLES = 64
"""Of each half of a reference: what a display makes of a noisy pixel is too dark, which targets share."""
TOLERANCE = 3e-3
"""Of the solver, at least."""
SEED_OFFSET = 0x7E57_0000
"""Of references: samples apart from those of targets."""
NEAR_THE_NOISE = 3.0
"""Decibels from what a sample's own view is met to up to its target's noise: closer, that limits."""
FALLS = 2.0
"""Decibels from a sample to half-way, from which the distance of the samples is what limits."""


@dataclass(frozen=True)
class Trial:
    """PSNR in dB of the object's pixels, without the references' noise."""

    on: float
    """Of a sample's own view."""
    between: float
    """Half-way to the next sample, by the blend of both."""
    captured: float
    """There, of a captured map at infinity."""
    noise: float
    """PSNR that the target of a bake has against the truth."""

    @property
    def lead(self) -> float:
        """Decibels by which the PEM is better."""
        return self.between - self.captured


def lead_advice(stage: Stage, plan: Plan) -> str | None:
    """Say how far a PEM of a plan will beat a captured map, with the reason where that is not far.

    None where there is nothing to try: one sample, views that change the scene or see no mirror, a draft.

    Parameters
    ----------
    stage
        The scene.
    plan
        Of the bake.
    """
    trial = trial_of(stage, plan)
    return None if trial is None else advice_on(trial)


def trial_of(stage: Stage, plan: Plan) -> Trial | None:
    """Try what `lead_advice` speaks of; None where there is nothing to try."""
    stage = stage.planned(plan)
    config, space = stage.config, stage.space
    middle = space.middle_after((len(space) - 1) // 2)
    if middle is None or space.changes_scene or config.auto.quality == "draft":
        return None
    if config.infer.fit != "display" or config.infer.matrix == "probed":
        return None
    return run_trial(stage, plan)


def advice_on(trial: Trial) -> str:
    """Say what a trial has found; a warning, if it is less than what one bakes a PEM for."""
    figures = f"{trial.between:.1f} against {trial.captured:.1f} dB in a trial of small pictures and maps"
    if trial.lead >= WANTED_DECIBELS:
        return (
            f"half-way between samples the PEM beats a captured map at infinity by {trial.lead:.1f} dB, "
            f"{figures}"
        )
    return (
        f"warning: half-way between samples the PEM beats a captured map at infinity by {trial.lead:.1f} dB "
        f"alone, {figures}; {_reason(trial)}"
    )


def _reason(trial: Trial) -> str:
    if trial.captured > 30.0:
        return "the captured map is hard to beat here: what is reflected is far or plain"
    if trial.on - trial.between > FALLS:
        return (
            f"a sample's own view is met to {trial.on:.1f} dB: nearer samples help (views.count, "
            "views.degrees)"
        )
    if trial.noise - trial.on < NEAR_THE_NOISE:
        return (
            f"the noise of its targets is {trial.noise:.1f} dB: a smaller trace.noise or more trace.samples "
            "help"
        )
    return (
        f"a sample's own view is met to {trial.on:.1f} dB alone: the surface reflects more than its maps "
        "hold; larger pictures and maps, or more reflector.parts, help"
    )


def run_trial(stage: Stage, plan: Plan) -> Trial | None:
    """Bake the sample in the middle and the next one, small, and look half-way; None if nothing is seen.

    Parameters
    ----------
    stage
        Planned, its scene at rest.
    plan
        Of the bake; the trial has its `trace.noise`, for that may be what limits, and no static set.
    """
    stage, contents = small_bake(stage, small_plan(plan, {"trace.samples": min(plan.samples, SAMPLES)}))
    header, space = contents.header, stage.space
    index = (len(space) - 1) // 2
    between = space.middle_after(index)
    assert between is not None
    baker = SampleBaker(stage, contents)
    baked = {node: baker.bake(node).maps for node, _ in space.neighbours(between)}
    at_infinity = _core.ShellMap(
        proxy_from_attributes(header.static["infinite"]),
        topology_of(header.projection, header.map_size),
        pyramid_of(contents.capture, header.projection),
    )
    captured = [[at_infinity] for _ in header.parts]
    on = Look(stage, header, space.sample(index))
    half_way = Look(stage, header, between)
    if not on.seen.any() or not half_way.seen.any():
        return None
    return Trial(
        on.decibels(blended(contents, baked, [(index, 1.0)])),
        half_way.decibels(blended(contents, baked, space.neighbours(between))),
        half_way.decibels(captured),
        on.noise(plan.samples, stage.config.trace.most_samples, cast("float", plan.value("trace.noise"))),
    )


def small_plan(plan: Plan, changed: Mapping[str, DecisionValue]) -> Plan:
    """Return a plan of small maps, without static set and diffuse layer, with other values of some."""
    changed = {"static.views": 0, "layers.diffuse": False, **changed}
    decisions = []
    for decision in plan.decisions:
        value = changed.get(decision.key, decision.value)
        if decision.key == "maps.size":
            value = min(cast("int", decision.value), MAP_SIZE)
        decisions.append(replace(decision, value=value))
    return replace(plan, decisions=tuple(decisions))


def small_bake(stage: Stage, plan: Plan) -> tuple[Stage, Contents]:
    """Return a stage of small pictures by a plan, and what its samples share."""
    config = plan.resolve(stage.config)
    infer = with_weight(config.infer, USUAL_WEIGHT) if config.infer.smoothness is None else config.infer
    infer = infer.model_copy(update={"tolerance": max(infer.tolerance, TOLERANCE)})
    config = config.model_copy(update={"infer": infer})
    width, height = stage.built.cameras.size
    scale = min(1.0, SIDE / max(width, height))
    size = (max(1, round(scale * width)), max(1, round(scale * height)))
    cameras = replace(stage.built.cameras, size=size)
    stage = replace(stage, config=config, built=replace(stage.built, cameras=cameras), moved={}, cut={})
    return stage, contents_of(stage, plan, Source("", json.loads(config.model_dump_json()), {}))


def blended(
    contents: Contents,
    maps: Mapping[int, Mapping[tuple[str, str], FloatArray]],
    weights: Sequence[tuple[int, float]],
) -> Shells:
    """Return the blend of samples' maps, to be drawn with the object at rest."""

    def read(part: str, shell: str) -> FloatArray:
        return cast(
            "FloatArray", sum(np.float32(weight) * maps[node][part, shell] for node, weight in weights)
        )

    return shell_maps(contents.header, read, AT_REST, contents.local_triangles)


class Look:
    """A view with two halves of a reference, and the body's own light, which all contenders share."""

    def __init__(self, stage: Stage, header: Header, point: Point) -> None:
        camera = stage.built.cameras.camera(point)
        self._model = model_of(header.run_time)
        self._lookups = stage.tracer.trace_visibility(
            camera, stage.built.reflector, stage.options, self._model.places
        )
        pixels = camera.width * camera.height
        self._halves, self.seen = [], np.ones(pixels, bool)
        for half in range(2):
            options = stage.options
            options.samples_per_pixel, options.seed = REFERENCE_SAMPLES, SEED_OFFSET + half
            options.noise = 0.0
            traced = stage.tracer.trace_layers(camera, stage.built.reflector, options)
            pixel = np.asarray(traced.samples.pixel)
            count = np.bincount(pixel, minlength=pixels)
            self.seen &= count == options.samples_per_pixel
            beauty, body = (
                _pixel_means(pixel, light, pixels) for light in (traced.sample_beauty, traced.samples.diffuse)
            )
            self._halves.append((_shown(beauty), body))

    def decibels(self, parts: Shells) -> float:
        drawn = np.asarray(_core.render_reflector(self._lookups, parts, None, self._model)).reshape(-1, 4)
        seen = self.seen & (drawn[:, 3] > 0.99)
        if not seen.any():
            return _decibels(0.0)
        # The halves' noise is independent, so that it cancels in the product; each half has the body as it
        # traced it itself, whose noise is then in picture and reference alike.
        a, b = (_shown(drawn[seen, :3] + body[seen]) - shown[seen] for shown, body in self._halves)
        return _decibels(float(np.mean(a * b)))

    def noise(self, samples: int, most: int, allowed: float) -> float:
        """Decibels of a target, by its samples and by what `trace.noise` makes of them."""
        a, b = (shown[self.seen] for shown, _ in self._halves)
        of_one = float(np.mean((a - b) ** 2)) / 2.0 * REFERENCE_SAMPLES
        if allowed > 0.0:
            return _decibels(max(min(of_one / samples, allowed**2), of_one / max(samples, most)))
        return _decibels(of_one / samples)


def _pixel_means(pixel: NDArray[np.uint32], light: FloatArray, pixels: int) -> FloatArray:
    """Return means (pixels, 3) of a reference's samples, where all of them meet the object."""
    sums = [np.bincount(pixel, light[:, c], pixels) for c in range(3)]
    return (np.stack(sums, axis=-1) / REFERENCE_SAMPLES).astype(np.float32)


def _shown(light: FloatArray) -> NDArray[np.float64]:
    shown: NDArray[np.float64] = srgb_encoded(light).astype(np.float64)
    return shown


def _decibels(squares: float) -> float:
    return -10.0 * math.log10(max(squares, 1e-6))
