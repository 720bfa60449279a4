"""The geometry of what the object reflects of itself: about each part, or fitted to what its rays meet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.count_parts import collision_of
from mirrorbake.bake.probe import probe_points
from mirrorbake.proxy import choose_proxy
from mirrorbake.scene.config_axes import arranged
from mirrorbake.scene.config_shells import ENCLOSING
from mirrorbake.scene.plan import Decision
from mirrorbake.tone import srgb_encoded

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.bake.probe import Probe
    from mirrorbake.scene.build import BuiltScene
    from mirrorbake.scene.stage import Stage

    DoubleArray = NDArray[np.float64]

MIN_HITS = 100
"""Below this many reflected rays there is nothing to fit a shape to."""
TEXELS = 48
"""Along a side of a cube's face: how finely places of a map are told apart in the trial images."""
GREY = 0.5
"""Of the display's range: what is behind a shell, where its coverage is wrong."""


def enclosing_ellipsoid(built: BuiltScene, part: int) -> _core.Proxy:
    """Return the smallest ellipsoid about the centre of a part, as [PEM] §4 has it."""
    triangles = built.triangles[built.parts == part]
    centre = _core.area_weighted_centroid(built.positions, triangles)
    return _core.fit_ellipsoid(built.positions[np.unique(triangles)], centre)


def local_shape(
    stage: Stage, probe: Probe, distances: FloatArray, shell: int, part: int, wanted: str
) -> tuple[_core.Proxy, Decision]:
    """Fit the shape of a part's map of the object itself.

    "auto" is the ellipsoid about the part. How much the light that samples want of one texel differs, which
    no map on a shape can show, is told of it and of the best of the fitted shapes; even one that halves it
    leaves less on the teapot, on its samples and more so beyond them (the decision record has the figures).

    Parameters
    ----------
    stage
        Of the scene, with these shells.
    probe
        Traced with them.
    distances
        (n,), metres, up to what the shell holds of the probe's rays; 0: nothing (`shell_distances`).
    shell
        Number of the shell.
    part
        Number of the part.
    wanted
        A shape of a scene file's shell, or "auto".

    Returns
    -------
    tuple
        The shape, where the object is at rest, and the decision.
    """
    built, name = stage.built, stage.shell_rules[shell].name
    about = enclosing_ellipsoid(built, part)
    used = (probe.part == part) & (distances > 0.0)

    def decided(value: str, reason: str, error: float | None = None) -> Decision:
        if wanted != "auto":
            reason, error = "set in the scene", None
        its_part, automatic = built.part_names[part], wanted == "auto"
        return Decision("shells.proxy", its_part, value, automatic, reason, error, name)

    if wanted == "infinite":
        return _core.Proxy.infinite(about.origin), decided(wanted, "")
    if wanted == ENCLOSING:
        return about, decided(wanted, "")
    hits = int(np.count_nonzero(used))
    if hits < MIN_HITS:
        return about, decided(
            ENCLOSING, f"{hits} rays of the trial images meet the object, too few for a fit"
        )
    position, reflection = _at_rest(stage, probe, used)
    view, length = np.ascontiguousarray(probe.view[used]), np.ascontiguousarray(distances[used])
    choice = choose_proxy(position, reflection, length, view, about.origin)
    if wanted != "auto":
        chosen = next(candidate for candidate in choice.candidates if candidate.name == wanted)
        return chosen.proxy, decided(wanted, "")
    every = probe.part == part
    position, reflection = _at_rest(stage, probe, every)
    shown = _wanted_light(probe, shell, every)

    def collision(shape: _core.Proxy) -> float:
        return collision_of(shape.lookup(position, reflection), shown, probe.view[every], TEXELS)

    own = collision(about)
    fitted = [(collision(candidate.proxy), candidate) for candidate in choice.candidates]
    least, best = min(fitted, key=lambda entry: entry[0])
    reason = (
        f"light that is read from one texel differs by {own:.3f} of the display's range, "
        f"on the best fitted shape, {best.name}, by {least:.3f}"
    )
    return about, decided(ENCLOSING, reason, own)


def _wanted_light(probe: Probe, shell: int, used: NDArray[np.bool_]) -> DoubleArray:
    """Return what some samples want of a shell (n, 4): displayed light, and what it hides of a grey."""
    layer, share = probe.shells[shell][used], probe.fresnel[used]
    light = srgb_encoded(np.clip(share * layer[:, :3], 0.0, 1.0))
    return np.concatenate([light, GREY * layer[:, 3:]], axis=1)


def _at_rest(stage: Stage, probe: Probe, used: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
    """Return places and directions (n, 3) of a probe's rays as they would be, had the object not moved."""
    position, reflection = probe.position[used], probe.reflection[used]
    view = probe.view[used]
    for number, point in enumerate(probe_points(stage)):
        pose = arranged(stage.config, stage.space.scene_coordinates(point)).pose
        mine = view == number
        position[mine] = pose.at_rest(position[mine].astype(np.float64))
        reflection[mine] = reflection[mine].astype(np.float64) @ pose.rotation
    return position, reflection
