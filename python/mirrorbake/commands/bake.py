"""`mirrorbake bake`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import (
    Assignments,
    Draft,
    EmSize,
    ObjectFile,
    Quality,
    Seed,
    Size,
    Sky,
    Spp,
    Threads,
    Views,
    print_plan,
    scene_config,
)
from mirrorbake.commands.progress import messages, progress

if TYPE_CHECKING:
    from mirrorbake.bake.estimate import Estimate


def _parse_samples(text: str, count: int | None) -> range:
    """Return the numbers of samples; without a count, which a plan decides, they have to end somewhere."""
    first, separator, last = text.partition(":")
    start, end = first or "0", last or ("" if count is None else str(count))
    if not separator or not all(part.isascii() and part.isdigit() for part in (start, end)):
        raise typer.BadParameter(f"--samples {text!r}: expected I:J, such as 0:10 for the first ten")
    if not int(start) < int(end) or (count is not None and int(end) > count):
        most = "" if count is None else f", J at most {count}"
        raise typer.BadParameter(f"--samples {text!r}: expected I < J{most}")
    return range(int(start), int(end))


@reports_errors
def bake_command(
    out: Annotated[
        str,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Folder or URL for the PEM; goes on with one of the same scene.",
            show_default=False,
        ),
    ],
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
    samples: Annotated[
        str | None,
        typer.Option("--samples", metavar="I:J", help="Only samples I to J-1. [default: all]"),
    ] = None,
    workers: Annotated[
        str | None,
        typer.Option(
            "--workers", metavar="N|ADDRESS", help="Processes, or a Dask scheduler's address, that bake."
        ),
    ] = None,
    estimate: Annotated[
        bool, typer.Option("--estimate", help="Print what the bake will take, and stop there.")
    ] = False,
    threads: Threads = 0,
) -> None:
    """Bake a scene's reflections into one set of environment maps per sample of its parameter space.

    What the scene leaves to be decided ("auto") is decided first and printed, as `analyze` does, with the
    time and the disk space that the bake will take. Instead of a scene file, --object and --sky are enough.
    """
    from mirrorbake.bake.bake import bake
    from mirrorbake.scene.parameters import space_of

    config = scene_config(
        scene, assignments, views, size, spp, em_size, seed, object_file, sky, draft=draft, quality=quality
    )
    total = None if config.views.awaits_spacing else len(space_of(config))
    chosen = None if samples is None else _parse_samples(samples, total)

    def announce(found: Estimate) -> bool:
        messages.print(str(found), markup=False, soft_wrap=True)
        return not estimate

    with _core.ThreadLimit(threads), progress() as add_bar:
        report = add_bar("bake")
        summary = bake(config, out, report, None, print_plan, chosen, workers=workers, on_estimate=announce)
    warnings = list(summary.notes)
    if summary.unconverged:
        warnings.append(
            f"the solver stopped before it converged in {len(summary.unconverged)} maps, the first is "
            f"{summary.unconverged[0]}; a larger infer.iterations, infer.tolerance or infer.smoothness helps"
        )
    if summary.clamped:
        warnings.append(
            f"{summary.clamped} values above 65504 were clamped; maps.precision = 'float32' keeps them"
        )
    for warning in warnings:
        messages.print(f"warning: {warning}", markup=False, soft_wrap=True)
    if estimate:
        return
    resumed = f", {summary.resumed} of them from an earlier run" if summary.resumed else ""
    count = summary.views if chosen is None else len(chosen)
    messages.print(f"{out}: {count} samples{resumed}", markup=False, soft_wrap=True)
