"""`mirrorbake bake`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import (
    Assignments,
    EmSize,
    Seed,
    Size,
    Spp,
    Threads,
    Views,
    print_plan,
    scene_config,
)
from mirrorbake.commands.progress import messages, progress


@reports_errors
def bake_command(
    scene: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="The scene file.", show_default=False)],
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Folder for the PEM; resumes one of the same scene.",
            show_default=False,
        ),
    ],
    views: Views = None,
    size: Size = None,
    spp: Spp = None,
    em_size: EmSize = None,
    seed: Seed = None,
    assignments: Assignments = None,
    threads: Threads = 0,
) -> None:
    """Bake a scene's reflections into one set of environment maps per view of the arc.

    What the scene leaves to be decided ("auto") is decided first and printed, as `analyze` does.
    """
    from mirrorbake.bake.bake import bake

    config = scene_config(scene, assignments, views, size, spp, em_size, seed)
    with _core.ThreadLimit(threads), progress() as add_bar:
        summary = bake(config, out, add_bar("bake"), on_plan=print_plan)
    warnings = list(summary.notes)
    if summary.clamped:
        warnings.append(
            f"{summary.clamped} values above 65504 were clamped; maps.precision = 'float32' keeps them"
        )
    for warning in warnings:
        messages.print(f"warning: {warning}", markup=False, soft_wrap=True)
    resumed = f", {summary.resumed} of them from an earlier run" if summary.resumed else ""
    messages.print(f"{out}: {summary.views} views{resumed}", markup=False, soft_wrap=True)
