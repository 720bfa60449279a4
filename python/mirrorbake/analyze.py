"""What a scene requires, found before it is baked: layers, bounces, resolution of the maps (spec T6)."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.scene import prepare_stage

if TYPE_CHECKING:
    from mirrorbake.config import SceneConfig
    from mirrorbake.scene import Arc, Stage

PROBE_VIEWS = 3
PROBE_SIDE = 96
"""Longer side of the images with which bounces are counted, in pixels."""
PROBE_SAMPLES = 4
MAX_DEPTH = 8
FINEST_SHARE = 0.1
"""The share of the samples whose reflections may be finer than the maps."""
SMALLEST_MAP, LARGEST_MAP = 16, 4096


@dataclass(frozen=True)
class Finding:
    """One thing that a bake may do or leave, and why."""

    subject: str
    needed: bool
    reason: str


@dataclass(frozen=True)
class Analysis:
    """What a scene requires. The scene file's own settings stay in force: this is advice."""

    layers: list[Finding]
    depth: int
    """Specular bounces after the first that change the images by more than the tolerance."""
    depth_errors: list[float]
    """Relative RMS change of the reflector's samples if bounces end after 0, 1, …, against the full depth."""
    map_size: int
    """Texels along a side of a cube face that the views can tell apart."""
    reasons: list[str]

    def to_json(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self)


def analyze(config: SceneConfig, tolerance: float = 0.01) -> Analysis:
    """Find out what a scene requires by a few small images.

    Parameters
    ----------
    config
        The scene.
    tolerance
        Relative change of the images that is worth no further bounce, in (0, 1).

    Raises
    ------
    mirrorbake.InputError, mirrorbake.FileError, mirrorbake.InvalidArgument
        The scene is not usable.
    """
    if not 0.0 < tolerance < 1.0:
        raise _core.InvalidArgument(f"tolerance is {tolerance}, expected more than 0 and less than 1")
    stage = prepare_stage(config)
    arc = stage.built.arc
    times = [(i + 0.5) / PROBE_VIEWS for i in range(PROBE_VIEWS)]
    layers = [_diffuse(stage), _local(stage, times), _glossy(stage)]
    errors = _depth_errors(stage, _small(arc), times)
    depth = next(d for d, error in enumerate(errors) if error <= tolerance)
    size, step = _map_size(stage, times)
    return Analysis(
        layers,
        depth,
        errors,
        size,
        [
            f"ending after {depth} further bounces changes the reflections by {errors[depth]:.2%}"
            + (f", one fewer by {errors[depth - 1]:.2%}" if depth else ""),
            f"neighbouring pixels reflect directions {math.degrees(step):.2g} degrees apart where the views "
            f"are finest; a texel of the face's middle is {math.degrees(2.0 / size):.2g}",
        ],
    )


def _diffuse(stage: Stage) -> Finding:
    material = _material(stage)
    if any(material.emission):
        return Finding("diffuse", True, "the material emits light")
    if any(material.albedo):
        return Finding("diffuse", True, "the albedo is not black")
    return Finding("diffuse", False, "the albedo is black")


def _local(stage: Stage, times: list[float]) -> Finding:
    built = stage.built
    on_hull = np.asarray(_core.hull_triangles(built.positions, built.triangles)).astype(bool)
    seen = np.concatenate([np.asarray(stage.visibility(t).triangle) for t in times])
    if not len(seen):
        return Finding("local", False, "no view sees the object")
    share = float(1.0 - on_hull[seen].mean())
    if share == 0.0:
        return Finding("local", False, "all that the views see lies on the convex hull")
    return Finding("local", True, f"{share:.1%} of what the views see lies inside of the convex hull")


def _glossy(stage: Stage) -> Finding:
    lobe = _material(stage).lobe
    if lobe == _core.SpecularLobe.mirror:
        return Finding("glossy", False, "the material is a mirror: one direction per sample is all there is")
    return Finding("glossy", True, f"the lobe is {lobe.name}: samples choose a direction in it")


def _material(stage: Stage) -> _core.Material:
    scene = stage.built.scene
    return scene.material(scene.object_material(stage.built.reflector))


def _small(arc: Arc) -> Arc:
    width, height = arc.size
    scale = min(1.0, PROBE_SIDE / max(width, height))
    return replace(arc, size=(max(1, round(scale * width)), max(1, round(scale * height))))


def _depth_errors(stage: Stage, arc: Arc, times: list[float]) -> list[float]:
    values = []
    for depth in range(MAX_DEPTH + 1):
        options = _core.TraceOptions(
            samples_per_pixel=PROBE_SAMPLES, max_specular_depth=depth, seed=stage.config.trace.seed
        )
        # The same random numbers at every depth: what differs are the bounces alone.
        traced = [stage.tracer.trace_layers(arc.camera(t), stage.built.reflector, options) for t in times]
        values.append(np.concatenate([np.asarray(t.sample_beauty, dtype=np.float64) for t in traced]))
    scale = float(np.sqrt(np.mean(values[-1] ** 2))) if values[-1].size else 0.0
    if scale == 0.0:
        return [0.0] * len(values)
    return [float(np.sqrt(np.mean((v - values[-1]) ** 2))) / scale for v in values]


def _map_size(stage: Stage, times: list[float]) -> tuple[int, float]:
    steps = []
    for t in times:
        seen = stage.visibility(t)
        dx, dy = np.asarray(seen.dreflection_dx), np.asarray(seen.dreflection_dy)
        steps.append(np.sqrt(np.linalg.norm(np.cross(dx, dy), axis=1)))
    angles = np.concatenate(steps)
    angles = angles[angles > 0.0]
    if not len(angles):
        return SMALLEST_MAP, 2.0 / SMALLEST_MAP
    step = float(np.quantile(angles, FINEST_SHARE))
    # A cube face spans 2 at distance 1: in its middle a texel is 2/size radians wide.
    size = 2 ** math.ceil(math.log2(2.0 / step))
    return min(max(size, SMALLEST_MAP), LARGEST_MAP), step
