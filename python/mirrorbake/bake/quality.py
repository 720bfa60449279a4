"""What a bake spends: the decisions that `auto.quality` makes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mirrorbake.scene.parameters import CAMERA_AXES
from mirrorbake.scene.plan import Decision

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mirrorbake.scene.stage import Stage


@dataclass(frozen=True)
class Quality:
    """What one quality spends."""

    noise: float
    """Standard error of a displayed pixel that targets may have; 0: whatever `trace.samples` leave."""
    passes: int
    neighbours: float
    """Weight of neighbouring views, where they are near."""
    around: int
    """Views beside an arc around each of its samples, where these are near."""
    traced: int
    """Views between maps that are far apart, in a cell of one axis; squared in one of two."""
    static: int
    """Views of the static set."""
    background: int | None = None
    """Samples of a pixel off the object, which no map is fitted to; None: as on the object."""


QUALITIES: Mapping[str, Quality] = {
    "draft": Quality(noise=0.0, passes=1, neighbours=0.0, around=0, traced=0, static=0, background=2),
    "normal": Quality(noise=0.01, passes=2, neighbours=0.3, around=8, traced=1, static=64),
    "high": Quality(noise=0.005, passes=2, neighbours=0.3, around=16, traced=2, static=128),
}

NEAR_DEGREES = 3.0
"""Between maps: neighbours' views are fitted by a map itself up to here, and views between them by the maps'
blend from here on."""
SAMPLES_MULTIPLE = 4
"""Adaptive sampling compares quarters of a pixel's samples."""

_SET = "set in the scene"


def spacing(stage: Stage) -> float | None:
    """Degrees between neighbouring maps along the camera's axes, the widest; None without such axes."""
    widest = None
    for axis in stage.space.axes:
        if axis.name not in CAMERA_AXES:
            continue
        scale = abs(stage.built.cameras.degrees) if axis.name == "arc" else 1.0
        step = scale * max((high - low for low, high in axis.cells()), default=0.0)
        widest = step if widest is None else max(widest, step)
    return widest


def quality_decisions(stage: Stage, samples: int) -> list[Decision]:
    """Decide what `auto.quality` is about; what the scene file sets is obeyed.

    Parameters
    ----------
    stage
        The scene.
    samples
        Per pixel, as decided.
    """
    config = stage.config
    name = config.auto.quality
    quality = QUALITIES[name]
    step = spacing(stage)
    apart = "" if step is None else f"maps are {step:.3g} degrees apart"
    several = len(stage.space) > 1 and step is not None
    near = several and step is not None and step <= NEAR_DEGREES
    display = config.infer.fit == "display"

    def decided(key: str, value: float, reason: str) -> Decision:
        section, entry = key.split(".")
        wanted = getattr(getattr(config, section), entry)
        if wanted is not None:
            return Decision(key, None, wanted, False, _SET, None)
        return Decision(key, None, value, True, f"{name} quality: {reason}", None)

    noise, noise_reason = quality.noise, "what samples leave is left"
    if samples % SAMPLES_MULTIPLE:
        noise, noise_reason = 0.0, f"{samples} samples are no multiple of {SAMPLES_MULTIPLE}"
    elif not display:
        noise, noise_reason = 0.0, 'infer.fit = "layers" takes all samples alike'
    elif noise > 0.0:
        noise_reason = (
            f"pixels with more noise than {noise:g} get more samples, at most {config.trace.most_samples}"
        )
    axes = sum(axis.name in CAMERA_AXES for axis in stage.space.axes)
    traced = quality.traced**axes if several and not near and display else 0
    neighbours = quality.neighbours if near and display else 0.0
    static, static_reason = _static(stage, quality)
    around, around_reason = _around(stage, quality, near=near)
    return [
        decided("trace.noise", noise, noise_reason),
        decided("views.traced", traced, _words(traced > 0, apart, several, "by the blend of maps")),
        decided("views.around", around, around_reason),
        decided("infer.passes", quality.passes, "how often weights are taken from the fit's own image"),
        decided("infer.neighbours", neighbours, _words(neighbours > 0.0, apart, several, "by each map")),
        decided("static.views", static, static_reason),
    ]


def _words(used: bool, apart: str, several: bool, how: str) -> str:
    if not several:
        return "there is one map along the camera's axes"
    return f"{apart}, views around are fitted {how}" if used else f"{apart}, no further views are fitted"


def _no_further_views(stage: Stage) -> str | None:
    """Why a scene can have no views but those that its maps stand for; None: it can."""
    if stage.config.infer.fit != "display":
        return 'infer.fit = "layers" has none'
    if stage.space.changes_scene:
        return "the scene changes"
    if stage.config.infer.matrix == "probed":
        return "each of them would take pictures of its own"
    return None


def _around(stage: Stage, quality: Quality, *, near: bool) -> tuple[int, str]:
    if stage.config.views.kind != "arc":
        return 0, "there is no arc beside which they would be"
    refusal = _no_further_views(stage)
    if refusal is not None:
        return 0, refusal
    if not near:
        return 0, "maps are far apart, or there is but one"
    if quality.around == 0:
        return 0, "samples are fitted to their own views"
    return quality.around, "samples are fitted to views beside the arc, too, so that their maps hold there"


def _static(stage: Stage, quality: Quality) -> tuple[int, str]:
    if stage.config.views.kind == "none":
        return 0, "the PEM is a static set itself"
    refusal = _no_further_views(stage)
    if refusal is not None:
        return 0, refusal
    if quality.static == 0:
        return 0, "far from the samples the nearest one is drawn"
    return quality.static, "far from the samples maps of a dome are drawn"
