"""`mirrorbake demo`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import Json, Threads, print_figures
from mirrorbake.commands.progress import messages, progress


@reports_errors
def demo_command(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")] = Path(
        "out/demo"
    ),
    json: Json = False,
    threads: Threads = 0,
) -> None:
    """Bake and evaluate a small teapot scene: about a minute on two cores."""
    from mirrorbake.evaluate.demo import run_demo

    with _core.ThreadLimit(threads), progress() as add_bar:
        evaluation, sheet = run_demo(out, add_bar)
    print_figures(evaluation, json)
    messages.print(f"wrote {sheet}", markup=False, soft_wrap=True)
