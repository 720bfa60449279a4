"""How long edges may be between the vertices at which the body's own light is stored."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.probe import BRIGHTEST_SHARE, probe_points, small_cameras
from mirrorbake.bake.sample import diffuse_layer, lit_sides
from mirrorbake.pem.run_time import diffuse_of
from mirrorbake.scene.plan import Decision
from mirrorbake.scene.refine import refined

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.stage import Stage

    DoubleArray = NDArray[np.float64]

KEY = "reflector.longest_edge"
SAMPLES = 16
"""Per pixel of each of two tracings of a trial image."""
BLOCK = 4
"""Pixels along a side of the blocks over which light is compared."""
COARSE_PIXELS = 4
"""Of a trial image, that a triangle covers if light may change unseen between its vertices."""
MOST_HALVINGS = 6
MOST_VERTICES = 1 << 16
"""That a mesh is refined to."""


def edge_decision(stage: Stage, *, has_diffuse: bool) -> tuple[Decision, Stage]:
    """Decide `reflector.longest_edge`.

    Samples of small images of a few views are compared with light that is interpolated from the vertices.
    Where triangles are large in the picture and the difference is more than `auto.tolerance`, edges are
    halved as often as the difference has to be; it is then measured again.

    Parameters
    ----------
    stage
        With the reflector's mesh as it is in its file, if the scene file leaves that to this decision.
    has_diffuse
        Whether the body's own light is stored at all.

    Returns
    -------
    tuple
        The decision, and the stage with the mesh that it leads to.
    """
    config = stage.config

    def as_it_is(reason: str, measured: float | None = None) -> tuple[Decision, Stage]:
        return Decision(KEY, None, 0.0, True, reason, measured), stage

    if config.reflector.longest_edge is not None:
        return Decision(KEY, None, config.reflector.longest_edge, False, "set in the scene", None), stage
    if config.reflector.scene_object is not None:
        return as_it_is("an object of a scene keeps its mesh")
    if not has_diffuse:
        return as_it_is("there is no diffuse layer")
    if stage.space.changes_scene:
        return as_it_is("the scene changes, so that no view stands for all")
    views = small_views(stage)
    coarse = _coarse_edge(stage, views)
    if coarse is None:
        return as_it_is("triangles are small in the picture")
    before = change_by(stage, views, at_vertices(stage))
    words = f"interpolating diffuse light between vertices changes the picture by {before:.2%} beyond noise"
    if before <= config.auto.tolerance:
        return as_it_is(words, before)
    edge = coarse / 2 ** min(math.ceil(math.log2(before / config.auto.tolerance)), MOST_HALVINGS)
    mesh = stage.built.scene.object_mesh(stage.built.reflector)
    while edge < coarse and len(refined(mesh, edge).positions) > MOST_VERTICES:
        edge *= math.sqrt(2.0)
    edge = float(f"{edge:.3g}")
    finer = stage.without_edges_above(edge)
    after = change_by(finer, views, at_vertices(finer))
    if after > 0.8 * before:
        return as_it_is(f"{words}, and no less with finer triangles", before)
    count = len(finer.built.positions)
    reason = f"{words}, by {after:.2%} without longer edges, at {count} vertices"
    return Decision(KEY, None, edge, True, reason, before), finer


def small_views(stage: Stage) -> list[_core.Camera]:
    """Return a few views of a stage as small pictures."""
    small = small_cameras(stage.built.cameras)
    return [small.camera(point) for point in probe_points(stage)]


def _coarse_edge(stage: Stage, views: Sequence[_core.Camera]) -> float | None:
    """Mean longest edge of the triangles that are large in some views; None if they cover next to nothing."""
    built, options = stage.built, _core.TraceOptions(samples_per_pixel=1)
    seen = [
        np.bincount(
            stage.tracer.trace_visibility(view, built.reflector, options, [(0.5, 0.5)]).triangle,
            minlength=len(built.triangles),
        )
        for view in views
    ]
    covered = np.sum(seen, axis=0)
    coarse = np.where(np.max(seen, axis=0) > COARSE_PIXELS, covered, 0)
    if coarse.sum() <= stage.config.auto.tolerance * covered.sum():
        return None
    corners = built.positions[built.triangles].astype(np.float64)
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1).max(axis=1)
    return float(np.average(edges, weights=coarse))


def at_vertices(stage: Stage) -> Callable[[_core.SurfaceSamples], FloatArray]:
    """Return what gives the radiance (n, 3) of samples' bodies from light at the vertices."""
    irradiance = diffuse_layer(stage, lit_sides(stage))
    return lambda samples: diffuse_of(samples, stage.built.triangles, irradiance)


def change_by(
    stage: Stage, views: Sequence[_core.Camera], drawn: Callable[[_core.SurfaceSamples], FloatArray]
) -> float:
    """Return how much drawing the bodies' light changes pictures, beyond noise.

    Root mean square over blocks of `BLOCK`² pixels, less twice its standard error, relative to that of their
    light, the brightest clipped.

    Parameters
    ----------
    stage
        With what is compared with: its tracer.
    views
        Pictures of them are traced twice.
    drawn
        Gives the radiance (n, 3) of samples' bodies.
    """
    built = stage.built
    # The noise of two tracings is independent: the product of their errors holds the difference alone.
    seeds = (stage.config.trace.seed, stage.config.trace.seed + 1)
    errors: list[DoubleArray] = []
    lights: list[DoubleArray] = []
    counts = []
    for view in views:
        across = -(-view.width // BLOCK)
        blocks = across * -(-view.height // BLOCK)
        for seed in seeds:
            options = _core.TraceOptions(samples_per_pixel=SAMPLES, max_specular_depth=0, seed=seed)
            traced = stage.tracer.trace_layers(view, built.reflector, options)
            samples = traced.samples
            pixel = np.asarray(samples.pixel).astype(np.int64)
            block = pixel // view.width // BLOCK * across + pixel % view.width // BLOCK
            error = samples.diffuse - drawn(samples)
            count = np.bincount(block, minlength=blocks)
            for sums, values in ((errors, error), (lights, traced.sample_beauty)):
                total = [np.bincount(block, values[:, c], blocks) for c in range(3)]
                sums.append(np.stack(total, axis=-1) / np.maximum(count, 1)[:, None])
            counts.append(count)
    weights = np.minimum(np.concatenate(counts[::2]), np.concatenate(counts[1::2])).astype(np.float64)
    weights /= weights.sum()
    products = np.mean(np.concatenate(errors[::2]) * np.concatenate(errors[1::2]), axis=1)
    square = float(weights @ products)
    noise = math.sqrt(float(weights**2 @ (products - square) ** 2))
    light = np.concatenate(lights[::2])
    light = np.minimum(light, np.quantile(light[weights > 0.0], 1.0 - BRIGHTEST_SHARE) or np.inf)
    scale = float(weights @ np.mean(light * light, axis=1))
    return math.sqrt(max(square - 2.0 * noise, 0.0) / scale) if scale > 0.0 else 0.0
