"""How the light of the body under the mirror is stored: at vertices, how far apart, or in a lightmap."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.body_light import Lightmap, has_own_coordinates, irradiance_of, lit_sides
from mirrorbake.bake.traced_light import LightmapTrial, TracedLight, small_views
from mirrorbake.errors import InputError
from mirrorbake.scene.plan import Decision
from mirrorbake.scene.refine import refined

if TYPE_CHECKING:
    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.stage import Stage

    Lights = tuple[FloatArray, FloatArray]

EDGE, LIGHTMAP = "reflector.longest_edge", "layers.lightmap"
COARSE_PIXELS = 4
"""Of a trial image, that a triangle covers if light may change unseen between its vertices."""
TRIAL_RAYS = 1 << 20
"""By which light is gathered for a trial, twice."""
MOST_HALVINGS = 6
MOST_VERTICES = 1 << 16
"""That a mesh is refined to."""
MAP_SHARE = 0.5
"""Of `auto.tolerance`, by which a lightmap may change the picture: errors add in squares, so that one of the
vertices that meets the tolerance grows by an eighth at most."""
SIZES = (16, 32, 64, 128, 256, 512)
"""Texels along the sides of maps that are tried."""
BYTES = 6
"""Of a vertex or texel: three half floats for each side that is lit."""
BYTES_OF_UV = 4
"""Of a vertex, as a web page gets them."""
BYTES_OF_VERTEX = 34
"""The same of all else: position and normal, and two triangles."""


class LightStorage(NamedTuple):
    """How the light is stored, and the scene with the mesh that this leads to."""

    edge: Decision
    lightmap: Decision
    stage: Stage


def light_storage(stage: Stage, *, has_diffuse: bool) -> LightStorage:
    """Decide `reflector.longest_edge` and `layers.lightmap`.

    Samples of small images of a few views are compared with light that is interpolated from the vertices.
    Where triangles are large in the picture and the difference is more than `auto.tolerance`, edges are
    halved as often as the difference has to be; it is then measured again. A lightmap takes the place of the
    vertices if it takes fewer bytes and changes the pictures by no more than half the tolerance.

    Parameters
    ----------
    stage
        With the reflector's mesh as it is in its file, if the scene file leaves that to this decision.
    has_diffuse
        Whether the body's own light is stored at all.

    Raises
    ------
    InputError
        The scene file asks for a lightmap, and the mesh has no texture coordinates for one.
    """
    config = stage.config
    size, edge = config.layers.lightmap, config.reflector.longest_edge
    kept = Decision(EDGE, None, edge or 0.0, edge is None, "set in the scene", None)
    at_vertices = Decision(LIGHTMAP, None, size or 0, size is None, "set in the scene", None)
    reason = None
    if not has_diffuse:
        reason = "there is no diffuse layer"
    elif stage.space.changes_scene:
        reason = "the scene changes, so that no view stands for all"
    if size and not has_own_coordinates(stage):
        raise InputError(
            f"layers.lightmap: {size}: the mesh has no texture coordinates, or shares them between several "
            "places of its surface; expected 0, light at the vertices"
        )
    if reason is not None or (size is not None and edge is not None):
        return LightStorage(_because(kept, reason), _because(at_vertices, reason), stage)
    in_map = _because(kept, "the diffuse light is in a map")
    if size:
        return LightStorage(in_map, at_vertices, stage)
    finer, lights = stage, None
    if edge is None:
        kept, finer, lights = _edge_decision(stage)
    decision = at_vertices if size == 0 else _lightmap_decision(stage, finer, lights)
    if decision.value:
        return LightStorage(in_map if kept.value else kept, decision, stage)
    return LightStorage(kept, decision, finer)


def _because(decision: Decision, reason: str | None) -> Decision:
    """Return a decision that nothing was measured for, unless the scene file sets it."""
    if reason is None or not decision.automatic:
        return decision
    return replace(decision, reason=reason)


def _edge_decision(stage: Stage) -> tuple[Decision, Stage, Lights | None]:
    """Return the decision, the stage that it leads to, and the light at its vertices, if it was gathered."""
    config = stage.config
    lights = None

    def as_it_is(reason: str, measured: float | None = None) -> tuple[Decision, Stage, Lights | None]:
        return Decision(EDGE, None, 0.0, True, reason, measured), stage, lights

    if config.reflector.scene_object is not None:
        return as_it_is("an object of a scene keeps its mesh")
    coarse = _coarse_edge(stage)
    if coarse is None:
        return as_it_is("triangles are small in the picture")
    sides = lit_sides(stage)
    lights = _gathered_twice(stage, sides)
    before = TracedLight(stage).change_by(lights[0], again=lights[1])
    words = f"interpolating diffuse light between vertices changes the picture by {before:.2%} beyond noise"
    if before <= config.auto.tolerance:
        return as_it_is(words, before)
    edge = coarse / 2 ** min(math.ceil(math.log2(before / config.auto.tolerance)), MOST_HALVINGS)
    mesh = stage.built.scene.object_mesh(stage.built.reflector)
    while edge < coarse and len(refined(mesh, edge).positions) > MOST_VERTICES:
        edge *= math.sqrt(2.0)
    edge = float(f"{edge:.3g}")
    finer = stage.without_edges_above(edge)
    finer_lights = _gathered_twice(finer, sides)
    after = TracedLight(finer).change_by(finer_lights[0], again=finer_lights[1])
    if after > 0.8 * before:
        return as_it_is(f"{words}, and no less with finer triangles", before)
    count = len(finer.built.positions)
    reason = f"{words}, by {after:.2%} without longer edges, at {count} vertices"
    return Decision(EDGE, None, edge, True, reason, before), finer, finer_lights


def _gathered_twice(stage: Stage, sides: int) -> Lights:
    """Light at the vertices from two sets of random numbers: their noise leaves no trace in products."""
    seed = stage.config.trace.seed
    first, second = (irradiance_of(stage, sides, rays=TRIAL_RAYS, seed=seed + k) for k in (0, 1))
    return first, second


def _lightmap_decision(stage: Stage, finer: Stage, lights: Lights | None) -> Decision:
    """Compare the light at the vertices of a finer mesh with maps that are fitted to it.

    None: it has yet to be gathered.
    """

    def decided(size: int, reason: str, measured: float | None = None) -> Decision:
        return Decision(LIGHTMAP, None, size, True, reason, measured)

    built, most = finer.built, MAP_SHARE * stage.config.auto.tolerance
    if not has_own_coordinates(finer):
        return decided(0, "the mesh has no texture coordinates of its own for every place")
    sides = lit_sides(finer) if lights is None else lights[0].shape[1] // 3
    own = len(stage.built.positions)
    at_vertices = BYTES * sides * len(built.positions) + BYTES_OF_VERTEX * (len(built.positions) - own)
    coordinates = 0 if _has_textures(stage) else BYTES_OF_UV * own
    words = f"light at the vertices takes {at_vertices / 1e3:.1f} kB"
    trial: LightmapTrial | None = None
    for size in SIZES:
        lightmap = Lightmap(finer, size)
        takes = BYTES * sides * lightmap.texels + coordinates
        if takes >= at_vertices:
            break
        if trial is None:
            trial = LightmapTrial(finer, _gathered_twice(finer, sides) if lights is None else lights)
        change = trial.change_by(lightmap, size)
        if change <= most:
            reason = f"{words}, in a map {takes / 1e3:.1f} kB, which changes the picture by {change:.2%}"
            return decided(size, reason, change)
    return decided(0, f"{words}, in a map that changes the picture by no more than {most:.1%} no less")


def _has_textures(stage: Stage) -> bool:
    """Whether materials of the reflector have textures, so that its coordinates are exported with it."""
    scene = stage.built.scene
    materials = map(scene.material, set(scene.object_part_materials(stage.built.reflector)))
    return any(
        reference.texture >= 0
        for material in materials
        for reference in (
            material.albedo_texture,
            material.specular_texture,
            material.roughness_texture,
            material.normal_texture,
        )
    )


def _coarse_edge(stage: Stage) -> float | None:
    """Mean longest edge of the triangles that are large in some views; None if they cover next to nothing."""
    built, options = stage.built, _core.TraceOptions(samples_per_pixel=1)
    seen = [
        np.bincount(
            stage.tracer.trace_visibility(view, built.reflector, options, [(0.5, 0.5)]).triangle,
            minlength=len(built.triangles),
        )
        for view in small_views(stage)
    ]
    covered = np.sum(seen, axis=0)
    coarse = np.where(np.max(seen, axis=0) > COARSE_PIXELS, covered, 0)
    if coarse.sum() <= stage.config.auto.tolerance * covered.sum():
        return None
    corners = built.positions[built.triangles].astype(np.float64)
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1).max(axis=1)
    return float(np.average(edges, weights=coarse))
