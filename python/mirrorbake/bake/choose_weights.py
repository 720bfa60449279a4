"""The regulariser's weight λ, by cross-validation: on pixels and a view that the fit does not see."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.body_light import irradiance_of
from mirrorbake.bake.captured import captured_pyramids
from mirrorbake.bake.fit import DisplayFitter
from mirrorbake.bake.static_set import static_views, stripes_of
from mirrorbake.bake.targets import ViewTracer
from mirrorbake.pem.body_light import BodyLight
from mirrorbake.pem.run_time import model_of, shell_maps
from mirrorbake.scene.config_axes import arranged
from mirrorbake.scene.plan import USUAL_WEIGHT, Decision, with_weight
from mirrorbake.tone import srgb_encoded

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mirrorbake.bake.fit import FitView
    from mirrorbake.pem.store import Contents
    from mirrorbake.scene.plan import Plan
    from mirrorbake.scene.stage import Stage

CANDIDATES = (3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2)
"""Weights that are tried."""
STEP = 6
"""Every so-manieth row of the sample's view is held out."""


def weight_decision(stage: Stage, contents: Contents) -> Decision:
    """Decide `infer.smoothness`, with which the other weights of the regulariser go.

    The sample in the middle of the space is fitted with each weight, to its own view without every sixth row.
    What counts is the mean of the decibels of these rows, and of the view half-way to the next sample where
    there is one. Of a PEM without parameters the views of its dome are fitted, and rows of the camera's own
    are held out.

    Parameters
    ----------
    stage
        Planned, but for this weight.
    contents
        What the samples share.
    """
    header, space = contents.header, stage.space
    index = (len(space) - 1) // 2
    point, between = space.sample(index), space.middle_after(index)
    here = stage.at(point)
    tracer, cameras = ViewTracer(stage, header, contents.local_triangles), here.built.cameras
    rows = [stripes_of(tracer, here, cameras.camera(point), STEP, phase, rows=1) for phase in range(STEP)]
    if header.is_static_set:
        # Its views are of a dome; the camera's own is none of them.
        fitted, held_out = static_views(tracer, stage), [rows[0]]
    else:
        fitted, held_out = [row for some in rows[1:] for row in some], [rows[0]]
        if between is not None and not space.changes_scene:
            held_out.append(stripes_of(tracer, here, cameras.camera(between), STEP, 0, rows=1))
    if not fitted:
        reason = "the sample that is tried does not see the object"
        return Decision("infer.smoothness", None, USUAL_WEIGHT, True, reason, None)
    scores = [_score(here, contents, fitted, held_out, weight) for weight in CANDIDATES]
    best = max(range(len(CANDIDATES)), key=lambda k: scores[k])
    others = ", ".join(
        f"{scores[k]:.2f} with {CANDIDATES[k]:g}" for k in range(len(CANDIDATES)) if abs(k - best) == 1
    )
    reason = f"pixels and a view that were held out are met to {scores[best]:.2f} dB, to {others}"
    return Decision("infer.smoothness", None, CANDIDATES[best], True, reason, scores[best])


def with_chosen_weight(stage: Stage, plan: Plan, contents: Contents) -> Plan:
    """Return the plan with λ decided (`weight_decision`); as it is, where the scene file sets it."""
    if stage.config.infer.smoothness is not None:
        return plan
    return replace(plan, decisions=(*plan.decisions, weight_decision(stage, contents)))


def _score(
    stage: Stage,
    contents: Contents,
    fitted: Sequence[FitView],
    held_out: Sequence[Sequence[FitView]],
    weight: float,
) -> float:
    """Mean of the decibels to which maps that are fitted with a weight show what was held out."""
    header = contents.header
    pose = arranged(stage.config, stage.place).pose
    fitter = DisplayFitter(header, with_weight(stage.config.infer, weight), contents.local_triangles)
    prior = None
    if stage.config.infer.prior == "captured":
        prior = fitter.captured_prior(captured_pyramids(stage, header, contents.capture))
    texels, _ = fitter.fit(fitted, pose, prior)

    def read(part: str, shell: str) -> np.ndarray:
        number = header.map_of(part, shell)
        return np.ascontiguousarray(texels[0][number][:, : header.maps[number].channels])

    irradiance = None if contents.irradiance is None else contents.irradiance[0]
    if irradiance is not None and stage.space.changes_scene:
        irradiance = irradiance_of(stage, contents.lit_sides, header.lightmap)
    parts = shell_maps(header, read, pose, contents.local_triangles)
    body = BodyLight.of(stage.built, header.lightmap)
    decibels = []
    for views in held_out:
        errors = []
        for view in (one.view for one in views):
            diffuse = None
            if irradiance is not None:
                diffuse = body.radiance(view.lookups, irradiance)
            drawn = np.asarray(
                _core.render_reflector(view.lookups, parts, diffuse, model_of(header.run_time))
            )
            seen = (view.images.coverage > 0.99) & (drawn[..., 3] > 0.99)
            shown, truth = srgb_encoded(drawn[seen][:, :3]), srgb_encoded(view.images.object[seen])
            errors.append(((shown - truth) ** 2).ravel())
        values = np.concatenate(errors) if errors else np.zeros(0)
        if len(values):
            decibels.append(-10.0 * math.log10(max(float(np.mean(values)), 1e-12)))
    return float(np.mean(decibels)) if decibels else 0.0
