"""`mirrorbake render`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import Exposure, Folder, Threads, ToneMap
from mirrorbake.commands.progress import messages, progress
from mirrorbake.errors import OptionError


def _parse_point(text: str) -> tuple[float, ...]:
    try:
        point = tuple(float(part) for part in text.split(",") if text.strip())
    except ValueError:
        point = (math.nan,)
    if not all(math.isfinite(value) for value in point):
        raise OptionError(f"view = {text}: expected numbers, separated by commas")
    return point


@reports_errors
def render_command(
    directory: Folder,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="FILE",
            help="An .exr (scene-linear) or a .png (sRGB). With --frames, {} stands for the number.",
            show_default=False,
        ),
    ],
    view: Annotated[
        str | None,
        typer.Option(
            "--view",
            metavar="T",
            help="Point of the parameter space: 0 to 1 along an arc; azimuth,elevation of a dome.",
            show_default=False,
        ),
    ] = None,
    frames: Annotated[
        int | None,
        typer.Option(
            "--frames",
            metavar="N",
            help="Instead of --view: N pictures along the first axis of the parameter space.",
            show_default=False,
        ),
    ] = None,
    away: Annotated[
        str,
        typer.Option(
            "--away",
            metavar="AZIMUTH,ELEVATION",
            help="Of --view: degrees that the eye moves on from there; the PEM fades to its static set.",
        ),
    ] = "0,0",
    exposure: Exposure = 0.0,
    tone: ToneMap = "none",
    threads: Threads = 0,
) -> None:
    """Draw a PEM at any point of its parameter space, blended between the neighbouring samples."""
    if (view is None) == (frames is None):
        raise OptionError("expected --view T for one picture, or --frames N for a walk, and not both")
    moved = _parse_point(away)
    if len(moved) != 2:
        raise OptionError(f"away = {away}: expected degrees of azimuth and elevation, such as 0,10")
    with _core.ThreadLimit(threads):
        if view is not None:
            from mirrorbake.pem.render import render

            point = _parse_point(view)
            render(directory, point, out, (moved[0], moved[1]), exposure=exposure, tone=tone)
        else:
            if any(moved):
                raise OptionError(f"away = {away}: goes with --view, not with --frames")
            _render_frames(directory, out, frames, exposure, tone)
    messages.print(f"wrote {out}", markup=False, soft_wrap=True)


def _render_frames(directory: Path, out: Path, frames: int | None, exposure: float, tone: str) -> None:
    from mirrorbake.pem.export.video import export_stills
    from mirrorbake.pem.opened import open_pem

    pem = open_pem(directory)
    with progress() as add_bar:
        export_stills(pem, out, frames=frames, exposure=exposure, tone=tone, report=add_bar("render"))
