"""`mirrorbake render`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import (
    Folder,
    Threads,
)
from mirrorbake.commands.progress import messages
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
    view: Annotated[
        str,
        typer.Option(
            "--view",
            metavar="T",
            help="Point of the parameter space: 0 to 1 along an arc; azimuth,elevation of a dome.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="FILE", help="An .exr (scene-linear) or a .png (sRGB).", show_default=False
        ),
    ],
    away: Annotated[
        str,
        typer.Option(
            "--away",
            metavar="AZIMUTH,ELEVATION",
            help="Degrees that the eye moves on from there; the PEM fades to its static set.",
        ),
    ] = "0,0",
    threads: Threads = 0,
) -> None:
    """Draw a PEM at any point of its parameter space, blended between the neighbouring samples."""
    from mirrorbake.pem.render import render

    with _core.ThreadLimit(threads):
        moved = _parse_point(away)
        if len(moved) != 2:
            raise OptionError(f"away = {away}: expected degrees of azimuth and elevation, such as 0,10")
        render(directory, _parse_point(view), out, (moved[0], moved[1]))
    messages.print(f"wrote {out}", markup=False, soft_wrap=True)
