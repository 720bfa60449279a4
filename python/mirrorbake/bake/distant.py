"""The geometry of the last shell, the distant maps: what reflected rays meet that no other shell holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.capture_place import capture_place
from mirrorbake.bake.local_shapes import MIN_HITS
from mirrorbake.bake.shell_shapes import choose_shape, shell_distances
from mirrorbake.errors import InputError
from mirrorbake.scene.plan import Decision

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mirrorbake.arrays import FloatArray
    from mirrorbake.bake.probe import Probe
    from mirrorbake.scene.stage import Stage

LARGEST_BOX = 1e5
"""Radii of the object; hits further away are as good as infinite and do not shape the walls of a box."""

_SET = "set in the scene"


def distant_decision(stage: Stage, probe: Probe) -> tuple[Decision, _core.Proxy]:
    """Decide `maps.distant`, by what a probe's reflected rays meet; return the shape, too.

    Raises
    ------
    InputError
        `maps.distant` names a finite shape, but the object sees no surroundings at a distance.
    """
    maps, built = stage.config.maps, stage.built
    place = capture_place(stage)
    origin = place.position
    moved = "" if place.inside is None else f"; seen from beside {place.inside!r}, which is in its middle"
    wanted: str | None = maps.distant
    if stage.config.shells is not None and stage.config.shells[-1].proxy != "auto":
        wanted = stage.config.shells[-1].proxy
    if wanted == "infinite":
        decision = Decision("maps.distant", None, wanted, False, _SET + moved, None)
        return decision, _core.Proxy.infinite(origin)
    distances = shell_distances(stage, probe, len(stage.shell_rules) - 1)
    usable = distances > 0.0
    radius = 0.5 * float(np.linalg.norm(np.ptp(built.positions, axis=0)))
    near = usable & (distances < LARGEST_BOX * radius)
    if int(near.sum()) < MIN_HITS:
        if wanted is not None:
            raise InputError(
                f"maps.distant = {wanted!r}: the object sees no surroundings at a distance to fit it to"
            )
        reason = f"the object sees no surroundings at a distance{moved}"
        return Decision("maps.distant", None, "infinite", True, reason, None), _core.Proxy.infinite(origin)
    choice = choose_shape(probe, distances, usable, origin)
    best = choice.best
    if wanted is not None:
        best = next(candidate for candidate in choice.candidates if candidate.name == wanted)
    proxy = best.proxy
    if best.name == "box" and maps.box != "angle":
        hits = probe.position[near] + distances[near, None] * probe.reflection[near]
        proxy = _fit_box(maps.box, hits, origin, float(built.positions[:, 1].min()))
    if wanted is not None:
        return Decision("maps.distant", None, wanted, False, _SET + moved, None), proxy
    reason = choice.reason.removeprefix(f"{best.name}: ").removesuffix(".") + moved
    return Decision("maps.distant", None, best.name, True, reason, best.off_view_error), proxy


def _fit_box(how: str, hits: FloatArray, origin: Sequence[float], bottom: float) -> _core.Proxy:
    if how == "mean_distance":
        return _core.fit_box_mean_distance(hits, origin, bottom)
    return _core.fit_box_robust(hits, origin)
