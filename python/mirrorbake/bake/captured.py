"""The surroundings of an object as its shells have them, captured from one place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.pem.pyramid import capture, pyramid_of
from mirrorbake.projection import MAP_PROJECTIONS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.header import Header
    from mirrorbake.scene.stage import Stage

SUBTEXELS = 4
"""Rays along each side of a texel that find how much of it a shell covers."""


def captured_shells(
    stage: Stage, origin: Sequence[float], projection: str, size: int
) -> list[FloatArray | None]:
    """Capture what each shell holds but for the object, which is left out, with what is behind it.

    Parameters
    ----------
    stage
        Planned, or with its shells and options set.
    origin
        Place from which it is seen: the maps' origin.
    projection, size
        Of the maps.

    Returns
    -------
    list
        For each shell, front to back, the finest level (F, S, S, 4), premultiplied by α; of the last (F, S,
        S, 3). None for one that holds the object alone. Within a distance is within that of the place.
    """
    rules, reflector = stage.shell_rules, stage.built.reflector
    hidden = [reflector]
    whole = capture(stage.tracer, list(origin), projection, size, hidden, stage.options)
    layers: list[FloatArray | None] = []
    for rule in rules[:-1]:
        others = [i for i in rule.objects if i not in (rule.ITSELF, *hidden)]
        if rule.objects and not others:
            layers.append(None)
            continue
        alpha = _covered(stage, origin, projection, size, rule, hidden)[..., None]
        if rule.has_limits:
            # What is beyond the limits cannot be looked at alone: what is held stays in what is behind.
            layers.append(np.concatenate([alpha * whole, alpha], axis=-1))
            continue
        hidden += others
        behind = capture(stage.tracer, list(origin), projection, size, hidden, stage.options)
        light = np.maximum(whole - (1.0 - alpha) * behind, np.float32(0.0))
        light[alpha[..., 0] == 0.0] = 0.0
        layers.append(np.concatenate([light, alpha], axis=-1))
        whole = behind
    return [*layers, whole]


def _covered(
    stage: Stage,
    origin: Sequence[float],
    projection: str,
    size: int,
    rule: _core.ShellRule,
    hidden: list[int],
) -> FloatArray:
    """Return the share (F, S, S) of each texel in which a shell's things are met first."""
    places = (2.0 * (np.arange(SUBTEXELS * size) + 0.5) / (SUBTEXELS * size) - 1.0).astype(np.float32)
    across, up = np.meshgrid(places, -places)
    points = np.ascontiguousarray(np.stack([across.ravel(), up.ravel()], axis=-1))
    shares = []
    kept = MAP_PROJECTIONS[projection]
    for face in range(kept.faces):
        faces = np.full(len(points), face, np.int32)
        directions = _core.directions_from_points(kept.projection, faces, points)
        origins = np.broadcast_to(np.asarray(origin, np.float32), directions.shape)
        distance, met = stage.tracer.intersect_distance(np.ascontiguousarray(origins), directions, hidden)
        grid = rule.holds(met, distance, stage.built.reflector).reshape(size, SUBTEXELS, size, SUBTEXELS)
        shares.append(grid.mean(axis=(1, 3), dtype=np.float32))
    return np.stack(shares)


def captured_pyramids(stage: Stage, header: Header, whole: FloatArray | None = None) -> dict[str, FloatArray]:
    """Return pyramids (T, 3) of what is captured, by the name of the shell; those of none are left out.

    Parameters
    ----------
    stage
        Planned.
    header
        Of the PEM.
    whole
        The finest level (F, S, S, 3) of all that surrounds the object, if that is known.
    """
    names, projection, size = [rule.name for rule in header.rules], header.projection, header.map_size
    if all(rule.is_itself for rule in header.rules[:-1]):
        if whole is None:
            origin = header.plan.distant["origin"]
            hidden = [stage.built.reflector]
            whole = capture(stage.tracer, origin, projection, size, hidden, stage.options)
        return {names[-1]: pyramid_of(whole, projection)}
    layers = captured_shells(stage, header.plan.distant["origin"], projection, size)
    return {
        name: pyramid_of(np.ascontiguousarray(layer[..., :3]), projection)
        for name, layer in zip(names, layers, strict=True)
        if layer is not None
    }
