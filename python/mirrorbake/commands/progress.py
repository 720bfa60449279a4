"""Progress bars and messages, on stderr."""

from __future__ import annotations

import contextlib
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


@contextlib.contextmanager
def progress() -> Iterator[Callable[[str], ProgressReport]]:
    """Show progress bars on stderr; what is yielded adds one."""
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
