"""What all samples of a PEM share: shells, captured surroundings, diffuse layer, static set."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.body_light import irradiance_of, lit_sides
from mirrorbake.bake.fade import fit_fade
from mirrorbake.bake.sample import SampleBaker
from mirrorbake.bake.static_set import infer_static_set
from mirrorbake.pem.header import Header
from mirrorbake.pem.pyramid import capture
from mirrorbake.pem.run_time import TRACED_SAMPLES
from mirrorbake.pem.shells import Part, Shell
from mirrorbake.pem.store import Contents
from mirrorbake.proxy import proxy_to_attributes

if TYPE_CHECKING:
    from collections.abc import Callable

    from mirrorbake.pem.header import Source
    from mirrorbake.scene.build import BuiltScene
    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.plan import Plan
    from mirrorbake.scene.stage import Stage


def contents_of(stage: Stage, plan: Plan, source: Source) -> Contents:
    """Return what the samples share, but for the static set (`with_static_set`).

    Parameters
    ----------
    stage
        Planned.
    plan
        Of the bake.
    source
        What the PEM is made from.
    """
    config, built, tracer = stage.config, stage.built, stage.tracer
    origin = plan.distant["origin"]
    captured = capture(
        tracer, origin, config.maps.projection, plan.map_size, [built.reflector], stage.options
    )
    irradiance, sides = None, 1
    if plan.has_diffuse:
        # Where the scene changes, every sample writes its own.
        sides = lit_sides(stage)
        if built.space.changes_scene:
            count = plan.lightmap**2 or len(built.positions)
            irradiance = np.zeros((len(built.space), count, 3 * sides), np.float32)
        else:
            irradiance = irradiance_of(stage, sides, plan.lightmap)[None]
    shared = bool(plan.value("maps.shared_distant"))
    header = Header(
        source=source,
        plan=plan,
        space=built.space,
        rules=tuple(shell.rule for shell in plan.shell_sections),
        parts=tuple(_part(built, plan, number, shared=shared) for number in range(len(built.part_names))),
        static={
            "infinite": proxy_to_attributes(_core.Proxy.infinite(origin)),
            "proxy": None if plan.distant["shape"] == "infinite" else plan.distant,
            "fade": None,
        },
        projection=config.maps.projection,
        map_size=plan.map_size,
        precision=config.maps.precision,
        image_size=config.views.size,
        origin=built.origin,
        run_time=_run_time(config, plan),
    )
    local_triangles = None
    if plan.has_hull_split:
        local_triangles = (~built.on_hull).astype(np.uint8)
    return Contents(header, captured, irradiance, local_triangles, lit_sides=sides)


def with_static_set(
    stage: Stage, contents: Contents, report: Callable[[int, int, str], None]
) -> tuple[Contents, list[str]]:
    """Return contents with the static set and how a PEM fades to it, and notes for the user.

    As they are, if the plan has no static set.
    """
    if not stage.config.static.views:
        return contents, []
    maps, solver = infer_static_set(stage, contents, report)
    with_maps = replace(contents, static_maps=maps)
    report(0, 1, "finding out how far a sample holds")
    degrees = fit_fade(stage, with_maps, SampleBaker(stage, with_maps))
    header = replace(contents.header, static={**contents.header.static, "fade": {"degrees": degrees}})
    notes = []
    if not solver.converged:
        notes.append(
            "the solver stopped before it converged in the static set; a larger infer.iterations, "
            "infer.tolerance or infer.smoothness helps"
        )
    return replace(with_maps, header=header), notes


def _run_time(config: SceneConfig, plan: Plan) -> dict[str, Any]:
    if config.infer.fit == "layers":
        return {
            "name": TRACED_SAMPLES,
            "lookups": plan.samples,
            "footprint_scale": config.infer.footprint_scale,
        }
    model = _core.run_time_model(config.infer.run_time)
    return {
        "name": config.infer.run_time,
        "lookups": len(model.places),
        "footprint_scale": model.footprint_scale,
    }


def _part(built: BuiltScene, plan: Plan, number: int, *, shared: bool) -> Part:
    name = built.part_names[number]
    hull: Literal["all", "off hull"] = "off hull" if plan.has_hull_split else "all"
    shells = []
    for planned, section in zip(plan.shells, plan.shell_sections, strict=True):
        if name not in planned.proxies:
            continue
        # A map that all parts read bears the name of its shell alone.
        is_last = planned is plan.shells[-1]
        its_map = planned.name if is_last and shared else f"{name}/{planned.name}"
        # Polygons on the convex hull cannot reflect the object.
        shells.append(
            Shell(
                planned.name,
                planned.proxies[name],
                its_map,
                plan.size_of(name, planned.name),
                hull if section.is_itself else "all",
                moves=section.is_itself,
            )
        )
    return Part(name, tuple(shells))
