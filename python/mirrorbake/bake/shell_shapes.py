"""The geometry of a plan's shells, fitted to what reflected rays of a few views meet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.capture_place import capture_place
from mirrorbake.bake.local_shapes import MIN_HITS, local_shape
from mirrorbake.bake.probe import probe_points
from mirrorbake.errors import InputError
from mirrorbake.proxy import choose_proxy, proxy_to_attributes
from mirrorbake.scene.config_shells import DEFAULT_SHELLS
from mirrorbake.scene.plan import Decision, PlannedShell

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.bake.probe import Probe
    from mirrorbake.scene.stage import Stage

PLANE_REACH = 100.0
"""Radius of the sky over a plane, in units of how far away the plane is met. It holds what the rays that look
away from the plane would meet, which is nothing of the plane's."""
FLAT = 0.02
"""Thickness of a flat thing over its distance from the object."""
SEEN = 1e-3
"""Share of a part's rays below which it has no map of a shell."""

_SET = "set in the scene"


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
    distances = np.empty(len(probe.view), np.float32)
    for number, point in enumerate(probe_points(stage)):
        chosen = probe.view == number
        distances[chosen] = held_distances(
            stage.at(point), probe.position[chosen], probe.reflection[chosen], shell
        )
    return distances


def held_distances(stage: Stage, position: FloatArray, reflection: FloatArray, shell: int) -> FloatArray:
    """Return lengths (n,) of reflected rays from places (n, 3) of a stage, as `shell_distances` does."""
    rules, reflector = stage.shell_rules, stage.built.reflector
    itself = _core.ShellRule.ITSELF
    before = [i for rule in rules[:shell] if not rule.has_limits for i in rule.objects]
    hidden = before if itself in rules[shell].objects else [itself, *before]
    distances, objects = stage.tracer.intersect_distance(
        np.ascontiguousarray(position),
        np.ascontiguousarray(reflection),
        sorted({reflector if i == itself else i for i in hidden}),
    )
    held = np.zeros(len(distances), np.bool_)
    for k, rule in enumerate(rules[: shell + 1]):
        mine = rule.holds(objects, distances, reflector).astype(np.bool_) & ~held
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


def fit_shape(stage: Stage, probe: Probe, shell: int, wanted: str) -> tuple[_core.Proxy, Decision]:
    """Fit the shape of a shell that is not the last, and does not hold the object alone.

    Raises
    ------
    InputError
        A finite shape is wanted for what no ray meets, or a plane for what lies around the object.
    """
    origin, name = capture_place(stage).position, stage.shell_rules[shell].name

    def decided(value: str, reason: str, measured: float | None = None) -> Decision:
        return Decision("shells.proxy", None, value, wanted == "auto", reason, measured, name)

    if wanted == "infinite":
        return _core.Proxy.infinite(origin), decided(wanted, _SET)
    distances = shell_distances(stage, probe, shell)
    met = distances > 0.0
    if int(met.sum()) < MIN_HITS:
        if wanted == "auto":
            reason = f"{int(met.sum())} rays of the trial images meet what it holds, too few for a fit"
            return _core.Proxy.infinite(origin), decided("infinite", reason)
        raise InputError(
            f'shells.{name}: proxy = {wanted!r}: no reflected ray of a trial image meets it; expected "auto"'
        )
    hits = probe.position[met] + distances[met, None] * probe.reflection[met]
    if wanted in ("auto", "plane"):
        plane, thickness = plane_through(hits, origin)
        if plane is not None and wanted == "plane":
            return plane, decided(wanted, _SET)
        if plane is not None and thickness < FLAT:
            reason = f"what it holds is {thickness:.1%} as thick as it is far"
            return plane, decided("plane", reason, thickness)
        if wanted == "plane":
            raise InputError(
                f"shells.{name}: proxy = 'plane': the plane through what it holds passes through the object"
            )
    choice = choose_shape(probe, distances, met, origin)
    if wanted == "auto":
        best = choice.best
        reason = choice.reason.removeprefix(f"{best.name}: ").removesuffix(".")
        return best.proxy, decided(best.name, reason, best.off_view_error)
    fitted = next(candidate.proxy for candidate in choice.candidates if candidate.name == wanted)
    return fitted, decided(wanted, _SET)


def planned_shells(
    stage: Stage, probe: Probe, local: Mapping[str, bool], last: _core.Proxy
) -> tuple[tuple[PlannedShell, ...], list[Decision]]:
    """Return the shells of a plan, and the decisions on the geometry of all but the last.

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
    planned, decisions = [], list[Decision]()
    for number, shell in enumerate(shells[:-1]):
        alpha = probe.shells[number][:, 3]
        seen = {name: alpha[probe.part == part] for part, name in enumerate(names)}
        parts = [
            name
            for name in names
            if (local[name] if shell.is_itself else len(seen[name]) and float(np.mean(seen[name])) > SEEN)
        ]
        proxies: dict[str, _core.Proxy] = {}
        if shell.is_itself and shell.proxy != "plane" and parts:
            distances = shell_distances(stage, probe, number)
            for name in parts:
                proxies[name], decision = local_shape(
                    stage, probe, distances, number, names.index(name), shell.proxy
                )
                decisions.append(decision)
        elif parts:
            proxy, decision = fit_shape(stage, probe, number, shell.proxy)
            proxies = dict.fromkeys(parts, proxy)
            decisions.append(decision)
        planned.append(_planned(shell.name, proxies))
    return (*planned, _planned(shells[-1].name, dict.fromkeys(names, last))), decisions


def _planned(name: str, proxies: Mapping[str, _core.Proxy]) -> PlannedShell:
    return PlannedShell(name, {part: proxy_to_attributes(proxy) for part, proxy in proxies.items()})
