"""Into how many parts a reflector is cut: as many as keep apart what its points want of one texel."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake.scene.plan import Decision
from mirrorbake.scene.surface_parts import split_surface
from mirrorbake.tone import srgb_encoded

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.bake.probe import Probe
    from mirrorbake.scene.stage import Stage

    Labels = NDArray[np.uint16]

COUNTS = (1, 2, 3, 4, 6, 8)
"""That are tried; each part takes maps of its own in every sample."""
TOLERANCE = 0.02
"""Root mean square collision, of the display's range, that needs no further parts."""
WORTH = 0.5
"""n times as many parts have to divide the mean square collision by n to this power."""
TEXELS = 24
"""Along a side of a cube's face: how finely equal reflections are told apart in the trial images."""


def parts_decision(stage: Stage, probe: Probe) -> tuple[Decision, Labels | None]:
    """Decide `reflector.parts`.

    Where samples of one view and part reflect into one small solid angle, they read the same texels; how much
    their displayed light differs is what no map of that part can show. It is measured for growing numbers of
    parts.

    Parameters
    ----------
    stage
        With the reflector in the parts that its file has, if the scene file leaves them to this decision.
    probe
        Samples of it.

    Returns
    -------
    tuple
        The decision, and parts of all triangles where they are others than the stage has.
    """
    reflector = stage.config.reflector
    if reflector.parts is not None:
        return Decision("reflector.parts", None, reflector.parts, False, "set in the scene", None), None
    if reflector.scene_object is not None:
        reason = "an object of a scene keeps its parts"
        return Decision("reflector.parts", None, "split", True, reason, None), None
    if stage.config.infer.fit == "layers":
        reason = 'infer.fit = "layers" takes the parts that the object has'
        return Decision("reflector.parts", None, "split", True, reason, None), None
    built = stage.built
    materials = np.asarray(built.scene.object_part_materials(built.reflector))
    kind = materials[built.parts] if len(materials) == len(built.part_names) else None
    split = split_surface(built.positions, built.triangles, kind)
    floor = disagreement(probe, split.parts(split.most))

    def collision(labels: Labels) -> float:
        return max(disagreement(probe, labels) ** 2 - floor**2, 0.0)

    found = {int(labels.max()) + 1: labels for labels in map(split.parts, COUNTS)}
    first, *more = found
    best, left = first, collision(found[first])
    without = left
    for count in more:
        if left <= TOLERANCE**2:
            break
        error = collision(found[count])
        if error <= left * (best / count) ** WORTH:
            best, left = count, error
    reason = f"light that is read from one texel differs by {math.sqrt(left):.3f} of the display's range"
    if best != first:
        reason += f", by {math.sqrt(without):.3f} in {_parts(first)}"
    if best == len(built.part_names) == 1:
        return Decision("reflector.parts", None, "split", True, reason, math.sqrt(left)), None
    return Decision("reflector.parts", None, best, True, reason, math.sqrt(left)), found[best]


def _parts(count: int) -> str:
    return f"{count} part{'s' if count != 1 else ''}"


def disagreement(probe: Probe, labels: Labels) -> float:
    """Root mean square difference, of the display's range, of light that samples want of one place of a map.

    Parameters
    ----------
    probe
        Samples of some views.
    labels
        (T,) part of every triangle.
    """
    shown = srgb_encoded(np.clip(probe.fresnel * probe.incident, 0.0, 1.0))
    group = probe.view.astype(np.int64) * 65536 + labels[probe.triangle]
    return collision_of(probe.reflection, shown, group)


def collision_of(
    lookup: NDArray[np.floating], shown: NDArray[np.float64], group: NDArray[np.integer], texels: int = TEXELS
) -> float:
    """Root mean square difference of values that samples want of one texel.

    Parameters
    ----------
    lookup
        (n, 3): where samples read a map.
    shown
        (n, C): what they want there, of the display's range.
    group
        (n,): numbers of the maps that they read.
    texels
        Along a side of a cube's face.
    """
    if not len(lookup):
        return 0.0
    direction = lookup.astype(np.float64)
    rows = np.arange(len(direction))
    axis = np.argmax(np.abs(direction), axis=1)
    major = direction[rows, axis]
    cells = [
        np.clip((0.5 + 0.5 * direction[rows, (axis + turn) % 3] / np.abs(major)) * texels, 0, texels - 1)
        for turn in (1, 2)
    ]
    face = 2 * axis + (major < 0.0)
    texel = (face * texels + cells[0].astype(np.int64)) * texels + cells[1].astype(np.int64)
    key = group.astype(np.int64) * (6 * texels * texels) + texel
    _, place, count = np.unique(key, return_inverse=True, return_counts=True)
    place = place.reshape(-1)
    several = count > 1
    channels = shown.shape[1]
    total, samples = 0.0, channels * float(count[several].sum())
    for channel in range(channels):
        values = shown[:, channel].astype(np.float64)
        mean = np.bincount(place, values) / count
        squares = np.bincount(place, (values - mean[place]) ** 2)
        # Samples that are alone say nothing, and small groups no less than large ones.
        total += float(np.sum(squares[several] / (count[several] - 1.0) * count[several]))
    return math.sqrt(total / samples) if samples else 0.0
