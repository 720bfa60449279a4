"""The table of an evaluation, for a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from mirrorbake.evaluate.contenders import CONTENDERS, TITLES

if TYPE_CHECKING:
    from mirrorbake.evaluate.evaluate import Evaluation, ViewMetrics

MAX_TABLE_ROWS = 24
"""A longer evaluation is thinned out in the table; metrics.json has every view."""


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def metrics_table(evaluation: Evaluation) -> Table:
    """Return the table of an evaluation for a terminal."""
    table = Table(title="PSNR on the object, dB (display-referred)", title_justify="left")
    table.add_column("view t", justify="right", no_wrap=True)
    table.add_column("sampled", justify="center")
    for heading in ("trace s", "build s", "solve s", *(TITLES[name] for name in CONTENDERS)):
        table.add_column(heading, justify="right")
    stride = -(-len(evaluation.views) // MAX_TABLE_ROWS)
    # An odd stride keeps both sampled views and those between them.
    stride += stride % 2 == 0
    for view in evaluation.views[::stride]:
        table.add_row(*_row(view))
    table.add_section()
    for name, sampled in (("mean on samples", True), ("mean half-way", False)):
        chosen = [view for view in evaluation.views if view.sampled == sampled]
        if chosen:
            means = (evaluation.mean_psnr(contender, sampled=sampled) for contender in CONTENDERS)
            table.add_row(name, "", "", "", "", *(_number(value, 2) for value in means), style="bold")
    return table


def _row(view: ViewMetrics) -> list[str]:
    return [
        f"{view.t:.4f}",
        "yes" if view.sampled else "",
        _number(view.trace_s, 2),
        _number(view.build_s, 2),
        _number(view.solve_s, 2),
        *(_number(view.psnr[name], 2) for name in CONTENDERS),
    ]
