"""What a scene would do without: a map for every part, a PEM at all, several lookups, exact Fresnel."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.probe import Probe, probe_points, relative_change
from mirrorbake.envmap import EnvMap
from mirrorbake.proxy import proxy_to_attributes
from mirrorbake.scene.plan import Decision
from mirrorbake.scene.reflectance import is_plain, materials_of, reflectance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.scene.stage import Stage

    DoubleArray = NDArray[np.float64]

CELL_SIZE = 16
"""Along a side of a face: places of a map in which parts are compared."""
FEWEST_SAMPLES = 3
"""Of each of two parts in a place, from which they can be compared."""
CAPTURE_SIZE = 128
"""Texels along a side of the captured map that is tried, at most."""
CAPTURE_SAMPLES = 4


def shared_distant(stage: Stage, probe: Probe, proxy: _core.Proxy) -> Decision:
    """Decide whether all parts read one distant map: if they want the same of every place of it."""
    key = "maps.shared_distant"
    wanted = stage.config.maps.shared_distant
    if wanted is not None:
        return Decision(key, None, wanted, False, "set in the scene", None)
    if len(stage.built.part_names) < 2:
        return Decision(key, None, False, True, "there is one part", None)
    change, share = _disagreement(probe, proxy)
    if share == 0.0:
        return Decision(key, None, False, True, "no two parts look the same way", None)
    reason = (
        f"where two parts look the same way, {share:.0%} of the places, what they see differs by {change:.1%}"
    )
    return Decision(key, None, change <= stage.config.auto.tolerance, True, reason, change)


def _disagreement(probe: Probe, proxy: _core.Proxy) -> tuple[float, float]:
    """Relative RMS difference of what parts see in the same places, and the share of those places."""
    if not len(probe.view):
        return 0.0, 0.0
    lookups = proxy.lookup(np.ascontiguousarray(probe.position), np.ascontiguousarray(probe.reflection))
    axis = np.argmax(np.abs(lookups), axis=1)
    major = np.take_along_axis(lookups, axis[:, None], axis=1)
    others = np.stack([np.take_along_axis(lookups, (axis[:, None] + k) % 3, axis=1)[:, 0] for k in (1, 2)])
    place = np.clip((others / np.abs(major[:, 0]) + 1.0) * (CELL_SIZE / 2), 0, CELL_SIZE - 1).astype(np.int64)
    cell = (2 * axis + (major[:, 0] < 0)) * CELL_SIZE**2 + place[0] * CELL_SIZE + place[1]
    cells = 6 * CELL_SIZE**2
    # A view has maps of its own.
    cell = cell + cells * probe.view.astype(np.int64)
    parts = int(probe.part.max()) + 1
    key = cell * parts + probe.part
    size = cells * (int(probe.view.max()) + 1) * parts
    count = np.bincount(key, minlength=size).reshape(-1, parts)
    luminance = probe.shells[-1][:, :3] @ np.array([0.2126, 0.7152, 0.0722])
    mean = np.bincount(key, luminance, size).reshape(-1, parts) / np.maximum(count, 1)
    square = np.bincount(key, luminance**2, size).reshape(-1, parts) / np.maximum(count, 1)
    # Of the mean of some samples.
    variance = (square - mean**2) / np.maximum(count - 1, 1)
    known = count >= FEWEST_SAMPLES
    several = known.sum(axis=1) > 1
    if not several.any():
        return 0.0, 0.0
    weight = known[several].astype(float)
    centre = np.sum(weight * mean[several], axis=1, keepdims=True) / weight.sum(axis=1, keepdims=True)
    difference = np.sum(weight * (mean[several] - centre) ** 2) - np.sum(weight * variance[several]) / 2.0
    scale = np.sum(weight * mean[several] ** 2)
    share = float(several.sum() / np.count_nonzero(known.any(axis=1)))
    return float(np.sqrt(max(difference, 0.0) / scale)) if scale > 0.0 else 0.0, share


def advice_of(stage: Stage, probe: Probe, proxy: _core.Proxy, map_size: int) -> list[str]:
    """Measure what is the user's to choose, in sentences.

    Parameters
    ----------
    stage
        The scene.
    probe
        Of the depth that was decided.
    proxy
        Of the distant map.
    map_size
        Texels along a side of its faces.
    """
    if not len(probe.view):
        return []
    found = [
        _worth(stage, probe, proxy, map_size),
        _one_lookup(stage, proxy, map_size),
        _schlick(stage, probe),
    ]
    return [words for words in found if words is not None]


def _worth(stage: Stage, probe: Probe, proxy: _core.Proxy, map_size: int) -> str | None:
    """Whether a map that was merely captured does as well as a PEM, of mirrors that stay where they are."""
    if stage.config.views.kind == "none" or stage.space.changes_scene:
        return None
    if any(material.specular and material.lobe != "mirror" for material in materials_of(stage)):
        return None
    options = _core.TraceOptions(samples_per_pixel=CAPTURE_SAMPLES, seed=stage.config.trace.seed)
    size = min(map_size, CAPTURE_SIZE)
    captured = np.asarray(
        stage.tracer.capture_cube(proxy.origin, size, [stage.built.reflector], options), np.float32
    )
    lookups = proxy.lookup(np.ascontiguousarray(probe.position), np.ascontiguousarray(probe.reflection))
    light = EnvMap.from_array(captured, "cube").sample(lookups).astype(np.float64)
    change = relative_change(probe.beauty, probe.diffuse + probe.fresnel * light, probe.pixel)
    shape = proxy_name(proxy)
    if change <= stage.config.auto.tolerance:
        return (
            f"a PEM is not worth it: one captured map {shape} changes the picture by {change:.2%} alone, "
            'within auto.tolerance; views.kind = "none" bakes one set of maps'
        )
    return (
        f"a PEM is worth its bytes: one captured map {shape} would change the picture by {change:.1%} "
        f"(auto.tolerance is {stage.config.auto.tolerance:.1%})"
    )


def proxy_name(proxy: _core.Proxy) -> str:
    """Words for where a map lies."""
    shape = proxy_to_attributes(proxy)["shape"]
    return "at infinity" if shape == "infinite" else f"on the {shape}"


def _one_lookup(stage: Stage, proxy: _core.Proxy, map_size: int) -> str | None:
    """How often a single lookup misses what the run time's lookups of a pixel would read."""
    infer = stage.config.infer
    if infer.fit != "display" or infer.run_time == "Web1":
        return None
    web = _core.run_time_model("Web").places
    places = np.array([(0.5, 0.5), *web])
    options = _core.TraceOptions(samples_per_pixel=1, seed=stage.config.trace.seed)
    off = []
    for point in probe_points(stage):
        moved = stage.at(point)
        seen = moved.tracer.trace_visibility(
            moved.built.cameras.camera(point), moved.built.reflector, options, places.tolist()
        )
        position = seen.position + np.array(seen.origin)
        lookups = proxy.lookup_float64(position, np.asarray(seen.reflection, float))
        pixel = np.asarray(seen.pixel)
        first, count = np.unique(pixel, return_index=True, return_counts=True)[1:]
        whole = first[count == len(places)]
        if not len(whole):
            continue
        middle = lookups[whole]
        right, below = (
            proxy.lookup_float64(
                position[whole] + step * np.asarray(dp)[whole],
                np.asarray(seen.reflection, float)[whole] + step * np.asarray(dr)[whole],
            )
            for step, dp, dr in (
                (0.25, seen.dposition_dx, seen.dreflection_dx),
                (0.25, seen.dposition_dy, seen.dreflection_dy),
            )
        )
        worst = np.zeros(len(whole))
        for number, (x, y) in enumerate(places[1:], start=1):
            straight = middle + 4.0 * ((x - 0.5) * (right - middle) + (y - 0.5) * (below - middle))
            there = lookups[whole + number]
            angle = np.arctan2(
                np.linalg.norm(np.cross(straight, there), axis=1), np.sum(straight * there, axis=1)
            )
            worst = np.maximum(worst, angle)
        off.append(worst)
    if not off:
        return None
    texel = 2.0 / map_size
    share = float(np.mean(np.concatenate(off) > texel))
    if share > stage.config.auto.finer_share:
        return (
            f"infer.run_time = {infer.run_time!r}: a single lookup would miss by more than a texel "
            f"({math.degrees(texel):.2g} degrees) what {share:.0%} of the pixels reflect"
        ).replace("'", '"')
    return (
        f"one lookup a pixel follows the reflection to within a texel ({math.degrees(texel):.2g} degrees) "
        f'but in {share:.1%} of the pixels: infer.run_time = "Web1" draws four times as fast, edges rougher'
    )


def _schlick(stage: Stage, probe: Probe) -> str | None:
    """Whether Schlick's formula does for a reflectance of another model."""
    materials = materials_of(stage)
    models = {material.fresnel.model for material in materials if material.specular}
    if not models - {"constant", "schlick"} or not is_plain(stage):
        return None
    eyes = [np.array(stage.at(p).built.cameras.camera(p).eye) for p in probe_points(stage)]
    towards = np.array(eyes)[probe.view] - probe.position
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    # r = 2(n·v)n - v, so that |r + v| = 2 n·v.
    cosines = np.clip(0.5 * np.linalg.norm(towards + probe.reflection, axis=1), 0.0, 1.0).astype(np.float32)
    simple, exact = np.zeros_like(probe.fresnel), np.zeros_like(probe.fresnel)
    for number, material in enumerate(materials):
        here = probe.part == number
        simple[here] = reflectance(material.fresnel, "Schlick", cosines[here])
        exact[here] = reflectance(material.fresnel, "exact", cosines[here])
    change = relative_change(probe.beauty, probe.beauty + (simple - exact) * probe.incident, probe.pixel)
    names = " or ".join(sorted(models - {"constant", "schlick"}))
    if change <= stage.config.auto.tolerance:
        return f"Schlick's formula does for the {names}: it changes the picture by {change:.2%}"
    return f"the {names} needs its own equations: Schlick's formula would change the picture by {change:.1%}"
