"""`mirrorbake analyze`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import (
    Assignments,
    Draft,
    EmSize,
    Json,
    ObjectFile,
    Quality,
    Seed,
    Size,
    Sky,
    Spp,
    Threads,
    Views,
    scene_config,
)


@reports_errors
def analyze_command(
    scene: Annotated[
        Path | None, typer.Argument(metavar="SCENE.toml", help="The scene file.", show_default=False)
    ] = None,
    object_file: ObjectFile = None,
    sky: Sky = None,
    draft: Draft = None,
    views: Views = None,
    size: Size = None,
    spp: Spp = None,
    em_size: EmSize = None,
    seed: Seed = None,
    assignments: Assignments = None,
    quality: Quality = None,
    json: Json = False,
    threads: Threads = 0,
) -> None:
    """Tell what `bake` with the same options decides, and why: layers, bounces, samples, geometry, maps."""
    import json as json_module

    from mirrorbake.bake.analyze import analyze
    from mirrorbake.scene.stage import prepare_stage

    config = scene_config(
        scene, assignments, views, size, spp, em_size, seed, object_file, sky, draft=draft, quality=quality
    )
    with _core.ThreadLimit(threads):
        plan = analyze(prepare_stage(config))
    if json:
        typer.echo(json_module.dumps(plan.to_dict(), indent=1))
        return
    for line in plan.lines():
        typer.echo(line)
