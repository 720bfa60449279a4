"""`mirrorbake evaluate`."""

from __future__ import annotations

from typing import Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import (
    Json,
    Place,
    Threads,
    print_figures,
)
from mirrorbake.commands.progress import messages, progress


@reports_errors
def evaluate_command(
    directory: Place,
    json: Json = False,
    every: Annotated[
        bool, typer.Option("--all", help="Look at every sample and between every two, not at a selection.")
    ] = False,
    threads: Threads = 0,
) -> None:
    """Compare a PEM and its rivals with independent ray tracing, on its samples, between and off them."""
    from mirrorbake.evaluate.evaluate import METRICS_NAME, evaluate
    from mirrorbake.pem.location import Location

    location = Location.of(directory)
    with _core.ThreadLimit(threads), progress() as add_bar:
        evaluation = evaluate(location, add_bar("evaluate"), every_view=every)
    print_figures(evaluation, json)
    if evaluation.written:
        messages.print(f"wrote {location.joined(METRICS_NAME)}", markup=False, soft_wrap=True)
