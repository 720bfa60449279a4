"""How large the maps of every part and shell have to be: what neighbouring pixels read apart."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.probe import probe_points
from mirrorbake.bake.shell_shapes import held_distances
from mirrorbake.pem.shells import moved_proxy
from mirrorbake.proxy import hull_triangles, proxy_from_attributes
from mirrorbake.scene.config_axes import arranged
from mirrorbake.scene.config_shells import DEFAULT_SHELLS
from mirrorbake.scene.plan import Decision
from mirrorbake.scene.pose import AT_REST
from mirrorbake.scene.reflectance import materials_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.plan import PlannedShell
    from mirrorbake.scene.stage import Stage

    DoubleArray = NDArray[np.float64]

SMALLEST_MAP, LARGEST_MAP = 16, 1024
"""A scene file may set other sizes."""
TEXELS_PER_LOBE = 4
"""Texels along a rough lobe's width at half of its height: more show nothing new."""
FEWEST_STEPS = 16
"""Pixels of the trial images below which a map is as small as can be."""


def map_sizes(
    stage: Stage, shells: Sequence[PlannedShell], *, hull_split: bool, shared: bool
) -> list[Decision]:
    """Decide `maps.size`, for every map.

    Parameters
    ----------
    stage
        In the parts that were decided.
    shells
        Front to back, with their geometry.
    hull_split
        Whether polygons on the convex hull read no map of the object itself.
    shared
        Whether all parts read one map of the last shell.
    """
    wanted = stage.config.maps.size
    if wanted is not None:
        return [Decision("maps.size", None, wanted, False, "set in the scene", None)]
    steps = _lookup_steps(stage, shells, hull_split=hull_split)
    names = stage.built.part_names
    widths = [_lobe_width(stage, part) for part in range(len(names))]
    decisions = []
    for shell in shells:
        if shared and shell is shells[-1]:
            every = np.concatenate([steps[shell.name, name] for name in shell.proxies])
            decisions.append(_size(stage, every, min(widths), None, shell.name))
            continue
        decisions += [
            _size(stage, steps[shell.name, name], widths[names.index(name)], name, shell.name)
            for name in shell.proxies
        ]
    return decisions


def _size(stage: Stage, steps: DoubleArray, width: float, part: str | None, shell: str) -> Decision:
    """Return the decision on one map, of the angles between what its pixels read, and of the lobe's width."""
    share = stage.config.auto.finer_share

    def decided(size: int, reason: str, measured: float | None) -> Decision:
        return Decision("maps.size", part, size, True, reason, measured, shell)

    if not len(steps):
        return decided(SMALLEST_MAP, "no view reads it", None)
    if len(steps) < FEWEST_STEPS:
        return decided(SMALLEST_MAP, f"{len(steps)} pixels of the trial views read it", None)
    step = float(np.quantile(steps, share))
    reason = f"all but {share:.0%} of the pixels read places at least {math.degrees(step):.2g} degrees apart"
    if width / TEXELS_PER_LOBE > step:
        step = width / TEXELS_PER_LOBE
        reason = f"the lobe is {math.degrees(width):.2g} degrees wide and blurs what is finer"
    # A cube face spans 2 at distance 1: in its middle a texel is 2/size radians wide.
    wanted = 2 ** math.ceil(math.log2(2.0 / step))
    size = min(max(wanted, SMALLEST_MAP), LARGEST_MAP)
    reason += f"; a texel is {math.degrees(2.0 / size):.2g}"
    if wanted > LARGEST_MAP:
        reason += f", since {LARGEST_MAP} is the most that is chosen automatically"
    return decided(size, reason, step)


def _lookup_steps(
    stage: Stage, shells: Sequence[PlannedShell], *, hull_split: bool
) -> dict[tuple[str, str], DoubleArray]:
    """Angles between the places of maps that neighbouring pixels read, radians, by shell and part.

    Of pixels whose ray meets what the shell holds, and of the last shell of all pixels.
    """
    options = _core.TraceOptions(samples_per_pixel=1, seed=stage.config.trace.seed)
    built, sections = stage.built, stage.config.shells or DEFAULT_SHELLS
    found: dict[tuple[str, str], list[DoubleArray]] = {
        (shell.name, name): [np.zeros(0)] for shell in shells for name in shell.proxies
    }
    on_hull = hull_triangles(built.positions, built.triangles)
    for point in probe_points(stage):
        moved = stage.at(point)
        camera = moved.built.cameras.camera(point)
        seen = moved.tracer.trace_visibility(camera, moved.built.reflector, options)
        pose = arranged(stage.config, stage.space.scene_coordinates(point)).pose
        position, part = seen.position + np.array(seen.origin), np.asarray(seen.part)
        for number, shell in enumerate(shells):
            reads = np.ones(len(part), np.bool_)
            if shell is not shells[-1]:
                reflection = np.asarray(seen.reflection)
                reads = held_distances(moved, position.astype(np.float32), reflection, number) > 0.0
            if hull_split and sections[number].is_itself:
                reads &= ~on_hull[np.asarray(seen.triangle)]
            for name, attributes in shell.proxies.items():
                # A sample is read where the object has moved to: its shape moves with it.
                here = pose if sections[number].is_itself else AT_REST
                mine = np.flatnonzero(reads & (part == built.part_names.index(name)))
                angles = _steps(proxy_from_attributes(moved_proxy(attributes, here)), seen, position, mine)
                found[shell.name, name].append(angles[angles > 0.0])
    return {key: np.concatenate(values) for key, values in found.items()}


def _steps(
    proxy: _core.Proxy, seen: _core.SurfaceSamples, position: DoubleArray, mine: NDArray[np.intp]
) -> DoubleArray:
    """Angles between the places of a map that some samples and their neighbours in the image read."""
    # Differentials are extrapolated over a small part of a pixel, where lookups are close to linear.
    part = 1.0 / 16.0
    place, reflection = position[mine], np.asarray(seen.reflection, float)[mine]

    def read(dp: FloatArray, dr: FloatArray) -> DoubleArray:
        vectors = proxy.lookup_float64(
            place + part * np.asarray(dp)[mine], reflection + part * np.asarray(dr)[mine]
        )
        unit: DoubleArray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
        return unit

    still = np.zeros_like(np.asarray(seen.dposition_dx))
    middle = read(still, still)
    right = read(seen.dposition_dx, seen.dreflection_dx)
    below = read(seen.dposition_dy, seen.dreflection_dy)
    area = np.linalg.norm(np.cross(right - middle, below - middle), axis=1)
    steps: DoubleArray = np.sqrt(area) / part
    return steps


def _lobe_width(stage: Stage, part: int) -> float:
    """Full width at half of its height, radians, of a part's lobe; 0: a mirror, or not known."""
    material = materials_of(stage)[part]
    if not material.specular or material.roughness_texture.texture >= 0:
        return 0.0
    if material.lobe == "phong":
        return 2.0 * math.acos(0.5 ** (1.0 / material.exponent))
    if material.lobe == "ggx":
        # The density of facets goes with (1 + tan²/α²)⁻², which is half at tan² = (√2 − 1)α²; reflection
        # doubles angles.
        return 4.0 * math.atan(material.roughness * math.sqrt(math.sqrt(2.0) - 1.0))
    return 0.0
