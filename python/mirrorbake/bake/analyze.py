"""Decides what a bake does by a few small images: "model only what a scene requires" (spec T6)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from mirrorbake.bake.count_parts import parts_decision
from mirrorbake.bake.distant import distant_decision
from mirrorbake.bake.light_storage import light_storage
from mirrorbake.bake.map_sizes import map_sizes
from mirrorbake.bake.probe import Probe, displayed_noise, relative_change
from mirrorbake.bake.quality import QUALITIES, quality_decisions
from mirrorbake.bake.shell_shapes import planned_shells
from mirrorbake.bake.spacing import with_spacing
from mirrorbake.bake.split_shells import shells_decision
from mirrorbake.bake.trial import lead_advice
from mirrorbake.bake.worth import advice_of, shared_distant
from mirrorbake.proxy import proxy_to_attributes
from mirrorbake.scene.config_shells import DEFAULT_SHELLS, ITSELF
from mirrorbake.scene.plan import Decision, Plan

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from mirrorbake import _core
    from mirrorbake.scene.config import Parts
    from mirrorbake.scene.stage import Stage


MAX_DEPTH = 16
"""What fewer bounces are compared with."""

FIRST_SAMPLES = 16
MOST_SAMPLES = 256
"""Per pixel; a scene file may set more."""
MOST_FIRST_SAMPLES = 64
"""Where `trace.noise` gives noisy pixels more."""
LOBE_NOISE = 0.03
"""Of a displayed pixel of a rough reflector, that first samples may leave. Maps of a rough lobe are small and
meet its light well: what is left is the noise of the views that get no more samples, the static set's."""

_SET = "set in the scene"


def analyze(stage: Stage) -> Plan:
    """Decide what a bake of a scene does. What the scene file sets is obeyed, and only "auto" is measured.

    Parameters
    ----------
    stage
        The scene.

    Raises
    ------
    InputError
        `maps.distant` names a finite shape, but the object sees no surroundings at a distance.
    """
    trace = stage.config.trace
    probe = Probe.of(stage, MAX_DEPTH if trace.depth is None else trace.depth)
    depth = _depth(stage, probe)
    diffuse = _diffuse(stage, probe)
    edge, lightmap, stage = light_storage(stage, has_diffuse=bool(diffuse.value))
    if edge.automatic and edge.value:
        probe = Probe.of(stage, cast("int", depth.value))
    parts, labels = parts_decision(stage, probe)
    stage = stage.in_parts(cast("Parts", parts.value))
    if depth.automatic and depth.value != MAX_DEPTH:
        probe = Probe.of(stage, cast("int", depth.value))
    elif labels is not None:
        probe = replace(probe, part=labels[probe.triangle].astype(np.int64))
    _, single = distant_decision(stage, probe)
    shells, found = shells_decision(stage, probe, cast("int", depth.value), single)
    if found is not None:
        stage = replace(stage, config=stage.config.model_copy(update={"shells": found}))
        probe = Probe.of(stage, cast("int", depth.value))
    distant, proxy = distant_decision(stage, probe)
    on_hull = stage.built.on_hull[probe.triangle]
    local = _local(stage, probe, on_hull)
    samples = _samples(stage, cast("int", depth.value))
    hull_split = _hull_split(stage, on_hull, any_local=any(decision.value for decision in local))
    shared = shared_distant(stage, probe, proxy)
    has_local = {name: _is_local(local, name) for name in stage.built.part_names}
    planned, geometry = planned_shells(stage, probe, has_local, proxy)
    sizes = map_sizes(stage, planned, hull_split=bool(hull_split.value), shared=bool(shared.value))
    first = [
        edge,
        parts,
        depth,
        samples,
        diffuse,
        lightmap,
        shells,
        *local,
        hull_split,
        *geometry,
        distant,
        shared,
        *sizes,
    ]
    of_last = (size.value for size in sizes if size.shell in (None, planned[-1].name))
    advice = advice_of(stage, probe, single, max(cast("int", size) for size in of_last))

    def plan_of(spaced: Stage) -> Plan:
        last = quality_decisions(spaced, cast("int", samples.value))
        return Plan((*first, *last), proxy_to_attributes(proxy), planned, tuple(advice))

    stage, plan = with_spacing(stage, plan_of)
    lead = lead_advice(stage, plan)
    return plan if lead is None else replace(plan, advice=(lead, *plan.advice))


def _is_local(local: Sequence[Decision], part: str) -> bool:
    return any(bool(decision.value) for decision in local if decision.part in (None, part))


def _depth(stage: Stage, full: Probe) -> Decision:
    config = stage.config
    if config.trace.depth is not None:
        return Decision("trace.depth", None, config.trace.depth, False, _SET, None)
    # The change shrinks with every bounce that is followed: bisection finds where it is small enough.
    changes = {MAX_DEPTH: 0.0}
    too_few, depth = -1, MAX_DEPTH
    while depth - too_few > 1:
        middle = (too_few + depth) // 2
        changes[middle] = relative_change(full.beauty, Probe.of(stage, middle).beauty, full.pixel)
        if changes[middle] <= config.auto.tolerance:
            depth = middle
        else:
            too_few = middle
    fewer = f"one fewer by {changes[depth - 1]:.2%}" if depth else ""
    if depth == MAX_DEPTH:
        reason = f"the most that is tried; {fewer}"
    else:
        reason = f"ending after {_bounces(depth)} changes the picture by {changes[depth]:.2%}"
        reason += f", {fewer}" if fewer else ""
    return Decision("trace.depth", None, depth, True, reason, changes[depth])


def _bounces(depth: int) -> str:
    return {0: "the first reflection", 1: "1 further bounce"}.get(depth, f"{depth} further bounces")


def _samples(stage: Stage, depth: int) -> Decision:
    config = stage.config
    if config.trace.samples is not None:
        return Decision("trace.samples", None, config.trace.samples, False, _SET, None)
    noise = displayed_noise(Probe.of(stage, depth, FIRST_SAMPLES))
    reason = f"{FIRST_SAMPLES} leave a noise of {noise:.3f} of the display's range"
    wanted = QUALITIES[config.auto.quality].noise if config.trace.noise is None else config.trace.noise
    adaptive = wanted > 0.0 and config.infer.fit == "display"
    limit, most = config.auto.noise, MOST_SAMPLES
    if adaptive:
        rough = any(material.specular and material.lobe != "mirror" for material in _materials(stage))
        limit, most = LOBE_NOISE if rough else math.inf, MOST_FIRST_SAMPLES
    samples = FIRST_SAMPLES
    if noise > limit:
        samples = min(samples * 2 ** math.ceil(math.log2((noise / limit) ** 2)), most)
        reason += f", {samples} of {noise * math.sqrt(FIRST_SAMPLES / samples):.3f}"
    if adaptive:
        reason += "; noisy pixels get more, by trace.noise"
    return Decision("trace.samples", None, samples, True, reason, noise)


def _diffuse(stage: Stage, probe: Probe) -> Decision:
    config = stage.config
    if config.layers.diffuse is not None:
        return Decision("layers.diffuse", None, config.layers.diffuse, False, _SET, None)
    if not any(any(material.albedo) or any(material.emission) for material in _materials(stage)):
        reason = "the material is black under its mirror"
        return Decision("layers.diffuse", None, False, True, reason, 0.0)
    change = relative_change(probe.beauty, probe.beauty - probe.diffuse, probe.pixel)
    reason = f"leaving it out changes the picture by {change:.2%}"
    return Decision("layers.diffuse", None, change > config.auto.tolerance, True, reason, change)


def _local(stage: Stage, probe: Probe, on_hull: NDArray[np.bool_]) -> list[Decision]:
    config, built = stage.config, stage.built
    if config.layers.local is not None:
        return [Decision("layers.local", None, config.layers.local, False, _SET, None)]
    sections = config.shells or DEFAULT_SHELLS
    mine = next((k for k, shell in enumerate(sections) if shell.objects == (ITSELF,)), None)
    if mine is None:
        return [Decision("layers.local", None, False, True, "no shell holds the object alone", None)]
    without = probe.diffuse + probe.fresnel * probe.without(mine)
    decisions = []
    for number, name in enumerate(built.part_names):
        chosen = probe.part == number
        inside = ~on_hull[chosen]
        if not chosen.any():
            value, change, reason = False, 0.0, "no view sees it"
        elif not inside.any():
            value, change, reason = False, 0.0, "all that the views see of it lies on the convex hull"
        else:
            change = relative_change(probe.beauty[chosen], without[chosen], probe.pixel[chosen])
            value = change > config.auto.tolerance
            share = float(np.mean(probe.shells[mine][chosen, 3]))
            reason = (
                f"what the object reflects of itself changes the picture by {change:.2%}: {share:.1%} of the "
                f"rays meet it again; {float(inside.mean()):.0%} of what is seen is off the convex hull"
            )
        decisions.append(Decision("layers.local", name, value, True, reason, change))
    return decisions


def _hull_split(stage: Stage, on_hull: NDArray[np.bool_], *, any_local: bool) -> Decision:
    wanted = stage.config.layers.hull_split
    if wanted is not None:
        return Decision("layers.hull_split", None, wanted, False, _SET, None)
    if not any_local:
        return Decision("layers.hull_split", None, False, True, "there is no local layer", None)
    share = float(np.mean(on_hull))
    reason = f"{share:.0%} of what the views see lies on the convex hull and cannot reflect the object"
    return Decision("layers.hull_split", None, share > 0.0, True, reason, share)


def _materials(stage: Stage) -> list[_core.Material]:
    """Of the reflector's parts."""
    scene = stage.built.scene
    return [scene.material(index) for index in scene.object_part_materials(stage.built.reflector)]
