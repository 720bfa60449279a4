"""`mirrorbake sheet`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import Folder, Threads
from mirrorbake.commands.progress import messages


@reports_errors
def sheet_command(
    directory: Folder,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE.png", help="The picture. [default: DIR/contact-sheet.png]"),
    ] = None,
    threads: Threads = 0,
) -> None:
    """Draw a contact sheet of a PEM: ray tracing, the PEM and static maps side by side, with their errors."""
    from mirrorbake.evaluate.contact_sheet import SHEET_NAME, contact_sheet
    from mirrorbake.files import check_writable
    from mirrorbake.pem.opened import open_pem

    path = directory / SHEET_NAME if out is None else out
    with _core.ThreadLimit(threads):
        pem = open_pem(directory)
        check_writable(path)
        contact_sheet(pem, path)
    messages.print(f"wrote {path}", markup=False, soft_wrap=True)
