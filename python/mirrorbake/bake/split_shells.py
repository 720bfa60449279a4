"""Which shells a reflector gets where the scene file names none: by what reflected rays meet, and where."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.capture_place import capture_place
from mirrorbake.bake.captured import captured_shells
from mirrorbake.bake.distant import distant_decision
from mirrorbake.bake.local_shapes import MIN_HITS
from mirrorbake.bake.probe import pixel_means, probe_points
from mirrorbake.bake.shell_shapes import (
    FLAT,
    fit_shape,
    plane_through,
    traced_hits,
)
from mirrorbake.envmap import EnvMap
from mirrorbake.scene.config_shells import DEFAULT_SHELLS, ITSELF, Shells, ShellSection
from mirrorbake.scene.plan import Decision
from mirrorbake.tone import srgb_encoded

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.bake.probe import Probe
    from mirrorbake.scene.stage import Stage

    DoubleArray = NDArray[np.float64]

SEEN = 1e-3
"""Share of the reflected rays below which a thing does not tell how far away things are."""
HELD = 0.01
"""Share of them that a shell has to hold."""
GAP = 1.5
"""Things are near if the next ones are so many times as far away as the furthest of them."""
WORTH = 2.5
"""n times as many shells have to divide the mean square error of the captured picture by n to this power."""
TOLERANCE = 0.01
"""Root mean square error, of the display's range, that needs no further shells."""
CAPTURE_SIZE = 64
"""Texels along a side of the captured maps' faces."""
CAPTURE_SAMPLES = 4


@dataclass(frozen=True)
class _Thing:
    """What reflected rays meet of the objects of one name."""

    name: str
    share: float
    """Of all reflected rays."""
    distance: float
    """Median, metres."""
    hits: DoubleArray
    """Places (n, 3), metres."""


@dataclass(frozen=True)
class _Choice:
    """A list of shells with what it stands for."""

    shells: Shells
    words: tuple[str, ...]
    """What each shell between the first and the last holds."""


def shells_decision(
    stage: Stage, probe: Probe, depth: int, single: _core.Proxy
) -> tuple[Decision, Shells | None]:
    """Decide `shells`.

    What is flat and near, such as a ground, and what stands near, before a gap in the distances, may have
    shells of their own. Which do is found by the picture (`captured_error`). A longer list is taken if it is
    worth its maps.

    Parameters
    ----------
    stage
        In the parts that were decided.
    probe
        Traced with the stage's shells, and so many specular bounces.
    depth
        Specular bounces after the first.
    single
        Shape of the distant map, if all that is not the object is on one.

    Returns
    -------
    tuple
        The decision, and the shells if they are others than those of [PEM] §4 and not the scene's own.
    """
    config = stage.config
    if config.shells is not None:
        return Decision("shells", None, _tables(config.shells), False, "set in the scene", None), None
    reason = "what the object reflects of itself, and the rest"
    keys = {"layers.local": config.layers.local, "maps.distant": config.maps.distant}
    kept = [key for key, value in keys.items() if value is not None]
    if config.infer.fit == "layers":
        kept.append('infer.fit = "layers"')
    if kept:
        reason += f": {kept[0]} is about these two"
        return Decision("shells", None, _tables(DEFAULT_SHELLS), True, reason, None), None
    choices = list(_choices(stage, probe))
    if not choices:
        return Decision("shells", None, _tables(DEFAULT_SHELLS), True, reason, None), None
    best, left = _Choice(DEFAULT_SHELLS, ()), captured_error(stage, probe, DEFAULT_SHELLS, depth, single)
    without = least = left
    for choice in sorted(choices, key=lambda choice: len(choice.shells)):
        if left <= TOLERANCE:
            break
        error = captured_error(stage, probe, choice.shells, depth)
        least = min(least, error)
        if error**2 <= left**2 * (len(best.shells) / len(choice.shells)) ** WORTH:
            best, left = choice, error
    missed = f"read where these shapes have it, the picture is off by {left:.3f} of the display's range"
    if best.words:
        words = f"{'; '.join(best.words)}: {missed}, by {without:.3f} without"
        return Decision("shells", None, _tables(best.shells), True, words, left), best.shells
    if least < without:
        missed += f", by {least:.3f} with more of them, which is not worth their maps"
    return Decision("shells", None, _tables(best.shells), True, f"{reason}: {missed}", left), None


def _tables(shells: Shells) -> list[dict[str, object]]:
    return [
        {key: list(value) if isinstance(value, tuple) else value for key, value in table.items()}
        for table in (shell.model_dump(exclude_defaults=True) for shell in shells)
    ]


def _choices(stage: Stage, probe: Probe) -> Iterator[_Choice]:
    """Yield lists of shells that may be better than those of [PEM] §4."""
    distances, objects = traced_hits(stage, probe, [_core.ShellRule.ITSELF])
    things = _things(stage, probe, distances, objects)
    flat = _flat(things, capture_place(stage).position)
    rest = sorted((thing for thing in things if thing not in flat), key=lambda thing: thing.distance)
    ground = _shell("ground", flat, "lies on a plane")
    if ground is not None:
        yield _choice(ground)
    background = len(distances) > 0 and float(np.mean(np.isinf(distances))) > HELD
    for near in _nearer(rest, background=background):
        furthest = max((thing.distance for thing in near), default=0.0)
        props = _shell("near", near, f"stands within {furthest:.2g} m")
        if props is not None:
            yield _choice(props)
            if ground is not None:
                yield _choice(props, ground)


def _shell(name: str, things: Sequence[_Thing], where: str) -> tuple[ShellSection, str] | None:
    """Return a shell that holds some things, with words for that; None if rays hardly meet them."""
    share = sum(thing.share for thing in things)
    if share < HELD:
        return None
    section = ShellSection(name=name, objects=tuple(thing.name for thing in things))
    return section, f"{name}, which {share:.1%} of the rays meet, {where}"


def _choice(*between: tuple[ShellSection, str]) -> _Choice:
    itself, rest = DEFAULT_SHELLS
    return _Choice((itself, *(shell for shell, _ in between), rest), tuple(words for _, words in between))


def _things(stage: Stage, probe: Probe, distances: FloatArray, objects: NDArray[np.int32]) -> list[_Thing]:
    names = stage.built.scene.object_names
    unfit = {"", ITSELF, names[stage.built.reflector]}
    things = []
    for name in dict.fromkeys(names):
        # A list of shells cannot name these: a star stands for any letters.
        if name in unfit or "*" in name or len(name) > 1000:
            continue
        met = np.isin(objects, [number for number, other in enumerate(names) if other == name])
        if not met.any():
            continue
        hits = probe.position[met] + distances[met, None] * probe.reflection[met]
        things.append(
            _Thing(name, float(np.mean(met)), float(np.median(distances[met])), hits.astype(np.float64))
        )
    return things


def _flat(things: Sequence[_Thing], origin: Sequence[float]) -> list[_Thing]:
    """Return the nearest thing that lies on a plane, and what lies on the same."""
    eye = np.array(origin, np.float64)
    for first in sorted(things, key=lambda thing: thing.distance):
        if first.share < HELD or len(first.hits) < MIN_HITS:
            continue
        proxy, thickness = plane_through(first.hits, origin)
        if proxy is None or thickness >= FLAT:
            continue
        normal = np.asarray(proxy.axes, np.float64)[1]
        foot = np.asarray(proxy.centre, np.float64)

        def is_on(thing: _Thing, normal: DoubleArray = normal, foot: DoubleArray = foot) -> bool:
            off = float(np.quantile(np.abs((thing.hits - foot) @ normal), 0.95))
            return off < FLAT * float(np.mean(np.linalg.norm(thing.hits - eye, axis=1)))

        return [first, *(thing for thing in things if thing is not first and is_on(thing))]
    return []


def _nearer(things: Sequence[_Thing], *, background: bool) -> Iterator[Sequence[_Thing]]:
    """Yield the things (sorted) before the widest gap in their distances; all, if there is more behind."""
    telling = [thing.distance for thing in things if thing.share >= SEEN]
    steps = [behind / before for before, behind in pairwise(telling)]
    if steps and max(steps) >= GAP:
        furthest = telling[steps.index(max(steps))]
        yield [thing for thing in things if thing.distance <= furthest]
    if background:
        yield things


def captured_error(
    stage: Stage, probe: Probe, shells: Shells, depth: int, last: _core.Proxy | None = None
) -> float:
    """Root mean square error, of the display's range, of a probe's pixels that the shells' shapes make.

    The shells are captured, and read where their shapes have it, against where the rays end: the noise of the
    captured light and the size of its texels are on both sides. The last shell is on a shape that is given,
    or else on the best.
    """
    trace = stage.config.trace.model_copy(update={"samples": CAPTURE_SAMPLES, "depth": depth, "noise": 0.0})
    stage = replace(stage, config=stage.config.model_copy(update={"shells": shells, "trace": trace}))
    proxies = [
        None if shell.is_itself else fit_shape(stage, probe, number, shell.proxy)[0]
        for number, shell in enumerate(shells[:-1])
    ]
    proxies.append(last or distant_decision(stage, probe)[1])
    origin = capture_place(stage).position
    distances, held_by = _held_by(stage, probe)
    ends = probe.reflection.copy()
    finite = np.isfinite(distances)
    # From the maps' origin; what is infinitely far lies in the direction of the ray.
    ends[finite] *= distances[finite, None]
    ends[finite] += probe.position[finite] - np.asarray(origin, np.float32)
    light, truth = np.zeros((len(probe.view), 3)), np.zeros((len(probe.view), 3))
    captured, place = None, None
    for number, point in enumerate(probe_points(stage)):
        moved = stage.at(point)
        if captured is None or moved.place != place:
            captured, place = captured_shells(moved, origin, "cube", CAPTURE_SIZE), moved.place
        seen = probe.view == number
        position, reflection = (
            np.ascontiguousarray(values[seen]) for values in (probe.position, probe.reflection)
        )
        for shell in range(len(shells) - 1, -1, -1):
            proxy, map_ = proxies[shell], captured[shell]
            if proxy is None or map_ is None:
                continue
            read, there = _read(map_, proxy.lookup(position, reflection)), _read(map_, ends[seen])
            light[seen] = read[:, :3] + (1.0 - read[:, 3:]) * light[seen]
            mine = held_by[seen] == shell
            whole = there[:, :3] / np.maximum(there[:, 3:], 0.5)
            truth[seen] = np.where(mine[:, None], whole, truth[seen])
    itself = probe.shells[0]
    drawn, wanted = (
        probe.diffuse + probe.fresnel * (itself[:, :3] + (1.0 - itself[:, 3:]) * behind)
        for behind in (light, truth)
    )
    shown = [srgb_encoded(pixel_means(v, probe.pixel).astype(np.float32)) for v in (drawn, wanted)]
    return float(np.sqrt(np.mean((shown[0] - shown[1]) ** 2)))


def _held_by(stage: Stage, probe: Probe) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return lengths (n,) of a probe's reflected rays, the object left out, and the shells where they end."""
    distances, objects = traced_hits(stage, probe, [_core.ShellRule.ITSELF])
    rules = stage.shell_rules
    shell = np.full(len(distances), len(rules) - 1)
    for number in range(len(rules) - 2, -1, -1):
        held = rules[number].holds(objects, distances, stage.built.reflector).astype(np.bool_)
        shell[held] = number
    return distances, shell


def _read(map_: FloatArray, lookups: FloatArray) -> DoubleArray:
    """Look up a captured map (F, S, S, 3 or 4): premultiplied light and α (n, 4)."""
    light = np.asarray(EnvMap.from_array(np.ascontiguousarray(map_[..., :3]), "cube").sample(lookups))
    alpha = np.ones((len(light), 1))
    if map_.shape[-1] == 4:
        three = np.ascontiguousarray(np.repeat(map_[..., 3:], 3, axis=-1))
        alpha = np.asarray(EnvMap.from_array(three, "cube").sample(lookups))[:, :1].astype(np.float64)
    return np.concatenate([light.astype(np.float64), alpha], axis=1)
