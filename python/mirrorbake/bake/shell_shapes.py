"""The geometry of a plan's shells, fitted to what reflected rays of a few views meet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.capture_place import capture_place
from mirrorbake.bake.probe import probe_points
from mirrorbake.errors import InputError
from mirrorbake.proxy import choose_proxy, proxy_to_attributes
from mirrorbake.scene.config_shells import DEFAULT_SHELLS
from mirrorbake.scene.plan import PlannedShell

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.bake.probe import Probe
    from mirrorbake.scene.stage import Stage

MIN_HITS = 100
"""Below this many reflected rays there is nothing to fit a shape to."""
PLANE_REACH = 100.0
"""Radius of the sky over a plane, in units of how far away the plane is met. It holds what the rays that look
away from the plane would meet, which is nothing of the plane's."""
FLAT = 0.02
"""Thickness of a flat thing over its distance from the object."""
SEEN = 1e-3
"""Share of a part's rays below which it has no map of a shell."""


def traced_hits(stage: Stage, probe: Probe, hidden: Sequence[int]) -> tuple[FloatArray, NDArray[np.int32]]:
    """Return what a probe's reflected rays meet: lengths (n,) in metres, and numbers of objects (n,).

    Nothing: infinite and -1, which lights have too. Hidden are objects by number, `ShellRule.ITSELF` the
    reflector.
    """
    distances = np.empty(len(probe.view), np.float32)
    objects = np.empty(len(probe.view), np.int32)
    for number, point in enumerate(probe_points(stage)):
        chosen = probe.view == number
        moved = stage.at(point)
        reflector = moved.built.reflector
        distances[chosen], objects[chosen] = moved.tracer.intersect_distance(
            np.ascontiguousarray(probe.position[chosen]),
            np.ascontiguousarray(probe.reflection[chosen]),
            sorted({reflector if i == _core.ShellRule.ITSELF else i for i in hidden}),
        )
    return distances, objects


def shell_distances(stage: Stage, probe: Probe, shell: int) -> FloatArray:
    """Return lengths (n,) of a probe's reflected rays, metres, up to what a shell holds of them.

    What the shells before it hold at any distance is left out, and so is the object, unless the shell holds
    it. 0 where the ray meets another shell's; the last one's rays may be infinite.
    """
    rules = stage.shell_rules
    itself = _core.ShellRule.ITSELF
    before = [i for rule in rules[:shell] if not rule.has_limits for i in rule.objects]
    distances, objects = traced_hits(
        stage, probe, before if itself in rules[shell].objects else [itself, *before]
    )
    held = np.zeros(len(distances), np.bool_)
    for k, rule in enumerate(rules[: shell + 1]):
        mine = rule.holds(objects, distances, stage.built.reflector).astype(np.bool_) & ~held
        if k == shell and shell + 1 < len(rules):
            return np.where(mine, distances, np.float32(0.0)).astype(np.float32)
        if k < shell:
            held |= mine
    return np.where(held, np.float32(0.0), distances).astype(np.float32)


def plane_through(hits: NDArray[np.floating], origin: Sequence[float]) -> tuple[_core.Proxy | None, float]:
    """Fit a plane to points by least squares.

    Parameters
    ----------
    hits
        (n, 3), metres.
    origin
        Of the map: seen from there, directions to the plane are its texels.

    Returns
    -------
    tuple
        A hemisphere, on whose floor the plane is and whose dome is far away, None if the plane passes through
        the origin; and the thickness of all but 5 % of the points over their mean distance.
    """
    points, eye = hits.astype(np.float64), np.array(origin, np.float64)
    middle = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - middle, full_matrices=False)
    normal = axes[2] if (eye - middle) @ axes[2] >= 0.0 else -axes[2]
    height = float((eye - middle) @ normal)
    away = np.linalg.norm(points - eye, axis=1)
    thickness = float(np.quantile(np.abs((points - middle) @ normal), 0.95)) / float(away.mean())
    if height <= 1e-3 * float(away.mean()):
        return None, thickness
    across = axes[0]
    own = np.stack([across, normal, np.cross(across, normal)]).astype(np.float32)
    foot = eye - height * normal
    radius = PLANE_REACH * float(away.max())
    return _core.Proxy.hemisphere(foot.tolist(), radius, list(origin), own), thickness


def choose_shape(
    probe: Probe, distances: FloatArray, used: NDArray[np.bool_], origin: Sequence[float]
) -> _core.ProxyChoice:
    """Compare all shapes for a map by what some of a probe's rays (n,) meet, at distances (n,) in metres."""
    return choose_proxy(
        probe.position[used], probe.reflection[used], distances[used], probe.view[used], origin
    )


def fit_shape(stage: Stage, probe: Probe, shell: int, wanted: str) -> _core.Proxy:
    """Fit the shape of a shell that is not the last.

    Raises
    ------
    InputError
        A finite shape is wanted for what no ray meets, or a plane for what lies around the object.
    """
    origin = capture_place(stage).position
    if wanted == "infinite":
        return _core.Proxy.infinite(origin)
    distances = shell_distances(stage, probe, shell)
    met = distances > 0.0
    name = stage.shell_rules[shell].name
    if int(met.sum()) < MIN_HITS:
        if wanted == "auto":
            return _core.Proxy.infinite(origin)
        raise InputError(
            f'shells.{name}: proxy = {wanted!r}: no reflected ray of a trial image meets it; expected "auto"'
        )
    hits = probe.position[met] + distances[met, None] * probe.reflection[met]
    if wanted in ("auto", "plane"):
        plane, thickness = plane_through(hits, origin)
        if plane is not None and (wanted == "plane" or thickness < FLAT):
            return plane
        if wanted == "plane":
            raise InputError(
                f"shells.{name}: proxy = 'plane': the plane through what it holds passes through the object"
            )
    choice = choose_shape(probe, distances, met, origin)
    if wanted == "auto":
        return choice.best.proxy
    return next(candidate.proxy for candidate in choice.candidates if candidate.name == wanted)


def planned_shells(
    stage: Stage, probe: Probe, local: Mapping[str, bool], last: _core.Proxy
) -> tuple[PlannedShell, ...]:
    """Return the shells of a plan.

    Parameters
    ----------
    stage
        Of the scene, with these shells.
    probe
        Traced with them.
    local
        For each part, whether it gets a map of what the object reflects of itself.
    last
        Shape of the last shell.
    """
    names, shells = stage.built.part_names, stage.config.shells or DEFAULT_SHELLS
    planned = []
    for number, shell in enumerate(shells[:-1]):
        itself = shell.is_itself
        alpha = probe.shells[number][:, 3]
        seen = {name: alpha[probe.part == part] for part, name in enumerate(names)}
        parts = [
            name
            for name in names
            if (local[name] if itself else len(seen[name]) and float(np.mean(seen[name])) > SEEN)
        ]
        proxy = None
        if not itself or shell.proxy not in ("auto", "ellipsoid"):
            proxy = proxy_to_attributes(fit_shape(stage, probe, number, shell.proxy))
        planned.append(PlannedShell(shell.name, proxy, tuple(parts)))
    return (*planned, PlannedShell(shells[-1].name, proxy_to_attributes(last), tuple(names)))
