"""`mirrorbake report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import Place, Threads
from mirrorbake.commands.progress import messages, progress


@reports_errors
def report_command(
    directory: Place,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="The page. [default: DIR/report.html; of a URL none]"),
    ] = None,
    threads: Threads = 0,
) -> None:
    """Evaluate a PEM and write a page about it, with pictures to compare, that needs no other file."""
    from mirrorbake.evaluate.report import report
    from mirrorbake.study.trade.show import section

    limit = _core.ThreadLimit(threads)
    with progress() as add_bar:
        path = report(directory, out, add_bar("report"), sections=[section])
    del limit
    messages.print(f"wrote {path}", markup=False, soft_wrap=True)
