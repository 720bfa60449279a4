"""`mirrorbake evaluate`."""

from __future__ import annotations

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import (
    Folder,
    Json,
    Threads,
    print_figures,
)
from mirrorbake.commands.progress import messages, progress


@reports_errors
def evaluate_command(directory: Folder, json: Json = False, threads: Threads = 0) -> None:
    """Compare a PEM and static maps with ray tracing, on the sampled views and half-way between them."""
    from mirrorbake.evaluate.evaluate import METRICS_NAME, evaluate

    limit = _core.ThreadLimit(threads)
    with progress() as add_bar:
        evaluation = evaluate(directory, add_bar("evaluate"))
    del limit
    print_figures(evaluation, json)
    messages.print(f"wrote {directory / METRICS_NAME}", markup=False, soft_wrap=True)
