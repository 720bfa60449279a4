"""`mirrorbake render`."""

from __future__ import annotations

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


@reports_errors
def render_command(
    directory: Folder,
    view: Annotated[
        float,
        typer.Option("--view", metavar="T", help="Parameter of the arc, from 0 to 1.", show_default=False),
    ],
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="FILE", help="An .exr (scene-linear) or a .png (sRGB).", show_default=False
        ),
    ],
    threads: Threads = 0,
) -> None:
    """Draw a PEM at any parameter of its arc, blended between the neighbouring views."""
    from mirrorbake.pem.render import render

    with _core.ThreadLimit(threads):
        render(directory, view, out)
    messages.print(f"wrote {out}", markup=False, soft_wrap=True)
