"""Progress bars and messages, on stderr."""

from __future__ import annotations

import contextlib
import time
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from mirrorbake.bake.bake import ProgressReport

messages = Console(stderr=True, highlight=False)

SECONDS_BETWEEN_LINES = 10.0
"""Where no terminal shows bars, as in a log. What takes less prints none."""


def _lines(title: str) -> ProgressReport:
    last = time.monotonic()

    def report(done: int, total: int, text: str) -> None:
        nonlocal last
        if time.monotonic() - last >= SECONDS_BETWEEN_LINES:
            last = time.monotonic()
            messages.print(f"{title}: {done} of {total}, {text}", markup=False, soft_wrap=True)

    return report


@contextlib.contextmanager
def progress() -> Iterator[Callable[[str], ProgressReport]]:
    """Show progress on stderr: bars on a terminal, else a line now and then. What is yielded adds one."""
    if not messages.is_terminal:
        yield _lines
        return
    columns = (
        TextColumn("[bold]{task.fields[title]}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=messages) as bars:

        def add(title: str) -> ProgressReport:
            task = bars.add_task("", title=title)

            def report(done: int, total: int, text: str) -> None:
                bars.update(task, completed=done, total=total, description=text)

            return report

        yield add
